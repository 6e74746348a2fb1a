"""`stickslip reproduce`: compute figures, write their pictures, data and tables of claims."""

import json
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import jax

from stickslip.agents.policy.task import same_numbers
from stickslip.dynamics.biped import BipedParams
from stickslip.dynamics.checks import require_integer
from stickslip.dynamics.lazily import require
from stickslip.dynamics.ugv import UGVParams
from stickslip.envs.rendering.sheet import png
from stickslip.optim.progress import say_stage
from stickslip.paper.figure import Figure, figures_of
from stickslip.records.files import require_folder, require_makeable, require_new, write_whole
from stickslip.records.table import Column, Content, Table

TEXTS = json.loads(Path(__file__).with_name("claims.json").read_text(encoding="utf-8"))
"""Statements and reasons by figure and claim."""
HEAD = ("figure", "the chapter states", "measured here", "why")


def reproduce_command(given: Mapping[str, Any]) -> Content:
    """Write DIR/NAME.png, DIR/NAME.csv and, of what the chapter states or shows in numbers,
    DIR/NAME.md, computed in float64; return the claims.

    All are written at the end: an interrupted command leaves nothing.
    """
    figures, out, overwrite = figures_of(given["figures"]), Path(given["out"]), given["overwrite"]
    accepted = "24 to 2400 points a step"
    require_folder(out)
    require_integer("samples", given["samples"], low=24, high=2400, accepted=accepted)
    require_new(files(out, figures), overwrite)
    require("matplotlib.figure")
    require_makeable(out)
    rows: list[list[str]] = []
    made: dict[str, str | bytes] = {}
    with jax.enable_x64(True):
        machines = machines_of(given, figures)
        for number, (name, figure) in enumerate(figures.items(), 1):
            params, reference = machines[figure.machine]
            title = figure.title if reference else figure.own or figure.title
            say_stage(f"[{number}/{len(figures)}] {name}: {title}")
            result = figure.compute(params, given["samples"])
            made[f"{name}.png"] = png(result.draw(), title)
            made[f"{name}.csv"] = result.table().csv(digits=10)
            own = len(rows)
            for claim, measured in result.measured.items():
                text = TEXTS[name][claim] if reference else {"stated": "", "why": ""}
                rows.append([name, text["stated"], measured, text["why"]])
            if rows[own:]:
                made[f"{name}.md"] = claims(rows[own:]).markdown()
    for name, content in made.items():
        write_whole(out / name, content, overwrite=overwrite)
    for row in rows:
        print(": ".join(filter(None, row[:3])))
    return Content({"claims": claims(rows)}, {"files": list(map(str, files(out, figures)))})


def claims(rows: Sequence[Sequence[str]]) -> Table:
    """The columns of HEAD in which any row has something."""
    kept = [i for i in range(len(HEAD)) if not rows or any(row[i] for row in rows)]
    heads = [Column(HEAD[i], words=True) for i in kept]
    return Table(heads, [[row[i] for i in kept] for row in rows])


def machines_of(given: Mapping[str, Any], figures: Mapping[str, Figure]) -> dict[str, Any]:
    """Robot and vehicle of the flags by machine, and whether each is the chapter's."""
    kinds = {"biped": (BipedParams, "robot"), "ugv": (UGVParams, "vehicle")}
    changes, found = given["changes"], {}
    for machine, (kind, flag) in kinds.items():
        mine = [one for one in changes if one.startswith("vehicle.") == (machine == "ugv")]
        own = {name: changes[name] for name in mine}
        asked = any(figure.machine == machine for figure in figures.values())
        if (given[flag] or own) and not asked:
            raise ValueError(f"a {flag} with {', '.join(figures)}; accepted: the {machine}'s")
        params = kind.from_file(given[flag], own)
        found[machine] = params, same_numbers(params, kind.from_file(None))
    return found


def files(out: Path, names: Iterable[str]) -> list[Path]:
    """Existing files of these figures."""
    found = [out / f"{name}{ending}" for name in names for ending in (".png", ".csv", ".md")]
    return [path for path in found if path.exists()]
