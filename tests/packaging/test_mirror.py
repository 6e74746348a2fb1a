"""tests/ mirrors the package: what tests one room only lies in the folder of the room's name."""

import ast
import os
from functools import cache
from pathlib import Path, PurePosixPath

import pytest

from tests.packaging.test_layers import imports
from tests.packaging.test_package_list import package_folders

ROOT = Path(__file__).parents[2]
TESTS = ROOT / "tests"

APART = {
    "benchmarks": "of what is beside the package",
    "documentation": "likewise",
    "fuzz": "random input to everything, run apart",
    "packaging": "of the repository as a whole",
    "typing": "of all signatures",
}
"""Folders of tests that mirror none of the package, and why."""

ROOMS = {
    PurePosixPath(*name.split(".")[1:]): ROOT / folder for name, folder in package_folders().items()
}
"""Folders of the package as imports name them ("." is the package), and where they lie."""

TOP = PurePosixPath()


def folder_of(path: Path) -> PurePosixPath:
    return PurePosixPath(path.parent.relative_to(TESTS))


def mirroring(pattern: str) -> list[Path]:
    """Files of tests/ that match, but those of the folders apart."""
    found = sorted(TESTS.rglob(pattern))
    return [path for path in found if not {*folder_of(path).parts[:1]} & {*APART}]


def room_of(names: list[str]) -> PurePosixPath:
    """The deepest room that a dotted name leads into."""
    ways = (PurePosixPath(*names[:end]) for end in range(len(names), -1, -1))
    return next(way for way in ways if way in ROOMS)


@cache
def public(room: PurePosixPath) -> dict[str, str]:
    """What a room's `__init__` imports: dotted names by the last of their parts."""
    init = ast.parse((ROOMS[room] / "__init__.py").read_text(encoding="utf-8"))
    return {dotted.rpartition(".")[2]: dotted for dotted, _, _ in imports(init)}


def used_room(dotted: str) -> PurePosixPath:
    """The room of an imported name; a public one is of the room that it is written in."""
    package, *names = dotted.split(".")
    room = room_of(names)
    origin = public(room).get(names[-1]) if package == "stickslip" and names else None
    if origin and len(names) == len(room.parts) + 1:
        return room_of(origin.split(".")[1:])
    return room


def home(source: str, layer: PurePosixPath) -> PurePosixPath:
    """The deepest folder of a layer that holds every room of it which a test uses.

    A room may use what lies above it, so that does not count; helpers of the layer's tests do.
    """
    used = set()
    for dotted, _, _ in imports(ast.parse(source)):
        if dotted.partition(".")[0] in ("stickslip", "tests"):
            room = used_room(dotted)
            if room == layer and dotted.startswith("tests."):
                return layer
            if room.is_relative_to(layer) and room != layer:
                used.add(room)
    deepest = [room for room in used if not any(room in other.parents for other in used)]
    return PurePosixPath(os.path.commonpath(deepest)) if deepest else layer


def test_every_folder_of_tests_is_named_after_one_of_the_package():
    folders = {folder_of(path) for path in mirroring("*.py")}
    assert len(folders) > 20
    assert sorted(map(str, folders - set(ROOMS))) == []


def test_every_folder_apart_is_there_and_is_no_room():
    assert [name for name in APART if not list((TESTS / name).glob("*.py"))] == []
    assert {PurePosixPath(name) for name in APART} & set(ROOMS) == set()


def test_no_test_beside_a_room_is_named_after_it():
    wrong = []
    for path in mirroring("test_*.py"):
        inner = {room.name for room in ROOMS if room != TOP and room.parent == folder_of(path)}
        named = path.stem.removeprefix("test_")
        inside = [room for room in inner if f"{named}_".startswith(f"{room}_")]
        wrong += [f"{path.relative_to(ROOT)} belongs in {room}/" for room in inside]
    assert wrong == []


def test_what_uses_one_room_only_lies_there():
    wrong = []
    for path in mirroring("test_*.py"):
        own = folder_of(path)
        right = home(path.read_text(encoding="utf-8"), PurePosixPath(*own.parts[:1]))
        if not own.is_relative_to(right):
            wrong.append(f"{path.relative_to(ROOT)} uses {right} only")
    assert wrong == []


@pytest.mark.parametrize(
    ("layer", "source", "right"),
    [
        ("envs", "from stickslip.envs.biped.reward import reward", "envs/biped"),
        ("envs", "from stickslip.envs import BipedEnv, GymEnv", "envs"),
        ("envs", "from stickslip.envs import GymEnv\nimport jax", "envs/adapters"),
        ("envs", "def f():\n    from stickslip.envs import UGVEnv", "envs/ugv"),
        ("envs", "from stickslip.envs import BipedEnv\nfrom tests.envs.toy import Toy", "envs"),
        ("envs", "from stickslip.envs.rendering import UGVRenderer, theme", "envs/rendering/ugv"),
        ("envs", "from stickslip.envs.rendering import UGVRenderer, Window", "envs/rendering"),
        ("dynamics", "from stickslip.dynamics.checks import shown", "dynamics"),
        ("dynamics", "from stickslip.dynamics import Scene, biped", "dynamics/biped"),
        ("optim", "from tests.optim.posture.helpers import tiny", "optim/posture"),
        ("optim", "from stickslip.dynamics.ugv import Track", "optim"),
        ("", "from stickslip.paper import chart\nfrom stickslip.cli import main", "paper"),
        ("", "from stickslip.paper import chart\nfrom stickslip.optim import solve", ""),
    ],
)
def test_the_rule_tells_where_a_test_belongs(layer: str, source: str, right: str):
    assert home(source, PurePosixPath(layer)) == PurePosixPath(right)
