"""Conversion of models, blocks, graphs and files to units of a scenario, as in a scenario.toml."""

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
    """Return the table of a unit in the file, and the models or files behind the paths in this table.

    Parameters
    ----------
    what : Model, Block, Node, Graph, or path of an FMU or a model file
    name : str
        Name of the unit. The file of the unit has the same name.
    where : str
        Scenario and unit, as prefix of error messages.

    Raises
    ------
    InputError
        `what` has another type, or a model file cannot be read.
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
    """Return all unit tables with a file name, in the scenario and its cases, each with the key of the file name."""
    units = [*spec.get("units", {}).values(), *(u for c in spec.get("case", ()) for u in c.get("units", {}).values())]
    return [(u, key) for u in units for key in FILES if key in u]


def _plain(value: Any) -> Any:
    """Convert a parameter value to a type of TOML."""
    if isinstance(value, np.generic):
        return value.item()
    if isinstance(value, np.ndarray):
        return value.ravel().tolist()
    if isinstance(value, (list, tuple)):
        return [_plain(v) for v in value]
    return value
