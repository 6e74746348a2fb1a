"""Full disks and read-only ones: one clear line, nothing half written, on it goes afterwards."""

import os
import re
import subprocess
from pathlib import Path

import pytest

from stickslip.agents import load_policy, read_sweep, save_policy
from stickslip.agents.training.directory import list_checkpoints
from stickslip.cli import OK, WRONG_INPUT, main
from tests.agents.networks import make_policy
from tests.agents.runs import assert_same_run
from tests.agents.sweeps.masses import swept

pytestmark = pytest.mark.long
SMALL = "rollout_steps=32 batch_size=64 epochs=1 hidden=8 evaluation_episodes=1"
TRAIN = ["train", "--timesteps=512", "--num-envs=4", "--no-pictures"]
TRAIN += ["--set", *SMALL.split(), "checkpoint_interval=128"]
SIZES = (4, 64)
"""Of disks too small for a training [kB]; pages of 4 kB are given out whole."""
OPTIMISE = ["optimise", "ugv", "--track", "bump", "--set", "spacing=0.5", "angles=5"]
SPACE, READ_ONLY = "No space left on device", "Read-only file system"


class Disk:
    """A mounted tmpfs."""

    def __init__(self, path: Path):
        self.path = path

    def mount(self, *options: str) -> bool:
        command = ["mount", "-t", "tmpfs", "-o", ",".join(options), "tmpfs", str(self.path)]
        try:
            return subprocess.run(command, capture_output=True, check=False).returncode == 0
        except OSError:
            return False

    def change(self, *options: str) -> None:
        command = ["mount", "-o", ",".join(("remount", *options)), str(self.path)]
        subprocess.run(command, check=True, capture_output=True)

    def fill(self) -> None:
        with (self.path / "filler").open("wb") as file:
            try:
                while True:
                    os.write(file.fileno(), bytes(512))
            except OSError:
                return


@pytest.fixture
def disk(tmp_path: Path):
    path = tmp_path / "disk"
    path.mkdir()
    made = Disk(path)
    if not made.mount("size=4k"):
        pytest.skip("no right to mount a tmpfs here")
    yield made
    subprocess.run(["umount", "-l", str(path)], check=True, capture_output=True)


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A training that had room."""
    pytest.importorskip("optax")
    path = tmp_path_factory.mktemp("whole") / "run"
    assert main([*TRAIN, "--out", str(path)]) == OK
    return path


def refused(capfd: pytest.CaptureFixture[str], words: str, *arguments: str) -> None:
    """The command fails with one line that says so, and no traceback of any thread."""
    capfd.readouterr()
    assert main(arguments) == WRONG_INPUT
    said = capfd.readouterr().err
    assert "Traceback" not in said, said
    last = said.strip().splitlines()[-1]
    assert re.match(r"stickslip: error: ", last)
    assert words in last


@pytest.mark.parametrize("size", SIZES)
def test_a_training_on_a_full_disk_goes_on_when_there_is_room(disk, whole, capfd, size: int):
    disk.change(f"size={size}k")
    path = disk.path / "run"
    refused(capfd, SPACE, *TRAIN, "--out", str(path))
    print(f"\ndisk of {size} kB: {len(list_checkpoints(path / 'checkpoints'))} checkpoints")
    if (path / "policy.npz").exists():
        load_policy(path / "policy.npz")
    disk.change("size=20m")
    begun = (path / "config.json").exists()
    how = ["--resume", "--no-pictures"] if begun else TRAIN[1:]
    assert main(["train", "--out", str(path), *how]) == OK
    assert_same_run(whole, path)
    assert not list(path.rglob("*.part"))


@pytest.mark.usefixtures("mass")
@pytest.mark.parametrize("size", [4, 16, 40])
def test_a_sweep_on_a_full_disk_goes_on_when_there_is_room(disk, tmp_path, size: int):
    swept(tmp_path / "whole")
    disk.change(f"size={size}k")
    path = disk.path / "a"
    with pytest.raises(OSError, match=SPACE):
        swept(path)
    assert not list(path.rglob("*.part"))
    disk.change("size=20m")
    begun = (path / "sweep.json").exists()
    disk.change("ro")
    with pytest.raises(OSError, match=READ_ONLY):
        swept(path, resume=begun)
    disk.change("rw")
    swept(path, resume=begun)
    assert read_sweep(path).equals(read_sweep(tmp_path / "whole"))


@pytest.mark.parametrize("how", ["full", "read-only"])
def test_outputs_fail_with_one_line_and_nothing_half_written(disk, capfd, tmp_path, how: str):
    name = str(save_policy(make_policy((6, 1)), tmp_path / "policy.npz"))
    kept = save_policy(make_policy((6, 1)), disk.path / "kept.npz") if how == "read-only" else None
    if how == "full":
        disk.fill()
    else:
        disk.change("ro")
    words = SPACE if how == "full" else READ_ONLY
    before = sorted(disk.path.rglob("*"))
    with pytest.raises(OSError, match=words):
        save_policy(make_policy((6, 1)), disk.path / "policy.npz", overwrite=True)
    out = ["--out", str(disk.path / "out")]
    quick = ["--episodes", "1", "--start", "rest"]
    refused(capfd, words, "evaluate", name, *quick, *out)
    refused(capfd, words, "view", name, "--seconds", "0.04", "--out", str(disk.path / "a.gif"))
    refused(capfd, words, *OPTIMISE, *out)
    found = [one for one in disk.path.rglob("*") if one.is_file()]
    assert found == [one for one in before if one.is_file()]
    if kept is not None:
        load_policy(kept)
