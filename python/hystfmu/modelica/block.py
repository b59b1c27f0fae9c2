"""Block of one realisation of an exported model: library components, connections, and parameters from the record."""

from dataclasses import replace

from hystfmu.base import InputError, escape
from hystfmu.graph import Graph, Node
from hystfmu.model import Model
from hystfmu.modelica import classes, implicit
from hystfmu.modelica.classes import DEPTH, lacks
from hystfmu.modelica.layout import placed, spots
from hystfmu.modelica.literals import class_text, link, number, string
from hystfmu.modelica.ports import names, rate_declarations
from hystfmu.modelica.realisation import (
    CONTINUOUS,
    SAMPLED,
    class_in,
    has_reach,
    kinds,
    rate_of,
    starts_in_chain,
    takes_rate,
)
from hystfmu.modelica.record import TEXTS, field, span, step
from hystfmu.modelica.wiring import Wiring, inlined_before_samples


def wiring(graph: Graph, taken: set[str]) -> Wiring:
    """Return names and positions of the components and ports in the realisations of a graph.

    Raises
    ------
    InputError
        The graph has a loop, or Modelica does not allow the name of a port.
    """
    wires = [w for w in implicit.wires(graph) if w[1].split(".")[0] not in implicit.hidden(graph)]
    _refuse_loops(graph, wires)
    ports, parts = names(graph, taken, rated_ports(graph))
    return Wiring(graph, ports, parts, spots([n.name for n in _shown(graph)], wires))


def block(model: Model, name: str, within: str, w: Wiring, history: str = "", kind: str = SAMPLED) -> str:
    """Return the text of the Modelica file of the block, without its first line (the mark of an exported file).

    Parameters
    ----------
    model : Model
    name, within : str
        Name of the block, and name of its package. The package contains the partial block Ports.
    w : Wiring
        Wiring of the graph of the model.
    history : str
        Fit quality and provenance as HTML.
    kind : str
        Realisation.

    Raises
    ------
    InputError
        The library has no class for a block.
    """
    graph = model.graph
    inverses = {n.name: implicit.tried(graph, n, within) for n in implicit.inverses(graph)}
    nodes = _shown(graph)
    sampled = kind == SAMPLED and any(classes.is_sampled(n) for n in graph.nodes)
    tied = kind == SAMPLED and any(classes.is_tied(n) for n in graph.nodes)
    rates = {n.name: r for n in nodes if kind != SAMPLED and takes_rate(class_in(n, kind)) and (r := rate_of(graph, n))}
    text = model.text or model.key
    text = text if kind == SAMPLED else f"{text}: {CONTINUOUS[kind]}"
    lines = [f"  extends Ports{'(final usesRate = true)' if rates else ''};"]
    if sampled:
        lines.append("  extends HystFMU.Interfaces.Sampled(Ts = values.Ts);")
    if kind == SAMPLED:
        w = replace(w, inlined=inlined_before_samples(graph) - implicit.hidden(graph))
    sums = [w.inline(name) for name in sorted(w.inlined)]
    nodes = [n for n in nodes if n.name not in w.inlined]
    lines += [
        f"  {_declaration(model, n, w.parts[n.name], inverses.get(n.name), kind)} "
        f"annotation ({placed(*w.where.of[n.name])});"
        for n in nodes
    ]
    declared, stated = rate_declarations(w, rates)
    declared += [d for d, _ in sums]
    lines += [*(["protected"] if declared else []), *declared, "equation", *stated, *(e for _, e in sums)]
    if tied:
        lines.append(_refusal(step(model)))
    for i, p in enumerate(graph.inputs):
        lines += w.from_port(p, i)
    apart = implicit.hidden(graph) | w.inlined
    lines += [w.between(a, b) for a, b in implicit.wires(graph) if b.split(".")[0] not in apart]
    lines += [w.to_port(o, i) for i, o in enumerate(graph.outputs)]
    lines += w.unconnected(nodes)
    documentation = _documentation(model, sampled, tied, kind, history) + _links(nodes, within, kind) + "</html>"
    return class_text(f"block {name}", text, lines, string(documentation), within)


def rated_ports(graph: Graph) -> list[str]:
    """Return the names of the inputs of a graph whose rates its continuous realisations need."""
    found = {
        port
        for kind in kinds(graph)
        for node in graph.nodes
        if takes_rate(class_in(node, kind)) and (rate := rate_of(graph, node))
        for port, _ in rate.terms
    }
    return [p.name for p in graph.inputs if p.name in found]


def _shown(graph: Graph) -> list[Node]:
    hidden = implicit.hidden(graph)
    return [n for n in graph.nodes if n.name not in hidden]


def _declaration(model: Model, node: Node, name: str, inverse: implicit.Tried | None, kind: str) -> str:
    graph = model.graph
    if classes.is_large(node):
        return f"{classes.network_names(node)[1]} {name}"
    discrete = kind == SAMPLED and classes.is_discretised(node)
    keys = ["n", *TEXTS] if discrete else [*classes.dims(node), *classes.values(node)]
    given = [f"{k} = values.{field(graph, node, k)}" for k in keys]
    if inverse is not None:
        given = [f"redeclare package Model = {inverse.package}", *given]
        given += [f"values = {inverse.values}", f"state0 = {inverse.state0}"]
    if not discrete:  # the matrices of a discretised block already contain the choices
        without = lacks(node.block, node.block.class_name) if classes.is_discretised(node) else frozenset()
        given += [f"{k} = {w}" for k, w in classes.choices(node).items() if k not in without]
    if kind == SAMPLED and classes.is_sampled(node):
        given.append("Ts = Ts")
    if kind == "Events" and starts_in_chain(class_in(node, kind)):
        given.append("inChain = true")  # this holds because the export refuses loops
    if has_reach(class_in(node, kind)) and (reach := _reach(model, node)):
        given.append(f"reach = {number(reach)}")
    return f"{class_in(node, kind)} {name}({', '.join(given)})"


def _refusal(h: float) -> str:
    """Return the assertion that the sample period is `h` (s). Matrices and lags are valid for this period only."""
    message = (
        f"Ts must be {number(h)} s, for which the dynamics and lags are computed: export a model with another step"
    )
    return f"  assert(abs(Ts - {number(h)}) <= {number(1e-9 * h)}, {string(message)});"


def _reach(model: Model, node: Node) -> float:
    """Return the length of the longest branch within the range of the identification data; 0 if unknown."""
    rate, known = rate_of(model.graph, node), span(model)
    if rate is None or known is None:
        return 0.0
    reach = (known[1] - known[0]) * rate.gain
    ends = [float(node.value("d_max")[0])] if node.block.parameter("d_max") else []
    return min([reach, *ends])  # a branch ends at d_max


def _refuse_loops(graph: Graph, wires: list[tuple[str, str]]) -> None:
    """Raise an error for a wire to an earlier block.

    Such a wire delays by one step, which the library does not support.
    """
    order = [n.name for n in graph.nodes]
    for a, b in wires:
        if order.index(a.split(".")[0]) >= order.index(b.split(".")[0]):
            raise InputError(f"the wire {a} -> {b} leads back to an earlier block: the Modelica export has no loops")


def _documentation(model: Model, sampled: bool, tied: bool, kind: str, history: str) -> str:
    equations = "".join(
        f"<p><b>Equation</b> of {escape(n.name)}: {escape(n.block.equation)}. "
        f"<b>Source:</b> {escape(n.block.source)}.</p>"
        for n in model.graph.nodes
    )
    rows = "the rows of <code>hystfmu predict</code>"
    limits = [
        f"at the start and then every Ts the output equals {rows}, for rows Ts apart"
        if sampled
        else f"it gives {rows}"
        if kind == SAMPLED
        else f"{CONTINUOUS[kind]}; dynamics are continuous, in Model they are discretised",
        "valid within the range of the identification data",
    ]
    if tied:
        limits.append("the dynamics and lags are valid for this Ts only, and another Ts is refused")
    continuous = [
        n.name for n in model.graph.nodes if n.block.rate == "continuous" and n.block.tolerance == "integration"
    ]
    if continuous:
        whose = "the solver determines the accuracy; the unit has an integration rule of its own"
        limits.append(f"continuous ({', '.join(continuous)}): {whose}")
    deep = [f"{n.name}: {n.dims['depth']}" for n in model.graph.nodes if n.dims.get("depth", 0) > DEPTH]
    if deep:
        limits.append(
            f"an operator stores {DEPTH} extrema, so that a step is fast; the model file has more "
            f"({', '.join(deep)}): set the depth in values"
        )
    return (
        f"<html><p>A model of kind <em>{escape(model.key)}</em>: {escape(model.text)}.</p>{equations}{history}"
        f"<p><b>Limitations:</b> {'; '.join(limits)}.</p>"
    )


def _links(nodes: list[Node], within: str, kind: str) -> str:
    """Return links to the Example of the package and to the classes of the components."""
    made_of = {f"{within}.{classes.network_names(n)[1]}" if classes.is_large(n) else class_in(n, kind) for n in nodes}
    example, *see = map(link, (f"{within}.Example", *sorted(made_of)))
    return f"<p><b>Example:</b> {example}.</p><p><b>See also:</b> {', '.join(see)}.</p>"
