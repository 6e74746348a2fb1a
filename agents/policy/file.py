"""Policy files: one .npz of arrays and one JSON text. Loading one runs no code from it."""

import io
import json
import os
import platform
from collections.abc import Iterable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

import numpy as np

from stickslip.agents import untrusted
from stickslip.agents.machine import machine_of_env, read_configuration
from stickslip.agents.policy.network import MLPPolicy
from stickslip.agents.policy.shipped import NAME, no_policy, shipped_names, shipped_path
from stickslip.agents.protocol import Params, State
from stickslip.agents.training.configuration import command_of
from stickslip.dynamics.checks import nearest, require_kind, require_number, reraise, shown
from stickslip.dynamics.pytrees import with_all_digits
from stickslip.envs.functional import FunctionalEnv
from stickslip.envs.tasks.definition import TASKS, WITHDRAWN, TaskDefinition, withdrawal
from stickslip.envs.tasks.known import Interval, earned_in, measured
from stickslip.records.files import write_whole

FORMAT, VERSION = "stickslip policy", 1
ACCEPTED = "a .npz written by stickslip.agents.policy.save_policy"
PACKAGES = ("stickslip", "jax", "jaxlib", "numpy", "scipy", "gymnasium", "optax", "pyarrow")
PACKAGES += ("stable-baselines3", "torch", "matplotlib")
"""Those whose versions files name, where they are installed."""
SAVED = f"accepted: float32 or float64 numbers, at most {untrusted.LARGEST} bytes of them"
DEEPEST = 64
"""Layers at most."""
CHOICES = {"activation": "", "squash": "", "observation_clip": None, "history": 0}
"""Entries of the policy besides its numbers, as they are where a file lacks them."""
NAMED = "named_task"
"""The entry of the metadata with the task's name and digest."""
DIGITS = 12
"""Digits of a digest in messages."""


def save_policy(
    policy: MLPPolicy,
    path: str | Path,
    metadata: Mapping[str, untrusted.Json] | None = None,
    *,
    overwrite: bool = False,
) -> Path:
    """Write a policy and return the path. ValueError if the path exists and is not to be replaced.

    metadata: JSON values under names of the caller's choice, kept beside what the file says of
    itself (format, version, layer_sizes, activation, squash, observation_clip, history, versions);
    see `describe_environment`. The file appears whole or not at all.
    """
    require_kind("policy", policy, MLPPolicy, "an MLPPolicy; a baseline is known by its name")
    policy.validate()
    with reraise("", "; accepted: describe_environment of its own"):
        _require_described(policy, metadata or {})
    own = {
        "format": FORMAT,
        "version": VERSION,
        "layer_sizes": list(policy.layer_sizes),
        **{name: getattr(policy, name) for name in CHOICES},
        "versions": installed(),
    }
    text = untrusted.metadata_text(own, metadata)
    arrays = {f"weight_{i}": weight for i, weight in enumerate(policy.weights)}
    arrays |= {f"bias_{i}": bias for i, bias in enumerate(policy.biases)}
    arrays |= {"shift": policy.shift, "scale": policy.scale, "metadata": np.array(text)}
    file = io.BytesIO()
    np.savez_compressed(file, allow_pickle=False, **{n: np.asarray(a) for n, a in arrays.items()})
    raw = file.getvalue()
    with reraise("the policy could not be read again: ", f"; {SAVED}"):
        _policy(*_contents(raw))
    return write_whole(path, raw, overwrite=overwrite)


def load_policy(name: str | Path) -> MLPPolicy:
    """A policy by its name: of one that the package holds ("biped-ice", see `stickslip policies`),
    the path of a file, or the directory of a run with one.

    A name of the package's goes before a file called so, which is then "./biped-ice". ValueError
    naming the file, what is wrong with it and what is accepted, if it is missing, cut short, of
    another kind, has contents that do not fit, or was trained on a named task whose definition is
    another one here. The file is data: nothing in it is run.
    """
    return read_policy(existing_path(name))[0]


def read_policy(path: str | Path) -> tuple[MLPPolicy, dict[str, untrusted.Json]]:
    """The policy in a file, and what the file says of itself. ValueError as in `load_policy`."""
    with untrusted.reading(path, ACCEPTED, "its contents"):
        arrays, metadata = _contents(untrusted.read_bytes(path))
        policy = _policy(arrays, metadata)
        named_task_of(metadata)  # for what it refuses
        return policy, metadata


def read_metadata(name: str | Path) -> dict[str, untrusted.Json]:
    """Metadata of a policy file and of its training, by the names of `load_policy`.

    ValueError as there, but for a definition that changed.
    """
    path = existing_path(name)
    with untrusted.reading(path, ACCEPTED, "its contents"):
        return _contents(untrusted.read_bytes(path))[1]


def policy_path(name: str | Path) -> Path:
    """The policy's file of a name: the package's, itself, or the one in a run's directory."""
    shipped = shipped_path(name) if isinstance(name, str) else None
    if shipped is not None:
        return shipped
    path = Path(name)
    return path / "policy.npz" if path.is_dir() else path


def existing_path(name: str | Path) -> Path:
    """The same; ValueError for a word that names nothing, with the nearest of the package's."""
    require_kind("name", name, (str, os.PathLike), "the name of a policy, or a path")
    path = policy_path(name)
    if isinstance(name, str) and NAME.fullmatch(name) and not path.exists():
        raise ValueError(no_policy(name))
    return path if path.exists() else Path(name)


def describe_environment(
    env: FunctionalEnv[State, Params], params: Params
) -> dict[str, untrusted.Json]:
    """An environment and its parameters as JSON values, for the metadata of `save_policy`.

    `evaluate` and `view` play the policy on this task. ValueError for an environment of no machine,
    and for parameters of another one.
    """
    machine = machine_of_env(env)
    env.check_params(params)
    return machine.describe(env, params)


def named_task_entry(task: TaskDefinition) -> dict[str, untrusted.Json]:
    """Metadata of the named task that a policy was trained on."""
    return {NAMED: {"name": task.name, "digest": task.digest}}


def named_task_of(metadata: Mapping[str, untrusted.Json]) -> TaskDefinition | None:
    """The named task of a policy; None where its file names none.

    RefusedError for an unknown task or another digest: the file is of another version of
    stickslip, since a task never changes under its name.
    """
    entry = metadata.get(NAMED)
    if entry is None:
        return None
    given = entry if isinstance(entry, dict) else {}
    name, digest = given.get("name"), given.get("digest")
    if not isinstance(name, str) or not isinstance(digest, str):
        raise untrusted.RefusedError(f"{NAMED} is {shown(entry)}, no name with a digest")
    versions = metadata.get("versions")
    saved = versions.get("stickslip") if isinstance(versions, dict) else None
    saved = saved if isinstance(saved, str) else "of an unknown version"
    if (task := TASKS.get(name)) is not None and task.digest == digest:
        return task
    here = f"stickslip {version('stickslip')}"
    if name in WITHDRAWN:
        why = withdrawal(name)
    elif task is None:
        why = f"{here} has no such task{nearest(name, TASKS)}; accepted: one of `stickslip tasks`"
    else:
        why = (
            f"its definition is {shown(digest[:DIGITS])}, in {here} {task.digest[:DIGITS]}; "
            f"accepted: a policy trained on it (`stickslip train {task.machine} --task {name}`)"
        )
    raise untrusted.RefusedError(
        f"a policy of the task {shown(name)}, saved by stickslip {saved}; {why}, or the version "
        "that it came with"
    )


def _contents(raw: bytes) -> tuple[dict[str, np.ndarray], dict[str, untrusted.Json]]:
    arrays, content = untrusted.arrays_and_metadata(raw)
    return arrays, untrusted.require_format(content, FORMAT, VERSION, "a policy")


def _policy(arrays: dict[str, np.ndarray], metadata: Mapping[str, Any]) -> MLPPolicy:
    sizes = metadata.get("layer_sizes")
    if not isinstance(sizes, list) or not 2 <= len(sizes) <= DEEPEST + 1:
        raise untrusted.RefusedError(f"layer_sizes is no list of 2 to {DEEPEST + 1} sizes")
    layers = range(len(sizes) - 1)
    names = [f"{kind}_{i}" for kind in ("weight", "bias") for i in layers] + ["shift", "scale"]
    if set(names) != set(arrays):
        raise untrusted.RefusedError(
            f"its entries are {shown(sorted(arrays))}, not {shown(sorted(names))}"
        )
    for name, values in arrays.items():
        if values.dtype not in (np.float32, np.float64):
            raise untrusted.RefusedError(f"{name} is {values.dtype}, not float32 or float64")
    with reraise("", kind=untrusted.RefusedError):
        for name, values in arrays.items():
            require_number(name, values, dtype=np.float32, accepted="finite in float32")
        numbers = {name: with_all_digits(values) for name, values in arrays.items()}
        policy = MLPPolicy(
            weights=tuple(numbers[f"weight_{i}"] for i in layers),
            biases=tuple(numbers[f"bias_{i}"] for i in layers),
            shift=numbers["shift"],
            scale=numbers["scale"],
            **{name: metadata.get(name, usual) for name, usual in CHOICES.items()},
        ).validate()
    if list(policy.layer_sizes) != sizes:
        raise untrusted.RefusedError(f"its layers are {policy.layer_sizes}, it says {shown(sizes)}")
    _require_described(policy, metadata)
    return policy


def _require_described(policy: MLPPolicy, metadata: Mapping[str, untrusted.Json]) -> None:
    """Raise RefusedError for the description of an environment that the policy does not fit."""
    seen = policy.observation_size
    if (size := metadata.get("observation_size", seen)) != seen:
        raise untrusted.RefusedError(
            f"the policy observes {seen} numbers, the environment that it is described with "
            f"({shown(metadata.get('environment'))}) gives {shown(size)}"
        )


def installed(packages: Iterable[str] = PACKAGES) -> dict[str, str]:
    """Versions of Python and of those packages that are installed."""
    found = {"python": platform.python_version()}
    for package in packages:
        with suppress(PackageNotFoundError):
            found[package] = version(package)
    return found


EARNED, TRAINED = "earned", "trained"
"""Entries of the metadata."""


@dataclass(frozen=True)
class Record:
    """Training and score of a policy of the package.

    earned: over the task's own episodes: policy, return, low, high (None for a single episode),
    failures, returns. trained: config or program, timesteps, best_after, versions, machine.
    """

    name: str
    """Name as given by the caller."""
    path: Path
    task: TaskDefinition
    layer_sizes: tuple[int, ...]
    earned: dict[str, Any]
    trained: dict[str, Any]

    @property
    def earned_return(self) -> float:
        """Mean over the episodes."""
        return float(self.earned["return"])

    @property
    def score(self) -> Interval:
        """Normalised score."""
        return measured(self.task.name).score_of(earned_in({"policy": "", **self.earned}))

    @property
    def command(self) -> str:
        """Command that trains it again."""
        if "program" in self.trained:  # not by `stickslip train`
            return str(self.trained["program"])
        return command_of(read_configuration(json.dumps(self.trained["config"])))


def record_of(name: str) -> Record:
    """The record of a policy of the package. ValueError for an unknown name or a damaged file."""
    path = existing_path(name)
    policy, metadata = read_policy(path)
    task = named_task_of(metadata)
    earned, trained = metadata.get(EARNED), metadata.get(TRAINED)
    if task is None or not isinstance(earned, dict) or not isinstance(trained, dict):
        accepted = f"as `python -m benchmarks.policies` writes it, not {shown(sorted(metadata))}"
        raise ValueError(f"{path}: it lacks its task or its record; accepted: {accepted}")
    trained = {entry: one for entry, one in trained.items() if entry != "command"}
    return Record(name, path, task, policy.layer_sizes, earned, trained)


def every_record() -> list[Record]:
    """Records of all policies of the package."""
    return [record_of(name) for name in shipped_names()]
