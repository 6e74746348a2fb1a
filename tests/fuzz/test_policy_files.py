"""Policy files, checkpoints and configurations of any content: a ValueError, or what is sound."""

import json
import resource
import time
from collections import Counter
from pathlib import Path

import jax.numpy as jnp
import numpy as np
import pytest

from stickslip.agents import describe_environment, load_policy, save_policy
from stickslip.agents.biped.machine import TrainConfig
from stickslip.agents.machine import read_configuration
from stickslip.agents.policy.network import FARTHEST
from stickslip.agents.training import directory
from stickslip.agents.training.directory import STATE, MetricsFile, read_columns
from stickslip.envs import BipedEnv
from tests.agents.networks import make_policy
from tests.fuzz import spoilt

pytestmark = pytest.mark.long
POLICIES, OTHERS = 10_000, 1_000
LONGEST, LARGEST = 2.0, 600e6
"""What one file may take: seconds of processor time; bytes more than the process had before."""


@pytest.fixture
def policy_bytes(tmp_path: Path) -> bytes:
    policy = make_policy((6, 16, 16, 1), 0, activation="relu", observation_clip=10.0)
    env = BipedEnv()
    about = describe_environment(env, env.default_params)
    return save_policy(policy, tmp_path / "whole.npz", about).read_bytes()


class Tally:
    """What came of the tries, and what the worst of them took."""

    def __init__(self):
        self.counts: Counter[tuple[str, str]] = Counter()
        self.seconds, self.longest_words = 0.0, 0
        self.before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss

    def run(self, kind: str, read) -> None:
        begun = time.process_time()
        try:
            read()
            outcome = "sound"
        except ValueError as error:
            outcome = "refused"
            self.longest_words = max(self.longest_words, len(str(error)))
        self.seconds = max(self.seconds, time.process_time() - begun)
        self.counts[kind, outcome] += 1

    def close(self, what: str) -> None:
        grown = 1024 * (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - self.before)
        print(f"\n{what}: {self.counts.total()} tried, longest {self.seconds:.2f} s, ", end="")
        print(f"{grown / 1e6:.0f} MB at most")
        for (kind, outcome), count in sorted(self.counts.items()):
            print(f"  {kind:16} {outcome:8} {count}")
        assert self.longest_words < 1500
        assert self.seconds < LONGEST
        assert grown < LARGEST


def test_a_policy_file_is_refused_or_gives_finite_actions(tmp_path: Path, policy_bytes: bytes):
    path, tally = tmp_path / "policy.npz", Tally()
    rng = np.random.default_rng(1)
    obs = rng.normal(size=(16, 6)) * 10.0 ** rng.uniform(-3, 5, size=(16, 1))
    obs = jnp.float32(np.vstack([obs, FARTHEST * np.sign(obs), np.zeros((1, 6))]))

    def read():
        policy = load_policy(path)
        if policy.layer_sizes[0] == obs.shape[-1]:
            assert np.all(np.isfinite(policy(obs)))

    for seed in range(POLICIES):
        kind, raw = spoilt.spoil(policy_bytes, seed)
        path.write_bytes(raw)
        tally.run(kind, read)
    tally.close("policy files")
    assert tally.counts["numbers", "sound"] > 0  # or the finite actions were never looked at


def test_text_files_of_a_run_are_refused_or_sound(tmp_path: Path):
    config = TrainConfig.of(random_mass=(0.5, 2.0)).to_json()
    head = {"format": "stickslip checkpoint", "version": 3}
    state = json.dumps(head | {"timesteps": 128, "seconds": 1.5, "config": "0123456789abcdef"})
    table = tmp_path / "metrics.csv"
    rows = MetricsFile(table, ("a", "b"))
    for steps in range(10, 90, 10):
        rows.append(steps, {"a": steps / 7})
    metrics, tally = table.read_text(), Tally()

    def read_state_again():
        assert isinstance(directory.read_state(tmp_path), directory.TrainState)

    for seed in range(OTHERS):
        rng = np.random.default_rng(seed)
        text = spoilt.spoil_json(config, rng)
        tally.run("configuration", lambda text=text: read_configuration(text).digest)
        text = spoilt.spoil_json(state, rng)
        (tmp_path / STATE).write_bytes(text.encode("utf-8", "surrogateescape"))
        tally.run("state", read_state_again)
        table.write_bytes(spoilt.mutated(metrics.encode(), spoilt.PIECES, rng))
        tally.run("table", lambda: read_columns(table))
    tally.close("texts of runs")
