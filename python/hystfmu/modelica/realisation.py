"""Realisations of an exported model: sampled, with events at reversals, smooth; and their classes."""

from __future__ import annotations

import functools
from dataclasses import dataclass

import numpy as np

from hystfmu.graph import Graph, Node
from hystfmu.modelica import classes
from hystfmu.modelica.classes import shipped_library

SAMPLED = "Sampled"  # the block Model of a package
IN_A_ROW = 8  # blocks with dynamics that Interfaces.InChain lets start one after the other
FACTOR = {"scaling": "gain", "sum": "k"}  # what the rate of a signal is multiplied by
CONTINUOUS = {"Events": "events at reversals", "Smooth": "an ordinary differential equation without events"}


@dataclass(frozen=True)
class Rate:
    """Rate of the input of an operator: a sum of rates of ports, each multiplied by the gains on its path.

    Attributes
    ----------
    terms : tuple of (str, tuple of (Node, int))
        Port, and the scalings and sums from the operator to this port, each with the index of the signal.
    """

    terms: tuple[tuple[str, tuple[tuple[Node, int], ...]], ...]

    @property
    def gain(self) -> float:
        """Largest change of the input if every port changes by 1."""
        return sum(float(np.prod([abs(n.value(FACTOR[n.type])[i - 1]) for n, i in way])) for _, way in self.terms)


def kinds(graph: Graph) -> list[str]:
    """Return the continuous realisations of a graph; empty if it has no sampled block."""
    if not any(classes.is_sampled(n) for n in graph.nodes):
        return []
    return [k for k in CONTINUOUS if k not in left_out(graph)]


def left_out(graph: Graph) -> dict[str, str]:
    """Return the missing continuous realisations of a graph with sampled blocks, with the reasons."""
    if not any(classes.is_sampled(n) for n in graph.nodes):
        return {}
    return {kind: why for kind in CONTINUOUS if (why := missing(graph, kind))}


def missing(graph: Graph, kind: str) -> str:
    """Return the reason why a graph has no realisation `kind`, or ""."""
    for node in graph.nodes:
        found = class_in(node, kind)
        if not found:
            return f"{node.name} ({node.type}) {_lacking(node, kind)}"
        if takes_rate(found) and rate_of(graph, node) is None:
            return f"the rate of the input of {node.name} ({node.type}) does not follow from ports; take Model"
    if kind == "Events" and sum(starts_in_chain(class_in(n, kind)) for n in graph.nodes) > IN_A_ROW:
        return f"more than {IN_A_ROW} blocks with dynamics stand in a row; take Smooth"
    return ""


def _lacking(node: Node, kind: str) -> str:
    """Return the end of a sentence: why a block has no class in a realisation, and the realisation to use."""
    other = next((k for k in CONTINUOUS if k != kind and class_in(node, k)), "")
    if other == "Smooth":
        return "has no closed form from one reversal to the next; take Smooth"
    if other == "Events":
        return "changes its branch at reversals and has no smooth form; take Events"
    if node.block.trial:
        return "solves an equation at each sample; take Model"
    return "goes from sample to sample and has no equation in continuous time; take Model"


def class_in(node: Node, kind: str) -> str:
    """Return the qualified name of the class of a node in the realisation `kind`, or ""."""
    sampled = classes.class_of(node)
    if kind == SAMPLED or not classes.is_sampled(node) or classes.is_large(node):
        return sampled
    if classes.is_discretised(node):
        return "HystFMU.Dynamics.TransferFunction"
    package, _, name = sampled.partition(".Sampled.")
    # what is an ordinary differential equation anyhow has no events
    order = (kind, "Smooth") if node.block.rate == "continuous" else (kind,)
    found = [f"{package}.{k}.{name}" for k in order if name and _text(f"{package}.{k}.{name}")]
    return found[0] if found else ""


def takes_rate(class_name: str) -> bool:
    """Return whether a class has an input for the rate of its input."""
    return "usesRate = true" in _text(class_name)


def has_reach(class_name: str) -> bool:
    """Return whether a class approximates a branch by a polygon whose length must be given."""
    return "parameter Real reach" in _text(class_name)


def starts_in_chain(class_name: str) -> bool:
    """Return whether a class can start after an operator with events in an export without loops."""
    return "extends Interfaces.InChain" in _text(class_name)


def rate_of(graph: Graph, node: Node) -> Rate | None:
    """Return the source of the rate of the first input of a node: ports, through scalings and sums."""
    terms = _terms(graph, {f"{node.name}.{node.block.of('input')[0].name}"})
    return None if terms is None else Rate(terms)


def _terms(graph: Graph, ends: set[str]) -> tuple[tuple[str, tuple[tuple[Node, int], ...]], ...] | None:
    """Return the terms of the rate of the source that is connected to one of the names of an input."""
    port = next((p.name for p in graph.inputs if ends & set(p.to)), None)
    if port is not None:
        size = next(p.size for p in graph.ports if p.name == port)
        return ((port, ()),) if size == 1 else None
    source = next((a for a, b in graph.wires if b in ends), None)
    before = graph.node(source.split(".")[0]) if source else None
    if source is None or before is None or before.type not in FACTOR:
        return None
    index = int(source.partition("[")[2].rstrip("]") or 1)
    if before.type == "scaling" and "[" not in source and before.sizes["y"] > 1:
        return None
    found: list[tuple[str, tuple[tuple[Node, int], ...]]] = []
    for k in range(1, before.sizes["u"] + 1) if before.type == "sum" else (index,):
        inner = _terms(graph, {f"{before.name}.u[{k}]"} | ({f"{before.name}.u"} if before.sizes["u"] == 1 else set()))
        if inner is None:
            return None
        found += [(port, ((before, k), *way)) for port, way in inner]
    return tuple(found)


@functools.cache
def _text(class_name: str) -> str:
    """Return the file of a class of the library; "" if there is no file."""
    file = shipped_library().joinpath(*class_name.split(".")).with_suffix(".mo")
    return file.read_text("utf-8") if file.is_file() else ""
