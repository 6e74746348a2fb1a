"""`stickslip export`."""

from __future__ import annotations

from typing import TYPE_CHECKING

from stickslip.commands import Outcome
from stickslip.commands.shared import add_overwrite, add_who, shipped
from stickslip.parser import add_tables

if TYPE_CHECKING:
    import argparse
    from collections.abc import Sequence

JSON = False
EXAMPLES = {
    "stickslip export biped-ice --out ice.onnx": "for any runtime of ONNX",
    "stickslip demo": "trains a walker, into runs/demo",
    "stickslip export runs/demo --out walker.npz": "of a run, here that one, for NumPy alone",
}


def add_flags(parser: argparse.ArgumentParser, arguments: Sequence[str]) -> None:
    """Add the policy and the file."""
    del arguments
    add_who(parser, "one of those below, a file or a run")
    parser.add_argument(
        "--out", metavar="FILE", required=True, help=".onnx, or .npz for NumPy alone"
    )
    add_overwrite(parser, "the file")
    add_tables(parser, shipped())


def run(given: argparse.Namespace) -> Outcome:
    """Write a policy as ONNX or as a NumPy archive, by the ending of --out."""
    from pathlib import Path

    from stickslip.agents.policy.file import existing_path, read_policy
    from stickslip.agents.view_files import require_new, require_suffix, require_writable
    from stickslip.records.files import write_whole

    path = Path(given.out)
    require_suffix(path, (".onnx", ".npz"))
    source = existing_path(given.who)
    policy, metadata = read_policy(source)
    require_new([path], given.overwrite)
    require_writable([path])
    if path.suffix.lower() == ".npz":
        write_whole(path, source.read_bytes(), overwrite=given.overwrite)
    else:
        from stickslip.agents.policy.onnx import export_onnx

        export_onnx(policy, path, metadata, overwrite=given.overwrite)
    sizes = policy.layer_sizes
    print(f"Written: {path}, {sizes[0]} numbers in, {sizes[-1]} out, normalisation included")
    return Outcome()
