"""How fast a sweep is, by tile, chunk, cores, devices and workers; what ten million episodes take.

    python -m benchmarks.scaling [--only tiles chunks devices workers] [--docs docs/sweeps.md]

The biped under crank-speed-pi on the standard task for 10 s (500 control steps), friction as the
axis. "tiles": one program's call, by how many episodes it holds; seconds of processor time, which
do not grow when others want the processor. "chunks": whole sweeps into a directory, files
included, by chunk and cores. "workers": the same on processes of this machine. Rates of whole
sweeps are counted between the first chunk written and the last, so compiling stands apart; they are
of the clock, and the processor time of this process beside them. Results go to a JSON file.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
import time
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.pictures import pyplot
from benchmarks.report import (
    kept_parts,
    markdown,
    options,
    provenance,
    put_between,
    where,
    write_json,
)
from benchmarks.timing import seconds_of
from stickslip.agents import CrankSpeedPI
from stickslip.agents.biped.task import from_anywhere
from stickslip.agents.sweeps.design import design_of
from stickslip.agents.sweeps.files import chunks
from stickslip.agents.sweeps.named import played_on
from stickslip.agents.sweeps.plan import Layout, Plan
from stickslip.agents.sweeps.playing.play import Player
from stickslip.agents.sweeps.sweep import run_plan
from stickslip.envs import BipedEnv

TILES = (1, 16, 256, 1024, 4096, 32768, 262144)
LONG = 10_000
"""Episodes of a tile that is played once, not three times, after the first."""
STEPS = 500
EACH = 64
"""Episodes a point."""
MANY = 10**7
BLUE = "#0072B2"
MARKS = ("<!-- scaling -->", "<!-- end of scaling -->")
PARTS = ("tiles", "chunks", "devices", "workers")
COUNTS = (1, 2, 4)
"""Of devices and of workers."""


def plan_of(points: int, episodes: int = EACH, summaries: bool = False) -> Plan:
    """A sweep of the standard task over so many frictions."""
    env = BipedEnv(autoreset="disabled")
    task = (env, from_anywhere(env.make_params()))
    machine, played = played_on(task, {"crank-speed-pi": CrankSpeedPI()})
    design = design_of({"mu": f"0.02:0.3:{points}"}, None, 0)
    return Plan.of(
        machine, played, design, episodes=episodes, independent=True, summaries=summaries
    )


def tile_row(size: int, repeats: int) -> dict[str, Any]:
    """One program of so many episodes: what compiling and running it takes."""
    each = min(size, EACH)
    plan = plan_of(size // each if size > each else 2, each)
    points = size // each
    player = Player(plan.__class__(**vars_of(plan), layout=Layout(points, each, points)))
    tile, _ = next(player.plan.tiles(player.plan.chunks[0]))
    play = partial(player.programs.play, player.plan.cases[0], "", tile)
    begun, used = time.perf_counter(), time.process_time()
    play()
    first, first_used = time.perf_counter() - begun, time.process_time() - used
    processor, wall = seconds_of(play, repeats)
    (program,) = player.programs._made.values()
    memory = program.memory_analysis()
    kinds = ("temp_size_in_bytes", "argument_size_in_bytes", "output_size_in_bytes")
    return {
        "tile": size,
        "processor_seconds": processor,
        "wall_seconds": wall,
        "first_seconds": first,
        "first_processor_seconds": first_used,
        "episodes_a_core_second": size / processor,
        "steps_a_core_second": size * STEPS / processor,
        "bytes_an_episode": sum(int(getattr(memory, kind)) for kind in kinds) / size,
    }


def vars_of(plan: Plan) -> dict[str, Any]:
    """A plan's fields but the layout."""
    names = ("machine", "cases", "design", "episodes", "independent", "summaries")
    return {name: getattr(plan, name) for name in names}


def sweep_row(plan: Plan, chunk: int, **how: Any) -> dict[str, Any]:
    """A whole sweep into a directory that is deleted again."""
    written: list[tuple[float, float, int]] = []
    keep = chunks.keep_chunk

    def kept(plan: Plan, path: Path, index: int, columns: dict[str, np.ndarray]) -> None:
        keep(plan, path, index, columns)
        one = plan.chunks[index]
        count = (one.last - one.first) * plan.episodes
        written.append((time.perf_counter(), time.process_time(), count))

    with tempfile.TemporaryDirectory() as folder:
        begun, used = time.perf_counter(), time.process_time()
        chunks.keep_chunk = kept
        try:
            done = run_plan(plan, Path(folder) / "sweep", chunk=chunk, **how)
        finally:
            chunks.keep_chunk = keep
        took, processor = time.perf_counter() - begun, time.process_time() - used
        again = time.perf_counter()
        run_plan(plan, Path(folder) / "sweep", resume=True)
        resumed = time.perf_counter() - again
        size = sum(one.stat().st_size for one in (Path(folder) / "sweep/data").iterdir())
    first, last, rest = written[0], written[-1], sum(count for *_, count in written[1:])
    steady = rest / (last[0] - first[0])
    return {
        "chunk": chunk,
        **how,
        "chunks": done.chunks,
        "episodes": done.episodes,
        "seconds": took,
        "processor_seconds": processor,
        "first_result_seconds": first[0] - begun,
        "first_result_processor_seconds": first[1] - used,
        "episodes_a_second": steady,
        "steps_a_second": steady * STEPS,
        "episodes_a_core_second": None if "workers" in how else rest / (last[1] - first[1]),
        "disk_bytes_an_episode": size / done.episodes,
        "resume_seconds": resumed,
    }


def measure(part: str, quick: bool) -> list[dict[str, Any]]:
    """The rows of a part."""
    rows = []
    if part == "tiles":
        for size in TILES[1:3] if quick else TILES:
            rows.append(tile_row(size, repeats=3 if size < LONG else 1))
            print(
                f"tile {size}: {rows[-1]['episodes_a_core_second']:,.0f} episodes/core-s",
                flush=True,
            )
        return rows
    points = 64 if quick else 512
    points *= 1 if part == "chunks" else 8  # each device, each worker compiles for a while first
    if part == "devices":
        return [_printed(on_devices(points, 1024, count)) for count in COUNTS]
    if part == "chunks":
        cuts: list[tuple[int, dict[str, Any], bool]] = [(1024, {"cores": n}, False) for n in (1, 2)]
        cuts += [(4096, {"cores": 2}, False), (1024, {"cores": 2}, True)]
    else:
        cuts = [(1024, {"workers": n}, False) for n in COUNTS]
    for chunk, how, summaries in cuts:
        row = sweep_row(plan_of(points, summaries=summaries), chunk, **how)
        rows.append(_printed({"rows": "summaries" if summaries else "episodes"} | row))
    return rows


def on_devices(points: int, chunk: int, count: int) -> dict[str, Any]:
    """`sweep_row` in a process where XLA counts the processor as `count` devices."""
    flags = f"{os.environ.get('XLA_FLAGS', '')} --xla_force_host_platform_device_count={count}"
    script = (
        "import json; from benchmarks.scaling import plan_of, sweep_row; "
        f"print(json.dumps(sweep_row(plan_of({points}), {chunk}, cores={count})))"
    )
    told = subprocess.run(
        [sys.executable, "-c", script],
        env=os.environ | {"XLA_FLAGS": flags, "JAX_PLATFORMS": "cpu"},
        stdout=subprocess.PIPE,
        check=True,
        text=True,
    )
    row = json.loads(told.stdout.splitlines()[-1])
    return {"rows": "episodes"} | row | {"devices": count}


def _printed(row: dict[str, Any]) -> dict[str, Any]:
    print(
        f"chunk {row['chunk']}, {_on(row)}: {row['episodes_a_second']:,.0f} episodes/s", flush=True
    )
    return row


def _on(row: dict[str, Any]) -> str:
    """What played a sweep, in words."""
    kind = next(one for one in ("worker", "device", "core") if f"{one}s" in row)
    count = row[f"{kind}s"]
    return f"{count} {kind}{'s' if count > 1 else ''}"


def tables(content: dict[str, Any]) -> str:
    """All that was measured, and what follows for ten million episodes."""
    blocks = []
    if "tiles" in content:
        rows = [
            {
                "episodes in a tile": one["tile"],
                "episodes/core-s": f"{one['episodes_a_core_second']:,.0f}",
                "steps/core-s": f"{one['steps_a_core_second']:,.0f}",
                "us a step": f"{1e6 / one['steps_a_core_second']:.2f}",
                "kB an episode": f"{one['bytes_an_episode'] / 1e3:.1f}",
                "first call, processor s": f"{one['first_processor_seconds']:.0f}",
            }
            for one in content["tiles"]
        ]
        blocks.append(markdown(rows))
    sweeps = [one for part in PARTS[1:] for one in content.get(part, [])]
    if sweeps:
        blocks.append(markdown([_sweep_cells(one) for one in sweeps]))
    if "tiles" in content and "chunks" in content:
        blocks.append(_many(content))
    if sweeps or "tiles" in content:
        blocks.append(f"Measured on {where(content)}.")
    return "\n\n".join(blocks)


def _sweep_cells(one: dict[str, Any]) -> dict[str, str]:
    workers = "workers" in one
    return {
        "chunk": f"{one['chunk']}",
        "rows": one["rows"],
        "on": _on(one),
        "episodes/core-s": "" if workers else f"{one['episodes_a_core_second']:,.0f}",
        "first result, core-s": "" if workers else f"{one['first_result_processor_seconds']:.0f}",
        "of the clock, episodes/s": f"{one['episodes_a_second']:,.0f}",
        "bytes an episode": f"{one['disk_bytes_an_episode']:.1f}",
        "resume, s": f"{one['resume_seconds']:.2f}",
    }


def _many(content: dict[str, Any]) -> str:
    """What ten million episodes of 10 s take."""
    tile = max(one["episodes_a_core_second"] for one in content["tiles"])
    rows = [one for one in content["chunks"] if one["rows"] == "episodes"]
    best = max(one["episodes_a_core_second"] for one in rows)
    size = max(one["disk_bytes_an_episode"] for one in rows)
    inside, whole = MANY / tile / 3600, MANY / best / 3600
    return (
        f"Ten million episodes of 10 s, {MANY * STEPS:.0e} steps, extrapolated: {inside:.2f} "
        f"core-hours in the program by the best tile, {whole:.2f} core-hours with all else by the "
        f"best sweep above, and {MANY * size / 1e9:.2f} GB on the disk."
    )


def draw(content: dict[str, Any], path: Path) -> None:
    """By tile: rate, memory and the first call; of whole sweeps: rate, disk and first result."""
    plt = pyplot()
    figure, axes = plt.subplots(2, 3, figsize=(11, 5.5), layout="constrained")
    tiles = content["tiles"]
    sizes = [one["tile"] for one in tiles]
    for axis, name, scale, words in (
        (axes[0, 0], "steps_a_core_second", 1e6, "million steps a core-second"),
        (axes[0, 1], "bytes_an_episode", 1e3, "kB an episode"),
        (axes[0, 2], "first_processor_seconds", 1, "first call [processor s]"),
    ):
        axis.plot(sizes, [one[name] / scale for one in tiles], "o-", color=BLUE, ms=4)
        axis.set(xscale="log", xlabel="episodes in a tile", ylabel=words)
        axis.set_ylim(bottom=0)
        axis.grid(alpha=0.3)
    sweeps = [one for part in PARTS[1:] for one in content.get(part, [])]
    names = [f"{_on(one)}, {one['chunk']}, {one['rows']}" for one in sweeps]
    for axis, name, scale, words in (
        (axes[1, 0], "episodes_a_second", 1e3, "thousand episodes a second"),
        (axes[1, 1], "disk_bytes_an_episode", 1, "bytes on the disk an episode"),
        (axes[1, 2], "first_result_seconds", 1, "first result after [s]"),
    ):
        axis.barh(range(len(sweeps)), [one[name] / scale for one in sweeps], color=BLUE)
        axis.set_yticks(range(len(sweeps)), names if axis is axes[1, 0] else [], fontsize=7)
        axis.set_xlabel(words)
        axis.invert_yaxis()
        axis.grid(axis="x", alpha=0.3)
    figure.savefig(path, dpi=90)


def main() -> None:
    """Measure, print and write."""
    parser = options("scaling", __doc__)
    parser.add_argument("--only", nargs="*", choices=PARTS, default=PARTS, help="or none of them")
    parser.add_argument("--quick", action="store_true", help="smaller, to see that it works")
    parser.add_argument("--docs", type=Path, help="put the tables into this page")
    given = parser.parse_args()
    content = kept_parts(given.out, PARTS)
    now = provenance()
    for part in given.only:
        content[part] = measure(part, given.quick)
        content["parts"][part] = {"commit": now["commit"], "measured": now["measured"]}
        if not given.quick:
            write_json(content, given.out)
    print(tables(content))
    if given.docs is not None:
        put_between(given.docs, f"\n{tables(content)}\n", MARKS)
        draw(content, given.docs.with_name("sweeps_scaling.png"))


if __name__ == "__main__":
    main()
