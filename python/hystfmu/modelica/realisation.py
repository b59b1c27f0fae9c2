"""Realisations of an exported model (sampled, with events at reversals, smooth) and the classes of their components."""

import functools
from dataclasses import dataclass

import numpy as np

from hystfmu.graph import Graph, Node
from hystfmu.modelica import classes
from hystfmu.modelica.classes import shipped_library

SAMPLED = "Sampled"  # the block Model of a package
IN_A_ROW = (
    8  # largest number of blocks with dynamics in series that Interfaces.InChain can initialise one after the other
)
FACTOR = {"scaling": "gain", "sum": "k"}  # parameter by which these blocks multiply the rate of a signal
CONTINUOUS = {"Events": "events at reversals", "Smooth": "an ordinary differential equation without events"}


@dataclass(frozen=True)
class Rate:
    """Time derivative (rate) of the input of an operator, as a sum of rates of ports.

    Each rate of a port is multiplied by the gains on the path from the port to the operator.

    Attributes
    ----------
    terms : tuple of (str, tuple of (Node, int))
        Name of a port, and the scalings and sums on the path from the operator to this port. Each scaling or sum is
        paired with the index of the input on this path.
    """

    terms: tuple[tuple[str, tuple[tuple[Node, int], ...]], ...]

    @property
    def gain(self) -> float:
        """Largest change of the input of the operator if every port changes by 1."""
        return sum(float(np.prod([abs(n.value(FACTOR[n.type])[i - 1]) for n, i in way])) for _, way in self.terms)


def kinds(graph: Graph) -> list[str]:
    """Return the names of the continuous realisations of a graph; empty if the graph has no sampled block."""
    if not any(classes.is_sampled(n) for n in graph.nodes):
        return []
    return [k for k in CONTINUOUS if k not in left_out(graph)]


def left_out(graph: Graph) -> dict[str, str]:
    """Return the reason for each missing continuous realisation of a graph; empty if the graph has no sampled block."""
    if not any(classes.is_sampled(n) for n in graph.nodes):
        return {}
    return {kind: why for kind in CONTINUOUS if (why := missing(graph, kind))}


def missing(graph: Graph, kind: str) -> str:
    """Return the reason why a graph has no realisation `kind`; "" if it has this realisation."""
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
    """Return the reason why a block has no class in the realisation `kind`, and the realisation to use instead.

    The text is the end of a sentence.
    """
    other = next((k for k in CONTINUOUS if k != kind and class_in(node, k)), "")
    if other == "Smooth":
        return "has no closed form from one reversal to the next; take Smooth"
    if other == "Events":
        return "changes its branch at reversals and has no smooth form; take Events"
    if node.block.trial:
        return "solves an equation at each sample; take Model"
    return "goes from sample to sample and has no equation in continuous time; take Model"


def class_in(node: Node, kind: str) -> str:
    """Return the qualified name of the class of a node in the realisation `kind`; "" if there is no such class."""
    sampled = classes.class_of(node)
    if kind == SAMPLED or not classes.is_sampled(node) or classes.is_large(node):
        return sampled
    if classes.is_discretised(node):
        return "HystFMU.Dynamics.TransferFunction"
    package, _, name = sampled.partition(".Sampled.")
    # a block that is an ordinary differential equation has only a Smooth class, also in the realisation Events
    order = (kind, "Smooth") if node.block.rate == "continuous" else (kind,)
    found = [f"{package}.{k}.{name}" for k in order if name and _text(f"{package}.{k}.{name}")]
    return found[0] if found else ""


def takes_rate(class_name: str) -> bool:
    """Return whether a class has an additional input for the time derivative of its input."""
    return "usesRate = true" in _text(class_name)


def has_reach(class_name: str) -> bool:
    """Return whether a class approximates a branch by a polygon and needs the length of the branch as a parameter."""
    return "parameter Real reach" in _text(class_name)


def starts_in_chain(class_name: str) -> bool:
    """Return whether a class can be initialised in series with other operators that have events."""
    return "extends Interfaces.InChain" in _text(class_name)


def rate_of(graph: Graph, node: Node) -> Rate | None:
    """Return the time derivative of the first input of a node as a sum of rates of ports.

    The result is None if the derivative is not such a sum, for example with a filter between a port and the node.
    """
    terms = _terms(graph, {f"{node.name}.{node.block.of('input')[0].name}"})
    return None if terms is None else Rate(terms)


def _terms(graph: Graph, ends: set[str]) -> tuple[tuple[str, tuple[tuple[Node, int], ...]], ...] | None:
    """Return the terms of the rate of an input, see `Rate`. `ends` contains all names of this input in wires."""
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
    """Return the text of the file of a library class; "" if there is no such file."""
    file = shipped_library().joinpath(*class_name.split(".")).with_suffix(".mo")
    return file.read_text("utf-8") if file.is_file() else ""
