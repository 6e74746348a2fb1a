"""`stickslip export`: a policy, or the biped of a machine's file, for other programs."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from stickslip.agents.policy.file import existing_path, read_policy
from stickslip.records.files import require_suffix, require_writable, write_whole

KINDS = {"out": (".onnx",), "mjcf": (".xml", ".mjcf"), "urdf": (".urdf", ".xml")}
"""Endings of the file that each flag names."""


def export_command(flags: Mapping[str, Any]) -> None:
    """Write a policy to --out, as ONNX, or a machine to --mjcf and --urdf."""
    paths = {kind: Path(flags[kind]) for kind in KINDS if flags[kind] is not None}
    if not paths or ("out" in paths and len(paths) > 1):
        given = " and ".join(f"--{kind}" for kind in paths) or "no file"
        raise ValueError(f"{given}; accepted: --out of a policy, or --mjcf, --urdf of a machine")
    if "out" in paths and (flags["changes"] or flags["mu"] is not None):
        raise ValueError("--mu or --set with a policy; accepted: with the file of a machine")
    for kind, path in paths.items():
        require_suffix(path, KINDS[kind])
    if len(set(paths.values())) < len(paths):
        raise ValueError(f"--mjcf {flags['mjcf']} with --urdf {flags['urdf']}; accepted: two files")
    if "out" not in paths:
        export_machine(flags, paths)
        return
    from stickslip.agents.policy.exchange import export_onnx

    path, (policy, metadata) = paths["out"], read_policy(existing_path(flags["who"]))
    export_onnx(policy, path, metadata, overwrite=flags["overwrite"])
    sizes = policy.layer_sizes
    print(f"Written: {path}, {sizes[0]} numbers in, {sizes[-1]} out, normalisation included")


def export_machine(flags: Mapping[str, Any], paths: Mapping[str, Path]) -> None:
    """Write the biped of a file as MJCF and URDF, and print what they cannot say."""
    from stickslip.agents.exchange.files import ABOUT, mechanism, missing, mjcf, urdf
    from stickslip.dynamics.biped import BipedParams
    from stickslip.dynamics.biped.settings import precision
    from stickslip.dynamics.machine_file import machine_in
    from stickslip.dynamics.pytrees import require_one
    from stickslip.optimise.biped import TORQUE_LIMIT

    source, changes = flags["who"], flags["changes"]
    mu = 0.5 if flags["mu"] is None else flags["mu"]
    require_one("mu", mu, low=0.0, accepted="a finite coefficient >= 0")
    if machine_in(source) != "biped":
        raise ValueError(
            f"{source} is a vehicle, whose quasi-static half-model has no counterpart in MJCF and "
            "URDF; accepted: the file of a biped"
        )
    with precision("float64"):
        robot, motor = BipedParams.with_motor(source, changes)
        machine = mechanism(robot)
    limit = motor.get("torque_limit", TORQUE_LIMIT)
    require_writable(list(paths.values()), flags["overwrite"])
    for kind, path in paths.items():
        if kind == "mjcf":
            text, about = mjcf(machine, friction=mu, torque_limit=limit), ABOUT
        else:
            text, about = urdf(machine, limit), missing(machine)
        write_whole(path, text, overwrite=flags["overwrite"])
        print(f"Written: {path}\n{about}")
