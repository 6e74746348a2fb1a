"""Importing stickslip and reading help load neither JAX nor NumPy nor Gymnasium."""

import argparse
import ast
import json
import os
import subprocess
import sys
import tomllib
from collections.abc import Iterator
from importlib import import_module
from importlib.util import find_spec
from pkgutil import iter_modules

import pytest

from stickslip.cli import COMMANDS, make_parser
from stickslip.envs.tasks.definition import TASKS
from tests.documents import ROOT

HEAVY = ("jax", "jaxlib", "numpy", "scipy", "gymnasium", "cvxpy", "torch", "matplotlib")
LAYERS = ("dynamics", "dynamics.biped", "dynamics.ugv", "optim", "envs", "envs.tasks")


def answer(code: str) -> list:
    """What a new interpreter prints last, as JSON; it finds what this one finds."""
    paths = os.pathsep.join(filter(None, sys.path))
    ran = subprocess.run(
        [sys.executable, "-W", "error", "-c", code],
        capture_output=True,
        text=True,
        check=True,
        env=os.environ | {"PYTHONPATH": paths},
    )
    return json.loads(ran.stdout.splitlines()[-1])


def loaded_after(code: str) -> list[str]:
    """Which of HEAVY a new interpreter has loaded after running the code."""
    asked = f"print('\\n' + json.dumps([one for one in {HEAVY} if one in sys.modules]))"
    return answer(f"import json, sys\n{code}\n{asked}")


def commands() -> list[str]:
    """Every command, with each machine that it is given; a new one is among them by itself."""
    (of_commands,) = (
        one
        for one in make_parser(list(COMMANDS))._actions
        if isinstance(one, argparse._SubParsersAction)
    )
    found = [""]
    for name, parser in of_commands.choices.items():
        found.append(name)
        machines = next((one.choices for one in parser._actions if one.dest == "machine"), None)
        found += [f"{name} {machine}" for machine in machines or ()]
    return found


def test_help_loads_nothing_heavy():
    code = f"""
import json, sys
from stickslip.cli import main
found = {{}}
for command in {commands()}:
    try:
        main([*command.split(), "--help"])
    except SystemExit:
        found[command] = [one for one in {HEAVY} if one in sys.modules]
print(json.dumps([found]))
"""
    (found,) = answer(code)
    assert found == {command: [] for command in commands()}


def test_importing_and_listing_packages_loads_nothing_heavy():
    lazy = [name for name in LAYERS if name not in ("dynamics.biped", "dynamics.ugv")]
    lines = [f"dir(stickslip.{name})" for name in (*lazy, "agents", "paper", "optimise")]
    assert loaded_after("\n".join(["import stickslip", "stickslip.__version__", *lines])) == []


def test_names_of_scenes_and_tracks_load_nothing_heavy():
    modules = ("dynamics.names", "envs.tasks.definition")
    assert loaded_after("\n".join(f"import stickslip.{one}" for one in modules)) == []


def test_an_environment_asked_for_by_the_package_and_its_name_loads_what_it_needs():
    made = "gymnasium.make('stickslip:stickslip/Biped-v0', height=1)"
    code = (
        f"import gymnasium\ntry: {made}\nexcept ValueError as error: assert 'height' in str(error)"
    )
    assert {"jax", "numpy", "gymnasium"} <= set(loaded_after(code))


@pytest.mark.parametrize(
    "code",
    [
        "import stickslip, gymnasium",
        "import gymnasium, stickslip",
        "import stickslip, importlib.util; importlib.util.find_spec('gymnasium'); import gymnasium",
    ],
)
def test_the_environments_are_registered_in_either_order_of_imports(code: str):
    listed = "[one for one in gymnasium.registry if one.startswith('stickslip/')]"
    rest = "[type(one).__name__ for one in sys.meta_path if '_Watch' in type(one).__name__]"
    ids, watching = answer(f"import json, sys\n{code}\nprint(json.dumps([{listed}, {rest}]))")
    assert ids == ["stickslip/Biped-v0", "stickslip/UGV-v0", *(one.id for one in TASKS.values())]
    assert watching == []


def declared(layer: str) -> Iterator[tuple[str, str]]:
    """Module and name of each import that a package's __init__ makes for type checkers."""
    folder = ROOT.joinpath(*layer.split("."))
    for node in ast.walk(ast.parse((folder / "__init__.py").read_text(encoding="utf-8"))):
        if isinstance(node, ast.ImportFrom) and node.module != "typing":
            yield from ((str(node.module), one.name) for one in node.names)


@pytest.mark.parametrize("layer", LAYERS)
def test_what_a_package_names_is_what_type_checkers_see(layer: str):
    package = import_module(f"stickslip.{layer}")
    homes = {name: home for home, name in declared(layer) if name != "loaded_when_used"}
    of_extra = {name for name, home in homes.items() if home.endswith(".sb3")}
    assert {*homes} - of_extra == {*package.__all__}  # so that `import *` needs no extra
    assert set(homes) <= set(dir(package))
    for name, home in homes.items():
        package_of = "stable_baselines3" if home.endswith(".sb3") else ""
        if not package_of or find_spec(package_of):
            assert getattr(package, name) is getattr(import_module(home), name)


def test_no_module_is_hidden_behind_a_name_of_its_package():
    """`import a.b as c` gives the attribute b of a, which would be the function of that name."""
    with pytest.raises(AttributeError, match="no attribute 'nonsense'"):
        import_module("stickslip.optim").nonsense  # noqa: B018
    declared = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    names = [name for name in declared["tool"]["setuptools"]["packages"] if "sb3" not in name]
    for package in map(import_module, names):
        modules = {one.name for one in iter_modules(package.__path__)}
        assert modules.isdisjoint(getattr(package, "__all__", ())), package.__name__
