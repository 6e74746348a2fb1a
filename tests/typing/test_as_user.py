"""Blocks of a document become programs that stand on the document's own lines."""

from tests.typing.as_user import missing, programs

TEXT = """Some words.

```python
import math
a = math.pi
```

More, which goes on:

```python
b = a + 1
```

And another thing:

```python
a = 2
```
"""


def test_a_block_that_uses_what_it_does_not_make_continues_the_one_before():
    found = dict(programs(TEXT))
    assert list(found) == [4, 11, 17]
    assert found[11].splitlines()[3:5] == ["import math", "a = math.pi"]
    assert found[11].splitlines()[10] == "b = a + 1"
    assert found[17].split() == ["a", "=", "2"]


def test_names_that_a_program_does_not_make_are_missing():
    code = "import a.b as c\nfor x in c.d: print(x, y)\ndef f(z): return z + w"
    assert missing(code) == {"y", "w"}
