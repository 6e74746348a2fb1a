"""tests/ mirrors the package: its folders bear the names of the package's."""

from pathlib import Path, PurePosixPath

from tests.packaging.test_package_list import package_folders

ROOT = Path(__file__).parents[2]
TESTS = ROOT / "tests"

APART = {
    "benchmarks": "of what is beside the package",
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
