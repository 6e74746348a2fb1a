"""The programs of docs/sweeps.md that need other packages.

Those that read a sweep run where these are installed. Clusters are Dask's own, of this machine,
under the names that the page imports.
"""

import ast
import sys
from types import ModuleType

import pytest

from stickslip.agents import read_sweep
from stickslip.envs import BipedEnv
from tests.documents import every_block
from tests.test_examples import BEFORE

pytestmark = pytest.mark.long
OTHERS = [
    block for block in every_block() if (block.page, block.language) == ("docs/sweeps.md", "py")
]


def code_that_says(words: str) -> str:
    (found,) = [block.code for block in OTHERS if words in block.code]
    return found


@pytest.mark.parametrize("package", ["polars"])
def test_another_program_reads_a_sweep(package: str, tmp_path, monkeypatch):
    pytest.importorskip(package)
    monkeypatch.chdir(tmp_path)
    exec(BEFORE["read_sweep("], {})
    *lines, last = ast.parse(code_that_says(f"import {package}")).body
    names: dict = {}
    exec(compile(ast.Module(lines, []), package, "exec"), names)
    assert isinstance(last, ast.Expr)
    found = eval(compile(ast.Expression(last.value), package, "eval"), names)
    assert len(found.rows()) == 2 * 2  # policies, floors


def test_a_cluster_s_program_sweeps(tmp_path, monkeypatch):
    package, cluster = "dask_jobqueue", "SLURMCluster"
    distributed = pytest.importorskip("distributed")
    made = []

    class Stand(distributed.LocalCluster):
        def __init__(self, **asked):
            assert asked
            super().__init__(n_workers=1, threads_per_worker=1, dashboard_address=":0")
            made.append(self)

        def scale(self, n: int = 1, *, jobs: int = 1):
            super().scale(min(n, jobs))

    stand = ModuleType(package)
    setattr(stand, cluster, Stand)
    monkeypatch.setitem(sys.modules, package, stand)
    monkeypatch.chdir(tmp_path)
    names = {
        "task": (BipedEnv(), BipedEnv().make_params()),
        "policies": ["crank-speed-pi"],
        "axes": {"mu": [0.06, 0.2]},
    }
    code = "from stickslip.agents import sweep\n" + code_that_says(f"import {cluster}")
    try:
        exec(code.replace("256", "2"), names)
    finally:
        for one in made:
            one.close()
    assert read_sweep("runs/big").num_rows == 2  # nothing is drawn: one episode a point
