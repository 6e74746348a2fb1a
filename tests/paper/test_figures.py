"""The figures' data, read again from the files that the command writes."""

import csv
import re
from pathlib import Path

import numpy as np
import pytest

from stickslip.cli import OK, main
from stickslip.dynamics.biped import BipedParams
from stickslip.paper import bump
from stickslip.paper.figure import FIGURES
from stickslip.paper.slip import walk

pytestmark = pytest.mark.long

pytest.importorskip("matplotlib")

SAMPLES = 48
VEHICLES = ("fig24", "fig25")


@pytest.fixture(scope="module")
def out(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The biped's figures on a coarse grid."""
    folder = tmp_path_factory.mktemp("figures")
    names = [name for name in FIGURES if name not in VEHICLES]
    assert main(["reproduce", *names, "--out", str(folder), f"--samples={SAMPLES}"]) == OK
    return folder


@pytest.fixture(scope="module")
def ugv(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The UGV's figures on coarse grids."""
    folder = tmp_path_factory.mktemp("ugv")
    with pytest.MonkeyPatch.context() as patch:
        for name, few in (("WAYPOINTS", 27), ("FINE", 9), ("COARSE", 5), ("HELD_ANGLES", 9)):
            patch.setattr(bump, name, few)
        command = ["reproduce", *VEHICLES, "--out", str(folder), f"--samples={2 * SAMPLES}"]
        assert main(command) == OK
    return folder


class Table:
    """A CSV file: columns by the beginning of their names."""

    def __init__(self, path: Path):
        with path.open(newline="", encoding="utf-8") as file:
            rows = list(csv.reader(file))
        self.names, self._rows = rows[0], rows[1:]

    def words(self, start: str) -> list[str]:
        (place,) = [i for i, name in enumerate(self.names) if name.startswith(start)]
        return [row[place] for row in self._rows]

    def numbers(self, start: str) -> np.ndarray:
        return np.array([float(cell) if cell else np.nan for cell in self.words(start)])


def test_every_figure_has_a_picture_data_and_a_measurement_for_each_claim(out: Path, ugv: Path):
    for name in FIGURES:
        folder = ugv if name in VEHICLES else out
        if name not in ("fig16", "fig18"):  # curves only
            lines = (folder / f"{name}.md").read_text(encoding="utf-8").splitlines()[2:]
            rows = [[cell.strip() for cell in line.strip("|").split("|")] for line in lines]
            assert all(len(row) == 4 and all(row) and row[0] == name for row in rows)
        assert (folder / f"{name}.csv").is_file()
        assert (folder / f"{name}.png").read_bytes()[:8] == b"\x89PNG\r\n\x1a\n"


def test_torque_at_constant_speed_is_weight_plus_the_square_of_the_speed(out: Path):
    table = Table(out / "fig11.csv")
    still, slow, fast = (table.numbers(f"motor torque, {w} rad") for w in (0, 1, 5))
    np.testing.assert_allclose(fast - still, 25 * (slow - still), atol=1e-7)
    share = table.numbers("time")
    work = np.sum((still[1:] + still[:-1]) / 2) * np.pi * (share[1] - share[0])
    assert abs(work) < 1e-3 * np.abs(still).max()  # weight does no work over a whole step


def test_a_start_walks_exactly_if_the_torque_beats_the_mean_slope_of_the_weight(out: Path):
    table = Table(out / "fig13.csv")
    walked = {}
    for name in table.names[1:]:
        torque = float(re.findall(r", ([\d.]+) N m", name)[0])
        angle = table.numbers(name)
        walked[torque] = np.nanmax(angle) > 3 * np.pi / 2
        assert angle[0] == pytest.approx(np.pi / 2)
    still = Table(out / "fig11.csv").numbers("motor torque, 0 rad")
    rise = np.cumsum((still[1:] + still[:-1]) / 2) / np.arange(1, len(still))
    clear = {torque: does for torque, does in walked.items() if abs(torque - rise.max()) > 5e-3}
    assert clear == {torque: torque > rise.max() for torque in clear}
    assert len(set(clear.values())) == 2


def test_what_holds_of_every_robot_is_what_the_figures_show(out: Path):
    heavier = Table(out / "fig14.csv")
    angles = [np.nan_to_num(heavier.numbers(name)) for name in heavier.names[1:]]
    ends = [int(np.argmax(angle >= 3 * np.pi / 2)) for angle in angles]
    walks = [end for end in ends if end > 0]
    assert walks == sorted(set(walks))
    assert ends == [*walks, *[0] * (len(ends) - len(walks))]  # too heavy does not walk
    chart = Table(out / "fig16.csv")
    assert all(np.isfinite(chart.numbers(name)).any() for name in chart.names)
    kinetic = Table(out / "fig19.csv")
    starts = {np.flatnonzero(kinetic.numbers(name))[0] for name in kinetic.names[1:]}
    assert len(starts) == 1  # before the first slide kinetic friction does not enter


def test_the_forces_on_the_foot_balance_at_every_phase(out: Path):
    table = Table(out / "fig15.csv")
    parts = ("f01, ground on foot", "tibia (2) on foot", "bar (11) on foot")
    sides = ("horizontal", "vertical")
    x, y = (sum(table.numbers(f"{side} force on the foot, {p}") for p in parts) for side in sides)
    np.testing.assert_allclose(x, 0, atol=1e-6)
    np.testing.assert_allclose(y, 0.30 * 9.81, atol=1e-6)
    moment = table.numbers("zero-moment") * table.numbers("vertical force on the foot, f01")
    offset = 2 * 0.030
    np.testing.assert_allclose(
        moment + offset * table.numbers("vertical force on the foot, bar"), 0, atol=1e-6
    )


@pytest.mark.usefixtures("float64")
def test_the_slides_add_up_to_where_the_foot_ends():
    robot = BipedParams.from_bars()
    for rate, static, kinetic in ((3.0, 0.05, None), (5.5, 0.1, None), (5.0, 0.2, 0.05)):
        one = walk(robot, rate, static, kinetic, samples=SAMPLES)
        moved = sum(slide.displacement for slide in one.slides)
        assert moved == pytest.approx(one.displacement, abs=1e-9)
        assert all(slide.end > slide.start for slide in one.slides)


def test_the_foot_slips_exactly_below_the_greatest_need_of_friction(out: Path):
    table = Table(out / "fig15.csv")  # no slip, 3 rad/s, as Fig. 17
    sides = ("horizontal", "vertical")
    friction, load = (table.numbers(f"{side} force on the foot, f01") for side in sides)
    need = np.abs(friction / load)
    places = Table(out / "fig17.csv")
    slips = {
        float(re.findall(r"μ = ([\d.]+)", name)[0]): np.ptp(places.numbers(name)) > 0
        for name in places.names[1:]
    }
    assert slips == {mu: mu < need.max() for mu in slips}
    assert len(set(slips.values())) == 2


def test_free_legs_vary_the_torque_less_at_the_points_and_more_between_them(ugv: Path):
    table = Table(ugv / "fig25.csv")
    x, at = table.numbers("front wheel"), slice(None, None, bump.BETWEEN)
    varied, dense = {}, {}
    for name in (bump.HELD, bump.LIMITED, bump.FREE):
        torque = table.numbers(f"torque on each wheel, {name}")
        varied[name] = np.sum(np.diff(torque[at]) ** 2 / np.diff(x[at]))
        dense[name] = np.sum(np.diff(torque) ** 2 / np.diff(x))
        legs = np.stack([table.numbers(f"{leg} leg, {name}") for leg in ("rear", "front")])
        legs = legs[:, at]
        wheels = 0.83 - 0.35 * np.cos(legs).sum(0), 0.35 * np.diff(np.sin(legs), axis=0)[0]
        assert np.min(np.hypot(*wheels)) > 0.56 - 1e-6
        fastest = np.max(np.abs(np.diff(legs)) / np.diff(x[at]))
        assert name != bump.HELD or fastest == 0
        assert name != bump.LIMITED or 0.1 < fastest < bump.RATE * (1 + 1e-6)
        assert np.all(table.numbers(f"least grip margin, {name}")[at] > 0)
    assert varied[bump.FREE] < varied[bump.LIMITED] < 0.99 * varied[bump.HELD]
    assert dense[bump.LIMITED] < dense[bump.HELD]
    assert dense[bump.FREE] > varied[bump.FREE]
