"""Status of a traced step, as integers that pass through jit and vmap."""

from enum import IntEnum


class Code(IntEnum):
    """An integer that prints its name."""

    def __str__(self) -> str:
        return self.name

    def __format__(self, spec: str) -> str:
        return format(self.name, spec)


class Status(Code):
    """Outcome of a step or of one force computation.

    `OK` and `SLIP_ONSET` are the model at work; every other value says that the state has left
    what the model covers, and the numbers beside it are the last ones inside it.
    """

    OK = 0
    """Inside the model."""
    SLIP_ONSET = 1
    """Inside the model; the foot broke loose during this step."""
    TOPPLE = 2
    """The zero-moment point (eq. 30) lies outside the foot."""
    LIFT_OFF = 3
    """The ground would have to pull: normal force <= 0."""
    RUNAWAY = 4
    """|crank rate| beyond the greatest that was given (an environment's max_crank_rate)."""
    NO_SOLUTION = 5
    """The linkage cannot close here, sliding has no unique solution (Painleve), or the crank angle
    is none at which the leg supports."""
    NON_FINITE = 6
    """A number overflowed or was not a number to begin with."""
    STEP_COMPLETE = 7
    """A one-step scene reached the exchange of support."""
    NO_EXCHANGE = 8
    """Support cannot be handed over without an impact: the linkage is not symmetric."""
    NOT_CONVERGED = 9
    """An adaptive method used up its steps, or the crank turns by over half a support phase in a
    fixed one. The numbers are where it had got to."""
    HOLLOW_GROUND = 10
    """The ground is hollower than a wheel: it would touch at another point, too."""
    ROLLOVER = 11
    """The UGV: the ground would have to pull at a wheel, normal force <= 0."""
    GROUNDED = 12
    """The UGV: the body or a leg touches the ground."""
    WHEEL_SLIP = 13
    """The UGV: a wheel needs more friction than mu times its normal force."""
    OVERLOAD = 14
    """The UGV: a wheel needs more torque than its motor gives."""
    OVERLAP = 15
    """The UGV: its wheels overlap, the centres being closer than two radii and the gap."""

    @property
    def terminal(self) -> bool:
        """True if the model stops here."""
        return self > Status.SLIP_ONSET

    @property
    def words(self) -> str:
        """Its name in words, as "lift off"."""
        return self.name.lower().replace("_", " ")


class EventKind(Code):
    """Kind of a switching event inside a step."""

    NONE = 0
    SLIP = 1
    """The foot breaks loose (or starts back the other way)."""
    STICK = 2
    """The sliding foot stops (eq. 36)."""
    EXCHANGE = 3
    """Support passes to the other foot."""
    PATCH = 4
    """The sliding foot crosses the edge of a floor patch."""
