"""Environments: pure functional cores and their Gymnasium and Stable-Baselines3 adapters."""

from stickslip.envs.biped import BipedEnv, BipedEnvState
from stickslip.envs.biped_params import BipedEnvParams, Randomisation
from stickslip.envs.functional import FunctionalEnv

__all__ = ["BipedEnv", "BipedEnvParams", "BipedEnvState", "FunctionalEnv", "Randomisation"]
