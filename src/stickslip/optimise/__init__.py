"""`stickslip optimise`: a posture problem from the command line, solved, printed, drawn and kept.

`flags.py` reads what is asked for, `command.py` runs it, `ground.py` finds the track, `report.py`
writes the table, the CSV and the JSON, `picture.py` draws a result, `vehicle.py` the vehicle along
a track.
"""
