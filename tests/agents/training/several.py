"""Trainings on one, two and four devices of one process, printed as JSON; run with four of them."""

import json
import sys

import jax
import numpy as np

from stickslip.agents import register
from stickslip.agents.training.ppo.trainer import PPOTrainer
from tests.agents.mass import MassConfig, MassEnv, MassMachine, MassParams

CONFIG = {"timesteps": 384, "num_envs": 8, "rollout_steps": 16, "batch_size": 32, "hidden": 8}


def main() -> None:
    """After two updates the state goes over to another number of devices."""
    register(MassMachine())
    config, found = MassConfig.of(**CONFIG), {}
    states = {}
    for devices in (1, 2, 4):
        rows = []
        trainer = PPOTrainer(
            config, MassEnv(), MassParams(), rows.append, lambda: False, devices=devices
        )
        trainer.begin_stretch(0)
        trainer.advance(256)
        states[devices] = trainer.take_state()
        if devices == 4:
            trainer.put_state(states[2])
        trainer.advance(384)
        laid = trainer.take_state()["learner"]
        found[devices] = {
            "curve": [{**row.losses, "ended": len(row.ended.get("speed", []))} for row in rows],
            "weights": np.concatenate([laid[name].ravel() for name in sorted(laid)]).tolist(),
            "on": len(jax.tree.leaves(trainer._start.progress)[0].sharding.device_set),
        }
    json.dump(found, sys.stdout)


if __name__ == "__main__":
    main()
