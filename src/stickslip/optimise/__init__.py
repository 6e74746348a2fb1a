"""`stickslip optimise`: a posture or a gait problem, solved, printed, drawn and kept."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Mapping

    from stickslip.records.table import Content


def optimise_command(flags: Mapping[str, Any]) -> Content:
    """Run the machine's command."""
    if flags["machine"] == "biped":
        from stickslip.optimise.gait import optimise_gait_command

        return optimise_gait_command(flags)
    from stickslip.optimise.ugv import optimise_ugv_command

    return optimise_ugv_command(flags)
