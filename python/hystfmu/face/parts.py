"""Parts that a unit of a scenario can consist of: models, blocks, graphs, files; each as in a scenario.toml."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from hystfmu.base.errors import InputError
from hystfmu.graph import Graph, Node
from hystfmu.graph.blocks import Block
from hystfmu.graph.tables import graph_tables
from hystfmu.model import Model

What = Model | Block | Node | Graph | str | Path
FILES = ("model", "fmu", "inverse_of")  # keys of a unit that hold a path


def described(what: What, name: str, where: str) -> tuple[dict[str, Any], dict[str, Model | Path]]:
    """A unit as a table of the file, and what its path stands for.

    Parameters
    ----------
    what : Model, Block, Node, Graph, or path of an FMU or a model file
    name : str
        Of the unit; its file is called after it.
    where : str
        Scenario and unit, for messages.

    Raises
    ------
    InputError
        Something else, or a model file that cannot be read.
    """
    if isinstance(what, Block):
        what = what.node
    if isinstance(what, Node):
        table: dict[str, Any] = {"block": what.type}
        table |= {"dims": dict(what.dims)} if what.dims else {}
        return table | ({"values": {k: _plain(v) for k, v in what.values.items()}} if what.values else {}), {}
    if isinstance(what, Graph) and what.step:  # the tables of a graph do not hold its step, a model does
        what = Model("graph", what, what.step)
    if isinstance(what, Graph):
        return {"graph": graph_tables(what)}, {}
    if isinstance(what, (str, Path)):
        path = Path(what)
        if path.suffix == ".fmu":
            return {"fmu": f"{name}.fmu"}, {f"{name}.fmu": path.absolute()}
        if path.suffix != ".toml":
            raise InputError(f"{where}: The path must end in .fmu or .model.toml. Got {str(what)!r} instead.")
        what = Model.load(path)
    if isinstance(what, Model):
        return {"model": f"{name}.model.toml"}, {f"{name}.model.toml": what}
    raise InputError(f"{where}: A unit must be a model, a block, a graph or a path. Got {type(what).__name__} instead.")


def files(spec: Mapping[str, Any]) -> list[tuple[dict[str, Any], str]]:
    """Every table of a unit that names a file, with the key that does, in the scenario and in its cases."""
    units = [*spec.get("units", {}).values(), *(u for c in spec.get("case", ()) for u in c.get("units", {}).values())]
    return [(u, key) for u in units for key in FILES if key in u]


def _plain(value: Any) -> Any:
    """A parameter value as TOML has it."""
    if isinstance(value, np.generic):
        return value.item()
    if isinstance(value, np.ndarray):
        return value.ravel().tolist()
    if isinstance(value, (list, tuple)):
        return [_plain(v) for v in value]
    return value
