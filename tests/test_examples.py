"""Every program in README and docs runs as printed and prints what is shown; commands are taken.

Blocks marked `py` need what is not installed: they are parsed, and tests of their own run them.
test_shell_examples.py runs the commands.
"""

import ast
import re
import shlex
import tomllib
from collections.abc import Callable
from importlib.util import find_spec

import jax
import numpy as np
import pytest

from stickslip.cli import make_parser
from stickslip.dynamics.biped import BipedParams
from tests.documents import LANGUAGES, ROOT, Block, every_block, programs
from tests.extras import SB3

NUMBER = re.compile(r"(?<![\w.])[-+−]?\d+(?:\.\d*)?(?:e[-+]?\d+)?(?![\w])")
NEAR = {"rtol": 0.02, "atol": 0.002}
"""Single precision, summed in another order on another machine."""
LEARNS = "model.learn("
"""What is learnt differs from machine to machine; a policy that stands has no slip a metre."""
FEWER = {
    "total_timesteps=500_000": "total_timesteps=2_048",
    " timesteps=1_000_000": " timesteps=8_192",
    "range(60)": "range(2)",
    '["crank-speed-pi", "runs/mine"]': '["crank-speed-pi"]',
    '"0.02:0.3:64", "payload": [0, 5, 15]': '"0.02:0.3:2", "payload": [0, 5]',
    "episodes=256": "episodes=2",
}
"""What a test makes less of; each stands in one program."""
LONG = {
    LEARNS: "training",
    "PPOTrainer(": "training",
    "recommend(": "every setting it tells of is a program",
    "evaluate_task(": "whole episodes of a task",
    "identify(": "many filters over a log",
    "best_transfer(": "programs of several walks",
    "bound_every_drive(": "interval arithmetic over all drives",
    "done = sweep(": "a sweep",
    "read_sweep(": "a sweep first",
    "env.default_params, policy, num_envs=4096": "docs/use.md collects, too",
    "def slid(mu_ice)": "patches under vmap, a program of its own",
    "jax.vmap(env.step, (0, 0, 0, None))": "patches under vmap, a program of its own",
    "legs_only": "docs/use.md solves a posture problem, too",
    "def improved": "docs/use.md collects, too",
    'keep=("obs", "action")': "docs/use.md collects, too",
    "walk.events():": "docs/use.md records events, too",
    "JOINT_FORCES": "the full system's equations, and a walk",
    "as_scipy": "a drive's slopes, in float64",
    "gait-time-d16": "a gait's program",
    "view = show(": "two episodes, drawn; tests of reports play them",
}
"""Words of the programs that only `make test-long` runs, and why."""
BEFORE = {
    "read_sweep(": """
from stickslip.agents import sweep
from stickslip.envs import BipedEnv
task, axes = (BipedEnv(), BipedEnv().make_params()), {"mu": [0.06, 0.2], "mean_rate": [3.0]}
sweep(task, ["crank-speed-pi", "computed-torque"], axes, 2, "runs/floors")
"""
}
"""What the page's commands would have made before."""
PROGRAMS = programs()


def code_of(chain: list[Block]) -> str:
    """A program as it is run."""
    code = "".join(block.code for block in chain)
    for much, little in FEWER.items():
        code = code.replace(much, little)
    return "".join(more for word, more in BEFORE.items() if word in code) + code


def program(chain: list[Block]):
    """Named by page and line; a long one where it says so."""
    code = "".join(block.code for block in chain)
    marks = [pytest.mark.long] if any(words in code for words in LONG) else []
    marks += [SB3] if "stable_baselines3" in code else []
    return pytest.param(chain, id=f"{chain[0].page}:{chain[0].line}", marks=marks)


@pytest.mark.parametrize("chain", [program(chain) for chain in PROGRAMS])
def test_the_program_runs_and_prints_what_is_shown(chain, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    precision = jax.config.read("jax_enable_x64")
    exec(compile(code_of(chain), chain[0].page, "exec"), {"__name__": "example"})
    assert jax.config.read("jax_enable_x64") == precision
    printed = capsys.readouterr().out
    shown = [block.shown for block in chain if block.shown is not None]
    if shown and any(LEARNS in block.code for block in chain):
        assert heads(printed) == heads("".join(shown))
    elif shown:
        assert words_of(printed) == words_of("".join(shown))
        np.testing.assert_allclose(numbers(printed), numbers("".join(shown)), **NEAR)


def heads(text: str) -> list[list[str]]:
    """What the lines begin with."""
    return [line.split()[:1] for line in text.splitlines()]


def words_of(text: str) -> list[str]:
    """A text without its numbers, spaces and rules."""
    return re.sub(r"[─\s]+", " ", NUMBER.sub("0", text)).split()


def numbers(text: str) -> list[float]:
    return [float(one.replace("−", "-")) for one in NUMBER.findall(text)]


def test_every_block_is_of_a_kind_that_is_looked_at():
    unknown = {one.language for one in every_block()} - LANGUAGES
    assert unknown == set()


@pytest.mark.parametrize(
    "block",
    [pytest.param(b, id=f"{b.page}:{b.line}") for b in every_block() if b.language == "toml"],
)
def test_a_robots_file_on_a_page_is_read(block: Block):
    assert BipedParams.from_file(block.code).validate()


@pytest.mark.parametrize(
    "block", [pytest.param(b, id=f"{b.page}:{b.line}") for b in every_block() if b.language == "py"]
)
def test_what_cannot_run_here_is_a_program_all_the_same(block: Block):
    ast.parse(block.code)


def commands() -> list:
    """Every line of the blocks of commands, and of lists set in by four spaces."""
    found = {}
    for block in every_block():
        if block.language in ("sh", ""):
            for line in block.code.replace("\\\n", " ").splitlines():
                found.setdefault(line.strip(), f"{block.page}: {line.strip()}")
    pages = sorted(ROOT.glob("docs/*.md"))
    for page in ("README.md", "CONTRIBUTING.md", *(f"docs/{path.name}" for path in pages)):
        text = (ROOT / page).read_text(encoding="utf-8")
        for line in re.findall(r"(?m)^ {4}((?:stickslip|python -m benchmarks)\S* .*)$", text):
            found.setdefault(line, f"{page}: {line}")
    return [pytest.param(line, id=name) for line, name in found.items() if line]


@pytest.mark.parametrize("line", commands())
def test_a_command_is_one_that_is_taken(line: str):
    first, *rest = shlex.split(re.sub(r" >>? ?\S+$", "", line), comments=True)
    assert first in TAKEN, f"accepted: {', '.join(TAKEN)}"
    TAKEN[first](rest)


def stickslip_takes(rest: list[str]) -> None:
    assert make_parser(rest).parse_args(rest).command == rest[0]


def python_takes(rest: list[str]) -> None:
    assert rest[0] == "-m"
    assert find_spec(rest[1]) is not None


def make_takes(rest: list[str]) -> None:
    targets = re.findall(r"(?m)^([a-z-]+):", (ROOT / "Makefile").read_text(encoding="utf-8"))
    assert {one for one in rest if "=" not in one} <= {*targets}


def pip_takes(rest: list[str]) -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    asked = re.findall(r"\[([\w,]+)\]", " ".join(rest))
    assert set(",".join(asked).split(",")) - {""} <= {*project["optional-dependencies"]}


TAKEN: dict[str, Callable[[list[str]], None]] = {
    "stickslip": stickslip_takes,
    "python": python_takes,
    "make": make_takes,
    "pip": pip_takes,
    "uvx": lambda rest: stickslip_takes(rest[rest.index("stickslip") + 1 :]),
}
"""First words of commands, and what their rest is held to."""
