"""Names of floors, grounds, links and lengths, known without JAX."""

from typing import Any

SCENES = ("slippery", "grip", "firm", "wet", "ice-patch")
"""Names that `Scene.named` accepts."""

TRACKS = ("flat", "incline", "bump", "sinusoid", "ramp", "step", "ditch", "rough")
"""The named tracks: each is a constructor of Track, also reached by Track.named."""

RANDOM_TRACKS = ("random-bump", "random-rough", "random-mixed")
"""Names that `RandomTrack.named` accepts."""
LINKS = (
    *("foot", "tibia", "femur", "lower tendon", "knee link", "upper tendon", "connecting rod"),
    *("crank", "rocker", "stabiliser", "tibia bar", "femur bar", "hip"),
)
"""The 13 kinds of link of the biped; entry i is the chapter's link i + 1. Both legs share them."""

BAR_LENGTHS = (
    *("tibia", "femur", "lower_tendon", "offset", "upper_tendon", "rod"),
    *("crank", "rocker", "stabiliser", "tibia", "femur"),
)
"""The length of each link between foot and hip, in LINKS' order. The crank has two arms."""
ABOVE_ZERO = (
    *("crank", "ground_link", "rod", "rod_pin", "rocker", "tendon_drop", "upper_tendon"),
    *("lower_tendon", "femur", "femur_pin", "tibia", "tibia_pin", "stabiliser"),
)
LENGTHS = (*ABOVE_ZERO, "slot_depth", "offset", "heel", "toe")
"""The fields of BipedParams that are lengths [m]; the first ones are > 0."""


def range_of(name: str) -> dict[str, Any]:
    """What a number of a robot, its motor or `from_bars` may be, for `require_number`."""
    if name == "efficiency":
        return {"low": 0.0, "high": 1.0, "strict": True, "accepted": "above 0, up to 1"}
    if "centre" in name:
        return {"accepted": "a finite number"}
    above = name in (*ABOVE_ZERO, "crank_length", "gravity", "torque_limit", "max_power")
    return {"low": 0.0, "strict": above, "accepted": f"a finite number {'>' if above else '>='} 0"}


UNKNOWNS = {
    "payload": (0.0, 1.0),
    "mass_factor": (1.0, 0.1),
    "torque_loss": (0.0, 0.3),
    "encoder_bias": (0.0, 0.03),
    "encoder_delay": (0.0, 0.02),
}
"""Numbers that stay the same during the biped's walk and that a log may tell: payload [kg], factor
of the robot's masses and inertias [-], torque lost in the drive [N m], of the encoder the bias
[rad] and the delay [s]. With each, what is taken for it before a walk and its standard deviation.
"""
