"""An instance whose answers are on paper."""

import jax
import jax.numpy as jnp
import numpy as np

from stickslip.optim import FunctionProblem, Instance
from stickslip.optim.instances.instance import Flags

LOW, HIGH = np.array([-2.0, -2.0, 0.5]), np.array([2.0, 2.0, 0.5])


def bowl(data, x, draw):
    """A bowl round (1, 0) outside of which lies x0 + x1 <= 0.5; the second goal leans away."""
    noise = data * jax.random.normal(jax.random.key(draw), (), x.dtype)
    values = jnp.stack([(x[0] - 1) ** 2 + x[1] ** 2 + noise, (x[0] + 1) ** 2 + x[1] ** 2])
    return values, (0.5 - x[0] - x[1])[None]


def toy(goals: int = 1, noise: float = 0.0) -> Instance:
    """Least at (0.75, -0.25): 0.125."""

    def build():
        return tuple(FunctionProblem(bowl, noise, LOW, HIGH, goal=i) for i in range(goals))

    flags = Flags(convex=True, smooth=True, noisy=noise > 0)
    return Instance("toy-d2-v1", "toy", "a bowl", ("value [-]",) * goals, 2, build, flags)


LEAST = 0.125
