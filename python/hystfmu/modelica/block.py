"""The ready block: components of the library, wired as the graph, with the values of the record."""

from __future__ import annotations

import re
from html import escape

from hystfmu.base.errors import InputError
from hystfmu.core.library import Var
from hystfmu.graph import Graph, Input, Node, Output
from hystfmu.model import Model
from hystfmu.modelica import classes, implicit, network
from hystfmu.modelica.layout import Point, Spots, line, on_component, placed, port_at, port_placed, spots
from hystfmu.modelica.literals import NAME, number, sentence, string, unique
from hystfmu.modelica.places import DEPTH
from hystfmu.modelica.record import field
from hystfmu.modelica.state_space import TEXTS

_END = re.compile(r"(\w+)\.(\w+)(?:\[(\d+)\])?\Z")


def block(model: Model, name: str, within: str, record_name: str, history: str = "") -> str:
    """The file of the block, without its mark.

    Parameters
    ----------
    model : Model
    name, within, record_name : str
        Name of the block, of its package and of the record there.
    history : str
        Fit quality and provenance as HTML.

    Raises
    ------
    InputError
        The library has no class for a block, the graph has a loop, or a port a name that Modelica does not take.
    """
    graph = model.graph
    inverses = {n.name: implicit.tried(graph, n, within) for n in implicit.inverses(graph)}
    hidden = implicit.hidden(graph)
    nodes = [n for n in graph.nodes if n.name not in hidden]
    wires = [w for w in implicit.wires(graph) if w[1].split(".")[0] not in hidden]
    _refuse_loops(graph, wires)
    ports, parts = names(graph, {name, record_name})
    where = spots([n.name for n in nodes], wires)
    body = [
        f'  parameter {record_name} values "Values of the model" '
        f'annotation (Dialog(group = "Parameters"), {placed(*where.corner)});'
    ]
    for i, p in enumerate(graph.inputs):
        body.append(_port("Input", p, ports[p.name] + _shape(graph, p.to[0]), i, len(graph.inputs), where.edge))
    for i, o in enumerate(graph.outputs):
        body.append(_port("Output", o, ports[o.name] + _shape(graph, o.source), i, len(graph.outputs), where.edge))
    body += [
        f"  {_declaration(graph, n, parts[n.name], inverses.get(n.name))} annotation ({placed(*where.of[n.name])});"
        for n in nodes
    ]
    body.append("equation")
    for i, p in enumerate(graph.inputs):
        at = port_at(True, i, len(graph.inputs), where.edge)
        body += [_from_port(ports[p.name], _end(graph, b, parts), line(at, _point(graph, b, where))) for b in p.to]
    for a, b in wires:
        drawn = line(_point(graph, a, where), _point(graph, b, where))
        body.append(f"  connect({_end(graph, a, parts)}, {_end(graph, b, parts)}) {drawn};")
    for i, o in enumerate(graph.outputs):
        drawn = line(_point(graph, o.source, where), port_at(False, i, len(graph.outputs), where.edge))
        body.append(f"  connect({_end(graph, o.source, parts)}, {ports[o.name]}) {drawn};")
    body += _unconnected(graph, nodes, parts)
    sampled = any(classes.is_sampled(n) for n in graph.nodes)
    tied = any(classes.is_discretised(n) for n in graph.nodes)
    head = [
        f"within {within};",
        f"block {name} {sentence(model.text or model.key)}",
        "  extends HystFMU.Icons.Hysteresis;",
    ]
    if sampled:
        head.append(f"  extends HystFMU.Interfaces.Sampled({'final ' if tied else ''}Ts = values.Ts);")
    documentation = string(_documentation(model, sampled, tied, history) + _links(nodes, within) + "</html>")
    return "\n".join([*head, *body, f"  annotation (Documentation(info = {documentation}));", f"end {name};\n"])


def names(graph: Graph, taken: set[str]) -> tuple[dict[str, str], dict[str, str]]:
    """Names of the ports and components in the block, by their names in the graph.

    Raises
    ------
    InputError
        A port has a name that is none in Modelica.
    """
    outside = [*(p.name for p in graph.inputs), *(p.name for p in graph.outputs)]
    for p in outside:
        if not NAME.match(p):
            raise InputError(f"the port {p!r}: a name in Modelica is a letter followed by letters, digits or _")
    own = {"Ts", "values", *taken}
    ports = unique(outside, own)
    return ports, unique([n.name for n in graph.nodes], own | set(ports.values()))


def _port(kind: str, p: Input | Output, declared: str, i: int, n: int, edge: int) -> str:
    text = f"{p.text or kind}{f' ({p.unit})' if p.unit else ''}"  # a user's unit of measure need not be one of Modelica
    where = port_placed(kind == "Input", i, n, edge)
    return f"  HystFMU.Interfaces.Real{kind} {declared} {sentence(text)} annotation ({where});"


def _declaration(graph: Graph, node: Node, name: str, inverse: implicit.Tried | None) -> str:
    if classes.is_large(node):
        return f"{network.names(node)[1]} {name}"
    discrete = classes.is_discretised(node)
    keys = ["n", *TEXTS] if discrete else [*classes.dims(node), *classes.values(node)]
    given = [f"{k} = values.{field(graph, node, k)}" for k in keys]
    if inverse is not None:
        given = [f"redeclare package Model = {inverse.package}", *given]
        given += [f"values = {inverse.values}", f"state0 = {inverse.state0}"]
    if not discrete:  # else the choices are in the matrices
        given += [f"{k} = {w}" for k, w in classes.choices(node).items()]
    if classes.is_sampled(node):
        given.append("Ts = Ts")
    return f"{classes.class_of(node)} {name}({', '.join(given)})"


def _row(graph: Graph, end: str) -> tuple[Node, Var, str | None]:
    m = _END.match(end)
    assert m is not None  # the graph has resolved it
    node = graph.node(m[1])
    return node, next(v for v in node.block.of("input", "output") if v.name == m[2]), m[3]


def _end(graph: Graph, end: str, parts: dict[str, str]) -> str:
    """An end of a wire. A vector of one element is connected by that element, since the other end may be a scalar."""
    node, v, index = _row(graph, end)
    if index is None and v.size != "1" and node.sizes[v.name] == 1:
        index = "1"
    return f"{parts[node.name]}.{v.name}" + (f"[{index}]" if index and v.size != "1" else "")


def _point(graph: Graph, end: str, where: Spots) -> Point:
    """Where an end of a wire stands in the diagram."""
    node, v, _ = _row(graph, end)
    rows = node.block.of(v.kind)
    return on_component(port_at(v.kind == "input", rows.index(v), len(rows)), where.of[node.name])


def _from_port(port: str, end: str, drawn: str) -> str:
    """A port and an element of a vector are made equal instead of connected.

    rumoca 0.10.2 takes an array as a whole: connected, the port would seem to depend on what drives the other elements.
    """
    return f"  {end} = {port};" if end.endswith("]") else f"  connect({port}, {end}) {drawn};"


def _shape(graph: Graph, end: str) -> str:
    node, v, index = _row(graph, end)
    size = node.sizes[v.name]
    return f"[{size}]" if index is None and size > 1 else ""


def _unconnected(graph: Graph, nodes: list[Node], parts: dict[str, str]) -> list[str]:
    """Equations that hold unconnected inputs at their start values."""
    driven = {b for _, b in graph.wires} | {b for p in graph.inputs for b in p.to}
    found = []
    for node in nodes:
        for v in node.block.of("input"):
            ends = [f"{v.name}[{k + 1}]" for k in range(node.sizes[v.name])]
            if f"{node.name}.{v.name}" in driven:
                continue
            for end in ends:
                if f"{node.name}.{end}" not in driven:
                    found.append(f"  {parts[node.name]}.{v.name if v.size == '1' else end} = {number(v.start)};")
    return found


def _refuse_loops(graph: Graph, wires: list[tuple[str, str]]) -> None:
    """Refuse a wire to an earlier block: it delays by one step, which no class of the library does."""
    order = [n.name for n in graph.nodes]
    for a, b in wires:
        if order.index(a.split(".")[0]) >= order.index(b.split(".")[0]):
            raise InputError(f"the wire {a} -> {b} leads back to an earlier block: the Modelica export has no loops")


def _documentation(model: Model, sampled: bool, tied: bool, history: str) -> str:
    equations = "".join(
        f"<p><b>Equation</b> of {escape(n.name)}: {escape(n.block.equation)}. "
        f"<b>Source:</b> {escape(n.block.source)}.</p>"
        for n in model.graph.nodes
    )
    rows = "what <code>hystfmu predict</code> gives row by row"
    limits = [
        f"at 0, Ts, 2 Ts, ... it gives {rows}, for rows Ts apart; the simulation must start at time 0"
        if sampled
        else f"it gives {rows}",
        "valid within the range of the identification data",
    ]
    if tied:
        limits.append("the linear dynamics are discretised for this Ts, which is final")
    continuous = [
        n.name for n in model.graph.nodes if n.block.rate == "continuous" and n.block.tolerance == "integration"
    ]
    if continuous:
        whose = "the accuracy is the solver's, and the unit integrates by a rule of its own"
        limits.append(f"continuous ({', '.join(continuous)}): {whose}")
    deep = [f"{n.name}: {n.dims['depth']}" for n in model.graph.nodes if n.dims.get("depth", 0) > DEPTH]
    if deep:
        limits.append(
            f"an operator remembers {DEPTH} extrema, which makes a step fast; the model file has more "
            f"({', '.join(deep)}): set the depth in values"
        )
    return (
        f"<html><p>A model of kind <em>{escape(model.key)}</em>: {escape(model.text)}.</p>{equations}{history}"
        f"<p><b>Limitations:</b> {'; '.join(limits)}.</p>"
    )


def _links(nodes: list[Node], within: str) -> str:
    """Links to the Example of the package and to the classes of the components."""
    made_of = {f"{within}.{network.names(n)[1]}" if classes.is_large(n) else classes.class_of(n) for n in nodes}
    example, *see = (f'<a href="modelica://{c}">{c}</a>' for c in (f"{within}.Example", *sorted(made_of)))
    return f"<p><b>Example:</b> {example}.</p><p><b>See also:</b> {', '.join(see)}.</p>"
