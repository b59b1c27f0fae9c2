"""Graphs of blocks: nodes, wires, ports, evaluation order, dependencies, block files, TOML tables."""

from __future__ import annotations

from hystfmu.graph.graph import Graph
from hystfmu.graph.node import Node, Value
from hystfmu.graph.ports import ContinuousState, Input, Output, Port

__all__ = ["ContinuousState", "Graph", "Input", "Node", "Output", "Port", "Value"]
