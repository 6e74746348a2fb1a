"""The runs of a race in the format of IOHprofiler: iohprofiler.py OUT [RACE ...]

pip install "stickslip[optimisers,sweep]"; without a RACE it takes the runs that come with the
package. OUT holds a folder for each method, for IOHanalyzer and iohinspector: raw_y is the best
feasible value so far, inf where there is none yet. A seeded instance is an instance of its
function; runs of a method on it differ by their seeds.
"""

import json
import sys
from itertools import groupby
from pathlib import Path

import numpy as np

from stickslip.agents.optimisers.report import STORED, function_of, read_results
from stickslip.optim.instances.instance import SEEDED, instance


def main(out, *races):
    """Write the runs of the races into a new folder."""
    place = Path(out)
    place.mkdir(parents=True)  # refuses a folder that is there
    runs = sorted(read_results(*races or (STORED,)), key=function_and_method)
    numbers = {name: i for i, name in enumerate(sorted({function_of(run) for run in runs}), 1)}
    for (function, method), group in groupby(runs, key=function_and_method):
        write(place / method.replace(":", "-"), method, function, numbers[function], list(group))
    print(f"{len(runs)} runs of {len(numbers)} functions; iohinspector reads them:")
    print(f'manager = iohinspector.DataManager(); manager.add_folder("{place}")')


def seed_of(run):
    """Number of a seeded instance; 0 for one without a seed."""
    seeded = SEEDED.fullmatch(run.instance)
    return int(seeded[2]) if seeded else 0


def function_and_method(run):
    """The key that runs are grouped by."""
    return function_of(run), run.method


def write(folder, method, function, number, runs):
    """The JSON file of a method on a function, and the data file beside it."""
    name, n = f"IOHprofiler_f{number}_{function}", instance(runs[0].instance).n
    data = Path(f"data_f{number}_{function}") / f"IOHprofiler_f{number}_DIM{n}.dat"
    (folder / data.parent).mkdir(parents=True)
    lines, entries = [], []
    for run in runs:
        each = zip(run.evaluations.tolist(), run.values.tolist(), strict=True)
        rows = {1: np.nan} | dict(each)  # readers take evaluation 1 for the beginning of a run
        lines += [
            "evaluations raw_y",
            *(f"{e} {y if y == y else np.inf!r}" for e, y in rows.items()),
        ]
        evaluations, best = list(rows.items())[-1]
        point = [] if run.point is None else run.point.tolist()
        solution = {"evals": evaluations, "y": best if best == best else None, "x": point}
        entries.append({"instance": seed_of(run), "evals": evaluations, "best": solution})
    (folder / data).write_text("\n".join(lines) + "\n", encoding="utf-8")
    scenario = {"dimension": n, "path": data.as_posix(), "runs": entries}
    whole = {"version": "0.3.5", "suite": "stickslip", "function_id": number}
    whole |= {"function_name": function, "maximization": False, "attributes": ["evaluations"]}
    whole |= {"algorithm": {"name": method, "info": ""}, "scenarios": [scenario]}
    (folder / f"{name}.json").write_text(json.dumps(whole), encoding="utf-8")


if __name__ == "__main__":
    main(*sys.argv[1:])
