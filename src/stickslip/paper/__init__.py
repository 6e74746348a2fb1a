"""The figures of the chapter, computed again, and its claims beside what comes out.

`stickslip reproduce` runs it (`command.py`). A figure's module computes its data, draws it and
states the claims (`result.py`); `registry.py` knows the figures by name.
"""
