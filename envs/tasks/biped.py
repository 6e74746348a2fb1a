"""The biped's tasks. What stands here never changes: another content is another version."""

from __future__ import annotations

from typing import TYPE_CHECKING

from stickslip.envs.tasks.definition import TaskDefinition

if TYPE_CHECKING:
    from stickslip.envs.plain import Plain

ANY_PHASE: Plain = [1.5707963267948966, 4.71238898038469]
"""The whole support phase [rad]."""
SLIPPERY: Plain = {"uniform": {"mu_static": 0.06, "mu_kinetic": 0.05}}
"""Too slippery for a constant crank rate of 3 rad/s."""
ANY_FRICTION: Plain = {"uniform": {"mu_static": 1.0, "mu_kinetic": 0.83}}
"""Floor that a drawn factor multiplies."""
ICE: Plain = {
    "patches": {
        "edges": [0.3, 0.6, 1.0, 1.2, 1.7, 2.2, 2.5, 2.7],
        "mu_static": [0.5, 0.03, 0.5, 0.03, 0.5, 0.03, 0.5, 0.03, 0.5],
        "mu_kinetic": [0.4, 0.025, 0.4, 0.025, 0.4, 0.025, 0.4, 0.025, 0.4],
    }
}
"""Four sheets of ice on a floor that holds."""


CHOICES: dict[str, Plain] = {
    "fidelity": "table",
    "substeps": 1,
    "max_events": 3,
    "see_friction": False,
    "see_patch": False,
}
NUMBERS: dict[str, Plain] = {
    "torque_limit": 4.0,
    "control_period": 0.02,
    "commanded_rate": 3.0,
    "time_limit": 10.0,
    "max_crank_rate": 20.0,
    "copper_loss": 0.5,
    "tracking_weight": 1.0,
    "slip_weight": 5.0,
    "energy_weight": 0.5,
    "fall_penalty": 5.0,
}
"""Defaults of the tasks, written down so that no default elsewhere changes a task."""


def _task(
    stem: str, title: str, about: str, unit: str = "-", version: int = 0, **content: Plain
) -> TaskDefinition:
    """A task of the biped with the reference robot; names of CHOICES are static choices."""
    choices = CHOICES | {name: content.pop(name) for name in CHOICES if name in content}
    parameters = NUMBERS | content
    names = (stem, title, about, "biped", "BipedEnv")
    return TaskDefinition(*names, parameters, choices, unit, version)


def _moving(up_to: float, **ranges: Plain) -> Plain:
    """Begun at any phase, with a crank rate up to that; other ranges beside it."""
    return {"phase": ANY_PHASE, "crank_rate": [0.0, up_to], **ranges}


BIPED_WITHDRAWN: dict[str, str] = {
    "BipedSprint-v0": "its best known lived on the errors of one integrator step a control period"
}
"""Reasons of withdrawn versions, by name."""
BIPED_TASKS = (
    _task(
        "BipedSteady",
        "walk at 3 rad/s on a slippery floor",
        "The standard task, nearly solved by hand: here to see that a method works at all.",
        scene=SLIPPERY,
        commanded_rate=3.0,
        randomisation=_moving(3.0),
    ),
    _task(
        "BipedFast",
        "walk at 6.5 rad/s on the same floor",
        "Near the fastest gait that does not slip (7.1 rad/s). Walks pass close by toppling, and "
        "the motor's limit is met in every step.",
        scene=SLIPPERY,
        commanded_rate=6.5,
        randomisation=_moving(6.5),
    ),
    _task(
        "BipedSlippery",
        "walk at 5 rad/s on a friction of 0.02",
        "Hardly any torque goes in without a slide: the best policy known slides 4 mm a metre.",
        scene={"uniform": {"mu_static": 0.02, "mu_kinetic": 0.017}},
        commanded_rate=5.0,
        randomisation=_moving(3.0),
    ),
    _task(
        "BipedWeakMotor",
        "walk at 5 rad/s with half the motor",
        "A motor of 2 N m cannot hold a constant momentum at this speed: swing must be stored.",
        scene=SLIPPERY,
        torque_limit=2.0,
        commanded_rate=5.0,
        randomisation=_moving(5.0),
    ),
    _task(
        "BipedThrift",
        "spend little at 3 rad/s",
        "Energy counts ten times as much as usual and slip a fifth: speed may swing where that "
        "saves work.",
        scene=SLIPPERY,
        commanded_rate=3.0,
        energy_weight=5.0,
        slip_weight=1.0,
        randomisation=_moving(3.0),
    ),
    _task(
        "BipedSprint",
        "as far as possible in 10 s from rest",
        "The return is the way of the centre of mass. Slip and energy are free; a fall costs what "
        "was still to come.",
        unit="m",
        version=1,
        substeps=2,
        max_events=6,
        scene=SLIPPERY,
        commanded_rate=15.707963267948966,
        tracking_weight=1.2,
        slip_weight=0.0,
        energy_weight=0.0,
        fall_penalty=0.0,
    ),
    _task(
        "BipedStop",
        "walk from rest to a mark, stop there and stand",
        "The mark lies 1 to 3 m ahead of the centre of mass. Each instant pays by the distance "
        "from it, half at 0.1 m; slip and energy cost as usual. Friction limits how late braking "
        "may begin.",
        scene=SLIPPERY,
        commanded_rate=5.0,
        mark=2.0,
        mark_width=0.1,
        randomisation={"mark": [1.0, 3.0]},
    ),
    _task(
        "BipedHiddenFriction",
        "walk at commanded speeds on floors that are not seen",
        "Friction is drawn from 0.02 to 0.2 and not told; commands from 3 to 8 rad/s come anew "
        "after 1 to 4 s.",
        scene=ANY_FRICTION,
        randomisation=_moving(
            6.0,
            friction=[0.02, 0.2],
            commanded_rate=[3.0, 8.0],
            command_interval=[1.0, 4.0],
        ),
    ),
    _task(
        "BipedPayload",
        "walk at 6 rad/s with masses that are not known",
        "All masses are scaled by 0.6 to 1.5, and up to 4 kg lie on the hip; neither is observed.",
        scene=SLIPPERY,
        commanded_rate=6.0,
        randomisation=_moving(6.0, mass=[0.6, 1.5], payload=[0.0, 4.0]),
    ),
    _task(
        "BipedIce",
        "walk at 6 rad/s over sheets of ice that are not seen",
        "Four sheets of friction 0.03 in a floor of 0.5. The foot tells of a sheet when it slides.",
        scene=ICE,
        commanded_rate=6.0,
        randomisation=_moving(8.0),
    ),
    _task(
        "BipedIceSeen",
        "the same with the next sheet in sight",
        "The distance to the next change of the floor, and the friction behind it and underfoot, "
        "are observed.",
        see_patch=True,
        see_friction=True,
        scene=ICE,
        commanded_rate=6.0,
        randomisation=_moving(8.0),
    ),
)
