"""Conversion of the graph of an identified model to one class for the slot of an actuator, in volts and metres."""

from __future__ import annotations

from hystfmu.graph import Graph
from hystfmu.modelica import classes
from hystfmu.modelica.actuator.chain import chain
from hystfmu.modelica.actuator.magnetic import magnetic
from hystfmu.modelica.actuator.networks import network
from hystfmu.modelica.actuator.operators import operator
from hystfmu.modelica.actuator.parallel import bouc_wen, preisach
from hystfmu.modelica.actuator.slot import Slot
from hystfmu.modelica.actuator.temperature import warm

LINEAR = ("transfer_function", "delay")  # what the mechanics stand for


def fold(graph: Graph, h: float) -> Slot | None:
    """Return the slot of a model, or None if the library has no class for the model.

    Parameters
    ----------
    graph : Graph
        Graph of an identified model.
    h : float
        Step of the model (s).
    """
    beside = preisach(graph, h) or bouc_wen(graph, h)
    return beside or next((found for of in (warm, chain, operator, magnetic, network) if (found := of(graph))), None)


def why_not(graph: Graph) -> str:
    """Return the reason why a graph has no slot, as the end of a sentence."""
    for n in graph.nodes:
        if n.block.family != "operators" and n.type not in LINEAR and n.block.of("state"):
            return f"the slot takes only static models, but the block {n.type} has dynamics"
        if any(v.name == "memory" for v in n.block.parameters) and classes.word(n, "memory") == "last":
            return f"{n.type} with memory = last drifts, so that HystFMU.Actuators.Hysteresis has no class for it"
    return "HystFMU.Actuators.Hysteresis has no class for these blocks: " + ", ".join(n.type for n in graph.nodes)
