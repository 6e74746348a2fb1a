"""What SECURITY.md says: its limits are the code's, its tests are there, nothing read is run."""

import ast
import re
from collections.abc import Iterator

import pytest

from stickslip.agents import untrusted
from stickslip.agents.policy import file as policy_file
from stickslip.optim.posture import track_file
from stickslip.simulate import torque
from tests.documents import ROOT
from tests.packaging.test_package_list import package_folders

TEXT = (ROOT / "SECURITY.md").read_text(encoding="utf-8")
MIB = 2**20
LIMITS = {
    "policy (`.npz`)": (
        f"{untrusted.LARGEST // MIB} MiB",
        f"{untrusted.MOST_ENTRIES:,} entries",
        f"{policy_file.DEEPEST} layers",
    ),
    "JSON in these": (f"{untrusted.LARGEST_TEXT // MIB} MiB",),
    "torque as arithmetic": (f"{torque.LONGEST:,} characters", f"{torque.DEEPEST} levels"),
    "tables of a run": (f"{untrusted.LARGEST_TABLE // MIB} MiB",),
    "track (": (
        f"{track_file.MOST_BYTES // MIB} MiB",
        f"{track_file.MOST_IN_A_LINE:,} characters",
        f"{track_file.DEEPEST} levels",
    ),
}
RUNS = {"eval", "exec", "pickle.load", "pickle.loads", "onnx.load", "torch.load", "marshal.loads"}
RUNS |= {"joblib.load", "cloudpickle.loads", "yaml.load", "os.system", "os.popen"}
NUMPY = ("np.load", "numpy.load", "np.lib.format.read_array")
TRUSTED = {
    "agents/sweeps/sweep.py": {"pickle.loads"},
    "agents/optimisers/worker.py": {"pickle.loads"},
}
"""Workers of an executor, and the processes of a race, as SECURITY.md says."""


@pytest.mark.parametrize("what", LIMITS)
def test_a_limit_is_that_of_the_code(what: str):
    (row,) = (line for line in TEXT.splitlines() if line.startswith(f"| {what}"))
    assert [limit for limit in LIMITS[what] if limit not in row] == []


def test_a_test_that_is_named_is_there():
    named = re.findall(r"`(tests/[\w/]+\.py)`: `(test_\w+)`", TEXT)
    assert len(named) >= 6
    for file, name in named:
        assert f"def {name}(" in (ROOT / file).read_text(encoding="utf-8"), (file, name)


def risky(source: str) -> Iterator[str]:
    """Calls by which what is read could run, by their dotted names."""
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Call):
            name = ast.unparse(node.func)
            given = {one.arg: ast.unparse(one.value) for one in node.keywords}
            if name in RUNS or given.get("shell") == "True":
                yield name
            if name in NUMPY and given.get("allow_pickle") != "False":
                yield name


def test_nothing_that_is_read_is_run():
    found = {}
    for folder in set(package_folders().values()):
        for path in (ROOT / folder).glob("*.py"):
            if calls := set(risky(path.read_text(encoding="utf-8"))):
                found[path.relative_to(ROOT).as_posix()] = calls
    assert found == TRUSTED
