"""`stickslip optimise`: a posture or a gait problem, solved, printed, drawn and kept.

`flags.py` reads what is asked for, `command.py` runs it, `ground.py` finds the track, `report.py`
writes the table, the CSV and the JSON, `picture.py` draws a result, `vehicle.py` the vehicle along
a track. The same of the biped's gaits: `gait_command.py`, `gait_report.py`,
`gait_picture.py`.
"""
