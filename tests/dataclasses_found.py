"""Every dataclass of the package, for what must hold for all of them."""

import dataclasses
import importlib
import pkgutil
from typing import Any


def dataclasses_of_the_package() -> set[type]:
    members: list[Any] = []
    for part in ("dynamics", "optim", "envs", "agents"):
        package = importlib.import_module(f"stickslip.{part}")
        for module in pkgutil.walk_packages(package.__path__, f"{package.__name__}."):
            try:
                members += vars(importlib.import_module(module.name)).values()
            except ModuleNotFoundError as error:  # of an extra that is not installed
                if (error.name or "stickslip").startswith("stickslip"):
                    raise
    kinds = {one for one in members if isinstance(one, type) and dataclasses.is_dataclass(one)}
    return {kind for kind in kinds if kind.__module__.startswith("stickslip.")}
