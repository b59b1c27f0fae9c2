"""Graphs of blocks: nodes, wires, ports, order of evaluation, dependencies of outputs, block files, TOML tables."""

from hystfmu.graph.graph import Graph
from hystfmu.graph.node import ContinuousState, Input, Node, Output, Port, Value

__all__ = ["ContinuousState", "Graph", "Input", "Node", "Output", "Port", "Value"]
