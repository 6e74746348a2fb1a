"""MuJoCo beside stickslip: speed at equal accuracy, creep of a contact, what policies earn.

    python -m benchmarks.peers [--quick] [--update] [--only PART ...] [--out FILE]

rows: stickslip and MuJoCo (extra `bench`), each at several settings, in one run. creep: of a
contact that sticks. transfer: how much of a score survives where MuJoCo computes the motion, about
a minute of processor time a task. --update also writes the tables of docs/performance.md.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from importlib import import_module
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from benchmarks.peers.programs import BOUNDS, CASES, mujoco_rows, stickslip_rows
from benchmarks.report import markdown, measured_by_command, put_between, where
from stickslip.agents import evaluate, load_policy
from stickslip.agents.evaluation.rollout import is_random
from stickslip.agents.exchange.mujoco_env import moved_by
from stickslip.agents.policy.shipped import policy_name
from stickslip.dynamics import Scene
from stickslip.dynamics.biped import BipedParams, BipedState, simulate
from stickslip.envs import TASKS, BipedEnv, known_of

SLOPE, TIMESTEP = 0.1, 0.002
"""Slope of the floor, a fifth of BOX's friction; MuJoCo's default timestep [s]."""
SETTLE, DURATION = 2.0, 10.0
"""Time before the creep is measured, and time over which it is [s]."""
EPISODES = 8
"""Episodes of a policy on a task whose resets draw."""
DOCUMENT = Path("docs/performance.md")
SOLVERS = (("pyramidal", 1, 0), ("elliptic", 1, 0), ("pyramidal", 10, 10), ("elliptic", 10, 10))
"""MuJoCo's cone, impratio and noslip iterations; its defaults come first."""
BOX = """
<mujoco>
  <option cone="{cone}" impratio="{impratio}" noslip_iterations="{noslip}"/>
  <worldbody>
    <geom type="plane" size="5 5 0.1" friction="0.5 0.005 0.0001"/>
    <body pos="0 0 0.05">
      <freejoint/>
      <geom type="box" size="0.1 0.1 0.05" mass="1" friction="0.5 0.005 0.0001"/>
    </body>
  </worldbody>
</mujoco>
"""


def creep_rows(quick: bool) -> Iterator[dict[str, Any]]:
    """Speed [um/s] of a contact whose friction suffices."""
    mujoco: Any = import_module("mujoco")
    for cone, impratio, noslip in SOLVERS:
        box = BOX.format(cone=cone, impratio=impratio, noslip=noslip)
        yield {
            "contact": "box on a slope",
            "program": f"MuJoCo {mujoco.__version__}",
            "setting": f"{cone} cone, impratio {impratio}, noslip_iterations {noslip}",
            "creep": _creep_of_box(mujoco, box, DURATION / (10 if quick else 1)),
        }
    yield {
        "contact": "foot of the biped",
        "program": "stickslip",
        "setting": "default",
        "creep": _creep_of_foot(),
    }


def _creep_of_box(mujoco: Any, box: str, duration: float) -> float:
    model, angle = mujoco.MjModel.from_xml_string(box), np.arctan(SLOPE)
    model.opt.gravity = 9.81 * np.array([np.sin(angle), 0.0, -np.cos(angle)])
    data = mujoco.MjData(model)
    mujoco.mj_step(model, data, nstep=round(SETTLE / TIMESTEP))
    start = float(data.qpos[0])
    mujoco.mj_step(model, data, nstep=round(duration / TIMESTEP))
    return 1e6 * (float(data.qpos[0]) - start) / duration


def _creep_of_foot() -> float:
    """Largest speed of the foot [um/s] until it slips: 0.69 s under 1 N m at a friction of 0.4."""
    with jax.enable_x64(True):
        robot, scene = BipedParams.from_bars(), Scene.uniform(0.4, 0.4)
        walk = simulate(robot, scene, BipedState(phase=np.pi / 2), 1.0, 0.69, 0.01)
        return 1e6 * float(jnp.max(jnp.abs(walk.states.foot_velocity)))


def transfer_rows(quick: bool) -> Iterator[dict[str, Any]]:
    """Scores with half their intervals in the three places, and the episodes that fall in each."""
    for task in TASKS.values():
        env, params = task.make("disabled")
        known = known_of(task)
        if not isinstance(env, BipedEnv) or known is None:
            continue
        seeds = range((1 if quick else EPISODES) if is_random(env, params) else 1)
        name, inside = policy_name(task.name), moved_by(env, "mujoco")
        bare = replace(inside, swing_contact=False)
        places = {"score here": env, "in MuJoCo": inside, "no swing contact": bare}
        row: dict[str, Any] = {"task": task.name, "episodes": len(seeds)}
        policies, scenes, falls = {name: load_policy(name)}, {task.name: params}, []
        for place, own in places.items():
            table = evaluate(own, policies, scenes, episodes=len(seeds))
            played = table.rows[0].episodes
            row[place] = known.score(played.reward, seeds).shown(2)
            falls.append(f"{np.sum(played.fell):d}")
        row["falls"] = ", ".join(falls)
        yield row


def rows(quick: bool) -> Iterator[dict[str, Any]]:
    """Every setting of both programs on both walks."""
    with jax.enable_x64(True):
        for case in CASES:
            yield from stickslip_rows(case, quick)
            yield from mujoco_rows(case, quick)


def at_bounds(rows: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Simulated seconds a core-second by the fastest setting that meets each accuracy."""
    groups: dict[tuple, list[dict[str, Any]]] = {}
    for row in rows:
        if row["error"] is not None:
            groups.setdefault((row["case"], row["program"], row["batch"]), []).append(row)
    return [
        {"walk": case, "program": program, "batch": batch}
        | {f"{bound:g} rad": _fastest(group, bound) for bound in BOUNDS}
        for (case, program, batch), group in groups.items()
    ]


def _fastest(rows: list[dict[str, Any]], bound: float) -> str:
    meet = [row for row in rows if row["error"] <= bound]
    if not meet:
        return f"not reached ({min(row['error'] for row in rows):.1e})"
    best = max(meet, key=lambda row: row["core_rate"])
    digits = ",.0f" if best["core_rate"] >= 100 else ".3g"
    return f"{best['core_rate']:{digits}} ({best['setting']})"


def body(content: dict[str, Any]) -> str:
    """The table of docs/performance.md."""
    return f"Measured on {where(content, 'rows')}.\n\n{markdown(at_bounds(content['rows']))}"


def update(content: dict[str, Any]) -> None:
    """Write the page's tables."""
    put_between(DOCUMENT, body(content), "peers")
    creeps = [row | {"creep": f"{row['creep']:.3g} um/s"} for row in content["creep"]]
    for part, shown in {"creep": creeps, "transfer": content["transfer"]}.items():
        put_between(DOCUMENT, f"Measured on {where(content, part)}.\n\n{markdown(shown)}", part)


if __name__ == "__main__":
    parts = {"rows": rows, "creep": creep_rows, "transfer": transfer_rows}
    measured_by_command("peers", __doc__, parts, update)
