"""Figs. 24 and 25, read again from the files that the command writes."""

import csv
from pathlib import Path

import numpy as np
import pytest

from stickslip.cli import OK, main
from stickslip.paper import passage

pytestmark = pytest.mark.long

pytest.importorskip("matplotlib")


@pytest.fixture(scope="module")
def out(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Both figures, coarse; the vehicle's grids and waypoints are patched to few."""
    folder = tmp_path_factory.mktemp("ugv")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(passage, "WAYPOINTS", 27)
        patch.setattr(passage, "FINE", 9)
        patch.setattr(passage, "COARSE", 5)
        patch.setattr(passage, "HELD_ANGLES", 9)
        command = ["reproduce", "fig24", "fig25", "--out", str(folder), "--samples=96"]
        assert main(command) == OK
    return folder


def columns(path: Path) -> dict[str, np.ndarray]:
    """A CSV file's columns by their names without units."""
    with path.open(newline="", encoding="utf-8") as file:
        rows = list(csv.reader(file))
    names = [name.partition(" [")[0] for name in rows[0]]
    return {
        name: np.array(of, dtype=float)
        for name, of in zip(names, zip(*rows[1:], strict=True), strict=True)
    }


def test_the_mirrored_posture_needs_the_mirrored_torque(out: Path):
    table = columns(out / "fig24.csv")
    for here, mirrored in (("30/100°", "100/30°"), ("90/90°", "90/90°")):
        up, down = (table[f"torque with legs at {name}"] for name in (here, mirrored))
        assert -up.min() == pytest.approx(down.max(), rel=2e-3)
        assert up.max() == pytest.approx(-down.min(), rel=2e-3)


def test_every_pair_of_angles_is_tabulated_and_mirrors_the_other_way_round(out: Path):
    with (out / "fig24-pairs.csv").open(newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    largest = {
        (int(row["rear leg [deg]"]), int(row["front leg [deg]"])): float(
            row["largest torque [N m]"]
        )
        for row in rows
    }
    every = {(rear, front) for rear in range(30, 151, 10) for front in range(30, 151, 10)}
    legs = {pair: 0.35 * np.exp(1j * np.radians(pair)) for pair in every}
    apart = {pair: abs(0.83 - front.conjugate() - rear) for pair, (rear, front) in legs.items()}
    clear = {pair for pair, distance in apart.items() if distance >= 0.56}
    assert set(largest) == clear  # wheels of 0.28 m would overlap in the others
    assert {(30, 100), (150, 70)} < clear < every
    for (rear, front), peak in largest.items():
        assert peak == pytest.approx(largest[front, rear], rel=0.01)
    worst = max(largest, key=largest.__getitem__)
    assert worst[0] != worst[1]
    table = columns(out / "fig24.csv")
    for name in ("30/100°", "100/30°"):
        drawn = np.abs(table[f"torque with legs at {name}"]).max()
        assert drawn >= 0.999 * largest[worst]


def test_astride_the_crest_a_symmetric_posture_needs_no_torque(out: Path):
    table = columns(out / "fig24.csv")
    x, torque = table["front wheel"], table["torque with legs at 90/90°"]
    middle = (x > 3.6) & (x < 5.0)
    crossing = np.interp(0, torque[middle], x[middle])
    assert crossing == pytest.approx(4 + 0.83 / 2, abs=0.03)  # the wheelbase is 0.83 m
    assert np.all(np.diff(torque[middle]) > 0)


def test_angles_free_to_vary_vary_the_torque_less(out: Path):
    table = columns(out / "fig25.csv")
    x = table["front wheel"]
    varied = {}
    for name in (passage.HELD, passage.LIMITED, passage.FREE, passage.POINTWISE):
        varied[name] = np.sum(np.diff(table[f"{name}: torque"]) ** 2 / np.diff(x))
        legs = np.stack([table[f"{name}: {leg} leg"] for leg in ("rear", "front")])
        wheels = 0.83 - 0.35 * np.cos(legs).sum(0), 0.35 * np.diff(np.sin(legs), axis=0)[0]
        assert np.min(np.hypot(*wheels)) > 0.56 - 1e-6
        fastest = np.max(np.abs(np.diff(legs)) / np.diff(x))
        if name == passage.HELD:
            assert fastest == 0
        if name == passage.LIMITED:
            assert 0.1 < fastest < passage.RATE * (1 + 1e-6)
        assert np.all(table[f"{name}: least grip margin"] > 0)
    assert varied[passage.FREE] < varied[passage.LIMITED] < 0.99 * varied[passage.HELD]
    assert varied[passage.FREE] < varied[passage.POINTWISE]


def test_every_claim_has_both_energies_and_a_verdict(out: Path):
    lines = (out / "table.md").read_text(encoding="utf-8").splitlines()[2:]
    cells = [[cell.strip() for cell in line.strip("|").split("|")] for line in lines]
    assert {row[0] for row in cells} == {"fig24", "fig25"}
    assert all(len(row) == 5 and all(row) for row in cells)
    (cost,) = [row[2] for row in cells if row[1] == "(what it costs)"]
    assert "wheels' motors" in cost
    assert "legs' actuators" in cost
    for name in ("fig24", "fig25"):
        assert (out / f"{name}.png").read_bytes()[:8] == b"\x89PNG\r\n\x1a\n"


def test_between_its_points_a_drive_varies_the_torque_more(out: Path):
    at, between = columns(out / "fig25.csv"), columns(out / "fig25-between.csv")
    x, closer = at["front wheel"], between["front wheel"]
    np.testing.assert_allclose(closer[:: passage.BETWEEN], x, atol=1e-9)
    varied = {}
    for name in (passage.HELD, passage.LIMITED, passage.FREE):
        torque = between[f"{name}: torque"]
        np.testing.assert_allclose(torque[:: passage.BETWEEN], at[f"{name}: torque"], atol=1e-6)
        varied[name] = np.sum(np.diff(torque) ** 2 / np.diff(closer))
        assert varied[name] > np.sum(np.diff(at[f"{name}: torque"]) ** 2 / np.diff(x))
    assert varied[passage.LIMITED] < varied[passage.HELD]
