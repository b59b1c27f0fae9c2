"""A model: a graph of blocks with values, where they came from, and how well they fit; `*.model.toml` on disk."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

import numpy as np
import pydantic

from hystfmu.core import Array
from hystfmu.errors import InputError
from hystfmu.files import read_toml, write_toml
from hystfmu.graph import Graph, Input, Node, Output

_Strict = pydantic.ConfigDict(extra="forbid", strict=True)
_Number = float | int


class _Block(pydantic.BaseModel):
    model_config = _Strict
    name: str
    type: str
    dims: dict[str, int] = {}
    values: dict[str, bool | _Number | str | list[_Number]] = {}


class _Input(pydantic.BaseModel):
    model_config = _Strict
    name: str
    to: list[str]
    unit: str = ""
    start: _Number = 0.0
    text: str = ""


class _Output(pydantic.BaseModel):
    model_config = _Strict
    name: str
    source: str
    unit: str = ""
    text: str = ""


class _File(pydantic.BaseModel):
    model_config = _Strict
    format: Literal[1]
    key: str
    text: str = ""
    step: _Number | None = None
    blocks: list[_Block]
    wires: list[tuple[str, str] | list[str]] = []
    inputs: list[_Input] = []
    outputs: list[_Output] = []
    fit: dict[str, Any] = {}
    provenance: dict[str, Any] = {}


@dataclass(frozen=True)
class Model:
    """A graph with its history: the only thing that `fit`, `inverse`, `export` and scenarios hand to each other.

    Parameters
    ----------
    key : str
        What kind of model it is, e.g. ``"zhao_tan_mlp"``.
    graph : Graph
        The blocks in the order of evaluation, with all values (normalisation included).
    step : float or None
        Sample step of the identification in seconds; None for a model that has none.
    text : str
        One line for a reader.
    fit : dict
        Numbers of the identification, e.g. ``{"rms_percent": 0.7, "parameters": 49}``.
    provenance : dict
        Data file, rows, options, versions.
    """

    key: str
    graph: Graph
    step: float | None = None
    text: str = ""
    fit: dict[str, Any] = field(default_factory=dict)
    provenance: dict[str, Any] = field(default_factory=dict)

    def predict(self, u: Array | Sequence[float], h: float | None = None) -> Array:
        """Free-run output for the input rows `u`, from a fresh start.

        Row 0 is the output after initialisation with ``u[0]``; row k is what an FMU gives after set u_k,
        doStep(t_{k-1}, h), get y.  `h` (s) defaults to the model's own step, else 1 s.
        """
        return self.graph.run(u, h if h is not None else self.step if self.step is not None else 1.0)

    def save(self, path: str | Path) -> None:
        """Write ``*.model.toml``."""
        data: dict[str, Any] = {"format": 1, "key": self.key, "text": self.text}
        if self.step is not None:
            data["step"] = float(self.step)
        g = self.graph
        data["fit"], data["provenance"] = self.fit, self.provenance
        data["wires"] = [list(w) for w in g.wires]
        data["inputs"] = [
            {"name": i.name, "to": list(i.to), "unit": i.unit, "start": float(i.start), "text": i.text}
            for i in g.inputs
        ]
        data["outputs"] = [{"name": o.name, "source": o.source, "unit": o.unit, "text": o.text} for o in g.outputs]
        data["blocks"] = [_block_table(n) for n in g.nodes]
        write_toml(path, data, f"HystFMU model '{self.key}': blocks in the order of their evaluation.")

    @classmethod
    def load(cls, path: str | Path) -> Model:
        """Read ``*.model.toml``.

        Raises
        ------
        InputError
            One line with the file, the key, the rule and the value.
        """
        f = read_toml(path, _File)
        try:
            nodes = [Node(b.name, b.type, b.dims, b.values) for b in f.blocks]
            inputs = [Input(i.name, tuple(i.to), i.unit, float(i.start), i.text) for i in f.inputs]
            outputs = [Output(o.name, o.source, o.unit, o.text) for o in f.outputs]
            for w in f.wires:
                if len(w) != 2:
                    raise InputError(f"wires: a connection has two ends; got {list(w)}")
            graph = Graph(nodes, [(w[0], w[1]) for w in f.wires], inputs, outputs, sort=False)
        except InputError as e:
            raise InputError(f"{path}: {e}") from None
        step = None if f.step is None else float(f.step)
        if step is not None and not (np.isfinite(step) and step > 0):
            raise InputError(f"{path}: step: must be a finite number greater than 0; got {step}")
        return cls(f.key, graph, step, f.text, f.fit, f.provenance)


def _block_table(n: Node) -> dict[str, Any]:
    values: dict[str, Any] = {}
    for v in n.block.parameters:
        flat = n.value(v.name)
        plain = [_plain(x, v.type, v.choices) for x in flat]
        values[v.name] = plain[0] if n.sizes[v.name] == 1 and v.size == "1" else plain
    return {"name": n.name, "type": n.type, "dims": dict(n.dims), "values": values}


def _plain(x: float, kind: str, choices: tuple[str, ...]) -> float | int | bool | str:
    if choices:
        return choices[int(x)]
    return float(x) if kind == "real" else bool(x) if kind == "bool" else int(x)
