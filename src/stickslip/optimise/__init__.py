"""`stickslip optimise`: a posture or a gait problem, solved, printed, drawn and kept.

`flags.py` reads what is asked for, `command.py` runs it, `ground.py` finds the track, `report.py`
writes the table, the CSV and the JSON, `picture.py` draws a result, `vehicle.py` the vehicle along
a track. The same of the biped's gaits: `gait_command.py`, `gait_report.py`,
`gait_picture.py`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Mapping

    from stickslip.records.content import Content


def optimise_command(flags: Mapping[str, Any]) -> Content:
    """Run the machine's command."""
    if flags["machine"] == "biped":
        from stickslip.optimise.gait_command import optimise_gait_command

        return optimise_gait_command(flags)
    from stickslip.optimise.command import optimise_ugv_command

    return optimise_ugv_command(flags)
