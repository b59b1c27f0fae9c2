"""Conversion of a graph to TOML tables and back. Model files and scenarios contain these tables."""

from typing import Annotated, Any

import pydantic
from pydantic import Field

from hystfmu.graph.graph import Graph
from hystfmu.graph.node import Input, Node, Output

STRICT = pydantic.ConfigDict(extra="forbid", strict=True, frozen=True)
Name = Annotated[str, Field(pattern=r"^[A-Za-z][A-Za-z0-9_]*$", max_length=64)]
TwoNames = Annotated[list[str], Field(min_length=2, max_length=2)]
Number = Annotated[float, Field(allow_inf_nan=False)]
Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
NotNegative = Annotated[float, Field(ge=0, allow_inf_nan=False)]
Share = Annotated[float, Field(ge=0, le=1)]
Bounds = Annotated[list[Number], Field(min_length=2, max_length=2)]
Value = bool | int | float | str | list[bool | int | float]


class BlockTable(pydantic.BaseModel):
    """TOML table of one block."""

    model_config = STRICT
    name: Name
    type: str
    dims: dict[str, int] = {}
    values: dict[str, Value] = {}


class InputTable(pydantic.BaseModel):
    """TOML table of one input of a graph."""

    model_config = STRICT
    name: Name
    to: list[str]
    unit: str = ""
    start: Number = 0.0
    text: str = ""


class OutputTable(pydantic.BaseModel):
    """TOML table of one output of a graph."""

    model_config = STRICT
    name: Name
    source: str
    unit: str = ""
    text: str = ""


class GraphTable(pydantic.BaseModel):
    """TOML tables of a graph: blocks in the order of evaluation, wires, inputs and outputs."""

    model_config = STRICT
    blocks: list[BlockTable] = Field(min_length=1, max_length=1000)
    wires: list[TwoNames] = []
    inputs: list[InputTable] = []
    outputs: list[OutputTable] = []

    def graph(self) -> Graph:
        """Return the graph that the tables describe.

        Raises
        ------
        InputError
            `Graph` refuses the tables.
        """
        nodes = [Node(b.name, b.type, b.dims, b.values) for b in self.blocks]
        inputs = [Input(i.name, tuple(i.to), i.unit, i.start, i.text) for i in self.inputs]
        outputs = [Output(o.name, o.source, o.unit, o.text) for o in self.outputs]
        return Graph(nodes, [(a, b) for a, b in self.wires], inputs, outputs, sort=False)


def graph_tables(g: Graph) -> dict[str, Any]:
    """Return the TOML tables of a graph with all parameter values, without empty texts and empty units of measure."""
    inputs = [
        {"name": i.name, "to": list(i.to), "unit": i.unit, "start": float(i.start), "text": i.text} for i in g.inputs
    ]
    outputs = [{"name": o.name, "source": o.source, "unit": o.unit, "text": o.text} for o in g.outputs]
    blocks = [{"name": n.name, "type": n.type, "dims": dict(n.dims), "values": _values(n)} for n in g.nodes]
    ports: dict[str, list[dict[str, Any]]] = {"inputs": inputs, "outputs": outputs}
    told = {key: [{k: v for k, v in port.items() if v != ""} for port in found] for key, found in ports.items()}
    return {"wires": [list(w) for w in g.wires], **told, "blocks": blocks}


def _values(n: Node) -> dict[str, Any]:
    values: dict[str, Any] = {}
    for v in n.block.parameters:
        plain = [_plain(x, v.type, v.choices) for x in n.value(v.name)]
        values[v.name] = plain[0] if v.size == "1" else plain
    return values


def _plain(x: float, kind: str, choices: tuple[str, ...]) -> float | int | bool | str:
    if choices:
        return choices[int(x)]
    return float(x) if kind == "real" else bool(x) if kind == "bool" else int(x)
