"""Descriptions of the ports of a fitted model, from the headings of the record."""

from __future__ import annotations

from dataclasses import replace

from hystfmu.data import Dataset
from hystfmu.graph import Graph

_LEAST = 2  # letters of a heading that says more than the name of the port


def with_texts(graph: Graph, data: Dataset) -> Graph:
    """Describe input and output by the headings of the record, else by its name."""
    inputs = [replace(graph.inputs[0], text=_text(data, 0, "input", data.unit_u)), *graph.inputs[1:]]
    outputs = [replace(graph.outputs[0], text=_text(data, 1, "output", data.unit_y)), *graph.outputs[1:]]
    return Graph(graph.nodes, graph.wires, inputs, outputs, sort=False, step=graph.step)


def _text(data: Dataset, k: int, port: str, unit: str) -> str:
    title = data.titles[k]
    what = title if len(title) >= _LEAST else f"{port} of the record {data.name}"
    return f"{what}, in {unit}" if unit else what
