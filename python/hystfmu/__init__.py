"""HystFMU identifies models of hysteresis of smart-material actuators, inverts the models, and exports FMUs.

>>> import hystfmu as hy
>>> data = hy.synthetic.piezo(reversals=60, rate=1000.0)
>>> model = hy.fit(data, "prandtl_ishlinskii")
>>> model.inverse().export("inverse.fmu", fmi=3).name
'inverse.fmu'

Every public name is imported on first use, so that ``import hystfmu`` is fast. ``dir(hystfmu)`` lists these names.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

from hystfmu.base import __version__ as __version__

if TYPE_CHECKING:
    from hystfmu import design as design
    from hystfmu import redesign as redesign
    from hystfmu.base.errors import InputError as InputError
    from hystfmu.data import Dataset as Dataset
    from hystfmu.data import signals as signals
    from hystfmu.data import synthetic as synthetic
    from hystfmu.data.reader import read as read
    from hystfmu.face.fit import fit as fit
    from hystfmu.face.model import Model as Model
    from hystfmu.face.scenario import Scenario as Scenario
    from hystfmu.face.study import Study as Study
    from hystfmu.fmu.check.check import validate as validate
    from hystfmu.graph import Graph as Graph
    from hystfmu.graph import Input as Input
    from hystfmu.graph import Node as Node
    from hystfmu.graph import Output as Output
    from hystfmu.graph import blocks as blocks
    from hystfmu.scenario import run as run
    from hystfmu.studies import study as study
    from hystfmu.unit import Unit as Unit

_HOME = {  # module and name of each public object; an empty name means the module itself
    "Dataset": "data:Dataset",
    "Graph": "graph:Graph",
    "Input": "graph:Input",
    "InputError": "base.errors:InputError",
    "Model": "face.model:Model",
    "Node": "graph:Node",
    "Output": "graph:Output",
    "Scenario": "face.scenario:Scenario",
    "Study": "face.study:Study",
    "Unit": "unit:Unit",
    "blocks": "graph.blocks:",
    "design": "design:",
    "fit": "face.fit:fit",
    "read": "data.reader:read",
    "redesign": "redesign:",
    "run": "scenario.running:run",
    "signals": "data.signals:",
    "study": "studies.run:study",
    "synthetic": "data.synthetic:",
    "validate": "fmu.check.check:validate",
}
__all__ = [*_HOME]


if not TYPE_CHECKING:  # with __getattr__, a type checker would accept misspelt names

    def __getattr__(name: str) -> Any:
        if name not in _HOME:
            raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
        module, _, inner = _HOME[name].partition(":")
        home = importlib.import_module(f"{__name__}.{module}")
        return getattr(home, inner) if inner else home


def __dir__() -> list[str]:
    return __all__
