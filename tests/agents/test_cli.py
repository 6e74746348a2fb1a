"""The command line: what it prints, what it writes, how it refuses."""

import signal
import sys
from importlib import import_module
from pathlib import Path

import numpy as np
import pytest

from stickslip.agents import describe_environment, save_policy
from stickslip.agents.biped.machine import TrainConfig
from stickslip.agents.training.run import trainer_of
from stickslip.cli import main
from stickslip.envs import BipedEnv
from tests.agents.networks import make_policy
from tests.asked import refusal

pytestmark = pytest.mark.usefixtures("empty_directory")


@pytest.fixture
def still(tmp_path: Path) -> str:
    """A policy file."""
    env = BipedEnv()
    about = describe_environment(env, env.default_params)
    return str(save_policy(make_policy((6, 1)), tmp_path / "still.npz", about))


def test_what_is_no_policy_is_refused_by_name(capsys, tmp_path: Path, still: str):
    whole = Path(still).read_bytes()
    Path("cut.npz").write_bytes(whole[: len(whole) // 2])
    np.savez("foreign.npz", a=np.zeros(3))
    Path("empty").mkdir()
    for name in ("cut.npz", "foreign.npz", "empty"):
        assert name in refusal(capsys, "evaluate", name)
        assert name in refusal(capsys, "view", name)
    assert "4 entries" not in refusal(capsys, "view", "cut.npz")


def test_files_are_not_overwritten_unasked(capsys, still: str):
    Path("results").mkdir()
    Path("results/evaluation.csv").write_text("mine")
    assert "evaluation.csv exists" in refusal(capsys, "evaluate", still, "--out", "results")
    Path("walk.gif").write_text("mine")
    assert "walk.gif exists" in refusal(capsys, "view", still, "--out", "walk.gif")
    assert Path("walk.gif").read_text() == Path("results/evaluation.csv").read_text() == "mine"


@pytest.mark.parametrize(
    ("package", "extra", "asked"),
    [
        ("tqdm", "train", "train biped --out run"),
        ("stable_baselines3", "sb3", "train biped --out run --trainer=sb3"),
        ("cma", "optim", "optimise ugv --out run --method=cma --seed=1 --set spacing=1 angles=4"),
    ],
)
def test_a_missing_package_is_named_with_its_extra(capsys, monkeypatch, package, extra, asked):
    for name in [name for name in sys.modules if name.startswith("stickslip.agents.training.sb3")]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, package, None)
    said = refusal(capsys, *asked.split())
    assert f'pip install "stickslip[{extra}]"' in said
    assert not Path("run").exists()


def test_what_needs_stable_baselines3_says_so_in_python(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.delitem(sys.modules, "stickslip.envs.adapters.sb3", raising=False)
    for name in [name for name in sys.modules if name.startswith("stable_baselines3")]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, "stable_baselines3", None)
    said = r'needs stable_baselines3, .*pip install "stickslip\[sb3\]"'
    with pytest.raises(ModuleNotFoundError, match=said):
        import_module("stickslip.envs.adapters.sb3")
    with pytest.raises(ModuleNotFoundError, match=said):
        trainer_of(TrainConfig.of(trainer="sb3"))


def test_no_message_is_longer_than_a_few_lines(capsys):
    for word in ("9" * 6000, "x" * 6000, "-" * 6000):
        for arguments in (["train", "biped", "--seed", word], ["evaluate", word], [word]):
            assert len(refusal(capsys, *arguments)) < 1300


def test_a_lack_of_memory_is_said(capsys, monkeypatch: pytest.MonkeyPatch):
    for failure in (MemoryError(), RuntimeError("RESOURCE_EXHAUSTED: Out of memory")):

        def fail(given, failure=failure):
            raise failure

        monkeypatch.setattr("stickslip.agents.pictures.view.view_command", fail)
        assert "not enough memory" in refusal(capsys, "view", "computed-torque")


def test_a_place_that_cannot_be_written_is_said_before_anything_is_computed(capsys, still: str):
    Path("file").write_text("mine")
    assert "file" in refusal(capsys, "evaluate", still, "--out", "file/table")
    assert Path("file").read_text() == "mine"


def test_a_message_names_the_file_that_was_asked_for(capsys, still: str, monkeypatch):
    def refused(dir):
        raise PermissionError(13, "Permission denied", f"{dir}/tmpab12cd34")

    monkeypatch.setattr("stickslip.records.files.tempfile.TemporaryFile", refused)
    line = refusal(capsys, "view", still, "--out", "there/walk.html")
    assert "cannot be written (Permission denied): 'there/walk.html'" in line
    assert "tmp" not in line


@pytest.mark.parametrize(("name", "status"), [("SIGINT", 130), ("SIGTERM", 143)])
def test_a_signal_ends_with_its_own_status(
    capsys, monkeypatch: pytest.MonkeyPatch, name: str, status: int
):
    number = getattr(signal, name)
    before = signal.signal(number, signal.SIG_DFL)  # whoever runs the tests may have it ignored
    ended = lambda given: signal.raise_signal(number)  # noqa: E731
    monkeypatch.setattr("stickslip.agents.pictures.view.view_command", ended)
    assert main(["view", "computed-torque"]) == status
    assert f"interrupted by {name}; the same command begins anew" in capsys.readouterr().err
    assert signal.signal(number, before) == signal.SIG_DFL
