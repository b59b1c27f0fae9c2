"""Data of a model for the explorer of an HTML page: block files, adjustable values, and states of the memory."""

from collections.abc import Mapping, Sequence

from hystfmu.base import InputError, with_unit
from hystfmu.graph import Graph, Port
from hystfmu.graph.node import element_names
from hystfmu.model import Model
from hystfmu.model.coverage import COVARIATES, KEY, span_of
from hystfmu.report.explorer import Driven, Explored, Memory, Slider

TURNS = "HYST_TURNING_POINTS(depth)"  # size of a list of turning points in the table of a block
PLAYS, WIDTHS = "play states", "r"  # description of the states of plays, and name of the parameter of half-widths
MOST_STATES = 6  # maximum number of states that the explorer shows as numbers
HUGE = 1e300  # smallest value that means "no limit", see limit.h


def explored(model: Model, name: str, inverse: Model | None = None) -> Explored:
    """Return the data that the explorer needs to run a model.

    Parameters
    ----------
    model : Model
        Model with one output. A covariate stays at its start value until the reader of the page changes it.
    name : str
        Name in the legend.
    inverse : Model, optional
        Inverse of the model.

    Raises
    ------
    InputError
        The provenance of the model does not contain the range of the input.
    """
    span = span_of(model)
    if span is None:
        raise InputError(f"The provenance of {model.key} must state {KEY} = [least, largest] input. Got none.")
    beside, h = model.provenance.get(COVARIATES, {}), model.step if model.step is not None else 1.0
    before = None if inverse is None else inverse.graph
    return explored_graph(model.graph, name, before, h, span, beside)


def explored_graph(
    graph: Graph,
    name: str,
    inverse: Graph | None,
    h: float,
    span: tuple[float, float],
    beside: Mapping[str, Sequence[float]] | None = None,
) -> Explored:
    """Return the data that the explorer needs to run a graph.

    Parameters
    ----------
    graph : Graph
        Graph with one output.
    name : str
        Name in the legend.
    inverse : Graph or None
        Inverse of the graph.
    h : float
        Step (s).
    span : (float, float)
        Range of the first input.
    beside : dict of str to (float, float), optional
        Ranges of the covariates. The slider of a covariate without a range covers its start value plus and minus 1.
    """
    sliders = [_covariate(p, (beside or {}).get(p.name)) for p in graph.ports if p.kind == "input"][1:]
    sliders += [_parameter(p) for p in graph.ports if p.is_parameter and _moves(p)]
    before = None if inverse is None else _driven(inverse)
    return Explored(name, _driven(graph), before, h, *span, sliders, _memory(graph))


def _driven(graph: Graph) -> Driven:
    first = {kind: next(p.reference for p in graph.ports if p.kind == kind) for kind in ("input", "output")}
    return Driven(graph.to_bytes(), first["input"], first["output"])


def _covariate(p: Port, span: Sequence[float] | None) -> Slider:
    start = float(p.start[0])
    lo, hi = span if span else (start - 1, start + 1)
    return Slider(with_unit(p.name, p.unit), p.reference, 1, float(lo), float(hi))


def _moves(p: Port) -> bool:
    """Return whether a slider can scale a parameter: its values are real, not all 0, and do not mean "no limit"."""
    values = [abs(float(v)) for v in p.start]
    return p.var.type == "real" and max(values, default=0.0) > 0 and max(values) < HUGE


def _parameter(p: Port) -> Slider:
    return Slider(with_unit(p.name, p.unit), p.reference, p.size)


def _memory(graph: Graph) -> Memory | None:
    """Return the states that the explorer shows: turning points; without these, plays; without both, other states."""
    found: dict[str, Memory] = {}
    for k, node in enumerate(graph.nodes):
        place, named = 0, []
        for v in node.block.of("cstate", "state"):
            size = node.sizes[v.name]
            if v.size == TURNS:
                found.setdefault("turns", Memory(node.name, "turns", k, place))
            elif v.text == PLAYS:
                widths = next(p for p in graph.ports if p.is_parameter and (p.node, p.var.name) == (k, WIDTHS))
                found.setdefault("plays", Memory(node.name, "plays", k, place, widths.reference, widths.size))
            else:
                named += [f"{node.name}.{n}: {v.text}" for n in element_names(v.name, size)]
            place += size
        if named and "states" not in found and node.block.family == "operators":
            found["states"] = Memory(node.name, "states", k, 0, names=tuple(named[:MOST_STATES]))
    return next((found[kind] for kind in ("turns", "plays", "states") if kind in found), None)
