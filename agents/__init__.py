"""Baseline controllers, training, policy files and batch evaluation of the registered machines."""

from typing import TYPE_CHECKING

from stickslip.dynamics.lazily import loaded_when_used

if TYPE_CHECKING:
    from stickslip.agents.biped.controllers import ConstantTorque, CrankSpeedPI
    from stickslip.agents.biped.machine import TrainConfig
    from stickslip.agents.biped.prediction import ComputedTorque, GaitTable, OptimalGait, gaits_of
    from stickslip.agents.evaluation.evaluate import evaluate, evaluate_task
    from stickslip.agents.evaluation.rollout import Idle, Rollout, rollout
    from stickslip.agents.evaluation.table import Evaluation
    from stickslip.agents.machine import Machine, machines, register
    from stickslip.agents.pictures.episodes import film
    from stickslip.agents.pictures.view import View, show
    from stickslip.agents.policy.exchange import export_onnx, from_sb3
    from stickslip.agents.policy.file import (
        describe_environment,
        load_policy,
        read_metadata,
        save_policy,
    )
    from stickslip.agents.policy.network import MLPPolicy
    from stickslip.agents.policy.shipped import shipped_names
    from stickslip.agents.protocol import Controller
    from stickslip.agents.sweeps.data import SweepArrays, read_sweep, sweep_arrays
    from stickslip.agents.sweeps.sweep import sweep
    from stickslip.agents.training.configuration import Trained
    from stickslip.agents.training.run import train
    from stickslip.agents.ugv.controllers import (
        FixedPosture,
        FollowPath,
        LevelBody,
        Optimum,
        RecedingHorizon,
    )
    from stickslip.agents.ugv.machine import UGVTrainConfig
else:
    __getattr__, __dir__ = loaded_when_used(__name__)

__all__ = [
    "ComputedTorque",
    "ConstantTorque",
    "Controller",
    "CrankSpeedPI",
    "Evaluation",
    "FixedPosture",
    "FollowPath",
    "GaitTable",
    "Idle",
    "LevelBody",
    "MLPPolicy",
    "Machine",
    "OptimalGait",
    "Optimum",
    "RecedingHorizon",
    "Rollout",
    "SweepArrays",
    "TrainConfig",
    "Trained",
    "UGVTrainConfig",
    "View",
    "describe_environment",
    "evaluate",
    "evaluate_task",
    "export_onnx",
    "film",
    "from_sb3",
    "gaits_of",
    "load_policy",
    "machines",
    "read_metadata",
    "read_sweep",
    "register",
    "rollout",
    "save_policy",
    "shipped_names",
    "show",
    "sweep",
    "sweep_arrays",
    "train",
]
