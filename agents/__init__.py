"""Baseline controllers, training, policy files and batch evaluation of the registered machines."""

from typing import TYPE_CHECKING

from stickslip.dynamics.lazily import loaded_when_used

if TYPE_CHECKING:
    from stickslip.agents.biped.controllers import ConstantTorque as ConstantTorque
    from stickslip.agents.biped.controllers import CrankSpeedPI as CrankSpeedPI
    from stickslip.agents.biped.machine import TrainConfig as TrainConfig
    from stickslip.agents.biped.output_feedback import OutputFeedback as OutputFeedback
    from stickslip.agents.biped.prediction import ComputedTorque as ComputedTorque
    from stickslip.agents.biped.prediction import GaitTable as GaitTable
    from stickslip.agents.biped.prediction import OptimalGait as OptimalGait
    from stickslip.agents.biped.prediction import gaits_of as gaits_of
    from stickslip.agents.evaluation.evaluate import evaluate as evaluate
    from stickslip.agents.evaluation.evaluate import evaluate_task as evaluate_task
    from stickslip.agents.evaluation.rollout import Idle as Idle
    from stickslip.agents.evaluation.rollout import Rollout as Rollout
    from stickslip.agents.evaluation.rollout import rollout as rollout
    from stickslip.agents.evaluation.table import Evaluation as Evaluation
    from stickslip.agents.exchange.record import record as record
    from stickslip.agents.machine import Machine as Machine
    from stickslip.agents.machine import machines as machines
    from stickslip.agents.machine import register as register
    from stickslip.agents.pictures.episodes import film as film
    from stickslip.agents.pictures.view import View as View
    from stickslip.agents.pictures.view import show as show
    from stickslip.agents.policy.exchange import export_onnx as export_onnx
    from stickslip.agents.policy.exchange import from_sb3 as from_sb3
    from stickslip.agents.policy.file import describe_environment as describe_environment
    from stickslip.agents.policy.file import load_policy as load_policy
    from stickslip.agents.policy.file import read_metadata as read_metadata
    from stickslip.agents.policy.file import save_policy as save_policy
    from stickslip.agents.policy.network import MLPPolicy as MLPPolicy
    from stickslip.agents.policy.shipped import shipped_names as shipped_names
    from stickslip.agents.protocol import Controller as Controller
    from stickslip.agents.sweeps.data import SweepArrays as SweepArrays
    from stickslip.agents.sweeps.data import read_sweep as read_sweep
    from stickslip.agents.sweeps.data import sweep_arrays as sweep_arrays
    from stickslip.agents.sweeps.sweep import sweep as sweep
    from stickslip.agents.training.configuration import Trained as Trained
    from stickslip.agents.training.run import train as train
    from stickslip.agents.ugv.controllers import FixedPosture as FixedPosture
    from stickslip.agents.ugv.controllers import FollowPath as FollowPath
    from stickslip.agents.ugv.controllers import LevelBody as LevelBody
    from stickslip.agents.ugv.controllers import Optimum as Optimum
    from stickslip.agents.ugv.machine import UGVTrainConfig as UGVTrainConfig
    from stickslip.agents.ugv.regret import DriveValues as DriveValues
    from stickslip.agents.ugv.regret import RegretInfo as RegretInfo
else:
    __getattr__, __dir__, __all__ = loaded_when_used(__name__)
