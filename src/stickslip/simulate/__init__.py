"""`stickslip simulate`: a walk under a torque, or a drive with given leg angles."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Mapping

    from stickslip.records.table import Content


def simulate_command(flags: Mapping[str, Any]) -> Content:
    """Run the machine's command."""
    if flags["machine"] == "biped":
        from stickslip.simulate.biped import simulate_biped_command

        return simulate_biped_command(flags)
    from stickslip.simulate.ugv import simulate_ugv_command

    return simulate_ugv_command(flags)
