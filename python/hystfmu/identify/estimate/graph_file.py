"""A graph with free parameters as a TOML file: the tables of a model file, and a table ``[free]``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Field

from hystfmu.base.errors import InputError
from hystfmu.base.files import check, check_format, load_toml
from hystfmu.graph import Graph
from hystfmu.graph.tables import GraphTable
from hystfmu.identify.estimate.free import Spec, read
from hystfmu.model.model import FORMAT


class _File(GraphTable):
    format: Literal[1]
    free: dict[str, Any] = Field(min_length=1, max_length=1000)
    # of a model file, to which [free] is added for another fit
    key: str = ""
    text: str = ""
    step: Annotated[float, Field(gt=0, allow_inf_nan=False)] | None = None
    fit: dict[str, Any] = Field({})
    provenance: dict[str, Any] = Field({})


def read_graph(path: Path) -> tuple[Graph, dict[str, Spec]]:
    """Read a graph and its free parameters from `path`; the blocks may stand in any order.

    Raises
    ------
    InputError
        One line with file, key, rule and value.
    """
    table = load_toml(path)
    check_format(table, FORMAT, path, required=True)
    found = check(table, _File, path)
    try:
        graph = found.graph()
        graph = Graph(graph.nodes, graph.wires, graph.inputs, graph.outputs)
        read(graph, found.free)
    except InputError as e:
        raise InputError(f"{path}: {e}") from None
    return graph, found.free
