"""HystFMU: identify the hysteresis of smart-material actuators, invert it, export it as FMUs.

The names below load on first use, so that ``import hystfmu`` stays fast.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from hystfmu.base.errors import InputError as InputError
    from hystfmu.data import Dataset as Dataset
    from hystfmu.graph import Graph as Graph
    from hystfmu.graph import Node as Node
    from hystfmu.model import Model as Model
    from hystfmu.unit import Unit as Unit

__version__ = "0.1.0"

_HOME = {
    "Dataset": "data",
    "Graph": "graph",
    "InputError": "base.errors",
    "Model": "model",
    "Node": "graph",
    "Unit": "unit",
}
__all__ = ["Dataset", "Graph", "InputError", "Model", "Node", "Unit"]


def __getattr__(name: str) -> Any:
    if name in _HOME:
        return getattr(importlib.import_module(f"hystfmu.{_HOME[name]}"), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
