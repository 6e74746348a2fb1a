"""`stickslip export`: a policy, or the biped of a machine's file, for other programs."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from stickslip.agents.policy.file import existing_path, read_policy
from stickslip.records.files import require_new, require_suffix, require_writable, write_whole

KINDS = {"out": (".onnx", ".npz"), "mjcf": (".xml", ".mjcf")}
"""Endings of the file that each flag names."""
MU = 0.5
"""Usual friction of an exported floor [-]."""


def export_command(flags: Mapping[str, Any]) -> None:
    """Write a policy to --out, or a machine to --mjcf."""
    paths = {kind: Path(flags[kind]) for kind in KINDS if flags[kind] is not None}
    if len(paths) != 1:
        given = " and ".join(f"--{kind}" for kind in paths) or "no file"
        raise ValueError(f"{given}; accepted: --out of a policy, or --mjcf of a machine")
    if "out" in paths and (flags["changes"] or flags["mu"] is not None):
        raise ValueError("--mu or --set with a policy; accepted: with the file of a machine")
    ((kind, path),) = paths.items()
    require_suffix(path, KINDS[kind])
    require_new([path], flags["overwrite"])
    (export_policy if kind == "out" else export_machine)(flags, path)


def export_policy(flags: Mapping[str, Any], path: Path) -> None:
    """Write a policy as ONNX or as a NumPy archive, by the ending of --out."""
    source, overwrite = existing_path(flags["who"]), flags["overwrite"]
    policy, metadata = read_policy(source)
    require_writable([path])
    if path.suffix.lower() == ".npz":
        write_whole(path, source.read_bytes(), overwrite=overwrite)
    else:
        from stickslip.agents.policy.exchange import export_onnx

        export_onnx(policy, path, metadata, overwrite=overwrite)
    sizes = policy.layer_sizes
    print(f"Written: {path}, {sizes[0]} numbers in, {sizes[-1]} out, normalisation included")


def export_machine(flags: Mapping[str, Any], path: Path) -> None:
    """Write the biped of a file as MJCF, and print what it cannot say."""
    from stickslip.agents.exchange.mjcf import ABOUT, mechanism, mjcf
    from stickslip.dynamics.biped import BipedParams
    from stickslip.dynamics.biped.settings import precision
    from stickslip.dynamics.machine_file import machine_in
    from stickslip.dynamics.pytrees import require_one
    from stickslip.optimise.biped import TORQUE_LIMIT

    source, changes = flags["who"], flags["changes"]
    mu = MU if flags["mu"] is None else flags["mu"]
    require_one("mu", mu, low=0.0, accepted="a finite coefficient >= 0")
    if machine_in(source) != "biped":
        raise ValueError(
            f"{source} is a vehicle, whose quasi-static half-model has no counterpart in "
            "MJCF; accepted: the file of a biped"
        )
    with precision("float64"):
        robot, motor = BipedParams.with_motor(source, changes)
        machine = mechanism(robot)
    limit = motor.get("torque_limit", TORQUE_LIMIT)
    require_writable([path])
    text = mjcf(machine, friction=mu, torque_limit=limit)
    write_whole(path, text, overwrite=flags["overwrite"])
    print(f"Written: {path}\n{ABOUT}")
