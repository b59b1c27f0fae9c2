"""Partial block of an exported model with its ports in SI units, and equations for the rates of its inputs."""

from collections.abc import Callable, Mapping, Sequence
from functools import partial

from hystfmu.base import InputError
from hystfmu.graph import Graph, Input, Output
from hystfmu.modelica.classes import is_sampled
from hystfmu.modelica.layout import line, on_component, placed, port_placed
from hystfmu.modelica.literals import NAME, RESERVED, class_text, number, sentence, string
from hystfmu.modelica.measures import per_second, si, zero
from hystfmu.modelica.realisation import FACTOR, Rate
from hystfmu.modelica.record import field
from hystfmu.modelica.wiring import Wiring, unit_constant, zero_constant

_USED = {"HystFMU", "Modelica", "abs", "noEvent"}  # that the text of the block uses
_OF_SAMPLED = {"t0", "begun"}  # of HystFMU.Interfaces.Sampled
RATE_PLACE, RATE_STEP = -90, 25  # position of the first port of a rate in the icon, and distance to the next one


def names(graph: Graph, taken: set[str], rated: Sequence[str]) -> tuple[dict[str, str], dict[str, str]]:
    """Return the names of the ports and components in the block, by their names in the graph.

    `taken` contains the names of the classes of the package, `rated` the inputs whose rates are inputs of the block.

    Raises
    ------
    InputError
        A port has a name that Modelica does not allow.
    """
    outside: tuple[Input | Output, ...] = (*graph.inputs, *graph.outputs)
    for p in outside:
        if not NAME.match(p.name):
            raise InputError(f"the port {p.name!r}: a name in Modelica is a letter followed by letters, digits or _")
    own = {"Ts", "values", "usesRate", *_USED, *taken}
    if any(is_sampled(n) for n in graph.nodes):
        own |= _OF_SAMPLED
    used = own | RESERVED
    ports = {p.name: _chosen(p.name, used, partial(_declared, p, rated)) for p in outside}
    used |= {f(p) for p in ports.values() for f in (unit_constant, zero_constant, rate_name, inner_rate)}

    def beside(name: str) -> set[str]:
        return {inner_rate(name)} if rated else set()

    return ports, {n.name: _chosen(n.name, used, beside) for n in graph.nodes}


def _chosen(name: str, used: set[str], beside: Callable[[str], set[str]]) -> str:
    """Return the name, followed by ``_`` until it and the names declared `beside` it are new; add them to `used`."""
    while ({name} | beside(name)) & used:
        name += "_"
    used |= {name} | beside(name)
    return name


def _declared(p: Input | Output, rated: Sequence[str], name: str) -> set[str]:
    """Return the names that the block declares besides the port `name`."""
    found = {unit_constant(name)} if si(p.unit)[0] else set()
    found |= {zero_constant(name)} if zero(p.unit) else set()
    return found | ({rate_name(name), inner_rate(name)} if p.name in rated else set())


def rate_name(port: str) -> str:
    """Return the name of the input for the time derivative of a port."""
    return f"d{port}"


def inner_rate(name: str) -> str:
    """Return the name, inside the block, of the time derivative of a port or of the input of a component."""
    return f"{name}_rate"


def ports_block(
    wiring: Wiring, within: str, text: str, record_name: str, rated: Sequence[str], info: Mapping[str, str]
) -> str:
    """Return the text of the Modelica file of the partial block, without its first line (the mark of an exported file).

    Parameters
    ----------
    wiring : Wiring
    within, text, record_name : str
        Package, description of the model, name of the record.
    rated : sequence of str
        Names of the inputs of the graph whose rates the continuous realisations need.
    info : mapping of str to str
        Description of each realisation, by name.
    """
    graph, where = wiring.graph, wiring.where
    lines = [
        "  extends HystFMU.Icons.Hysteresis;",
        f'  parameter {record_name} values "Values of the model" '
        f'annotation (Dialog(group = "Parameters"), {placed(*where.corner)});',
    ]
    for i, p in enumerate(graph.inputs):
        at = port_placed(True, i, len(graph.inputs), where.edge)
        lines.append(_port("Input", p, wiring.ports[p.name], wiring.shape(p.to[0]), at))
    for k, port in enumerate(rated):
        unit = next(p.unit for p in graph.inputs if p.name == port)
        name, y = wiring.ports[port], RATE_PLACE + RATE_STEP * k
        icon = f"iconTransformation(extent = {{{{-120, {y - 10}}}, {{-100, {y + 10}}}}})"
        lines.append(
            f'  HystFMU.Interfaces.RealInput {rate_name(name)}(unit = "{per_second(si(unit)[0])}") if usesRate '
            f'"Rate of {name}; Model has no such input" annotation ({placed(-where.edge, y)[:-1]}, {icon}));'
        )
    for i, o in enumerate(graph.outputs):
        at = port_placed(False, i, len(graph.outputs), where.edge)
        lines.append(_port("Output", o, wiring.ports[o.name], wiring.shape(o.source), at))
    both: tuple[Input | Output, ...] = (*graph.inputs, *graph.outputs)
    constants = [c for p in both if si(p.unit)[0] for c in _constants(p, wiring.ports[p.name])]
    if rated:
        constants.insert(0, '  constant Boolean usesRate = false "True if there is an input for the rate";')
    if constants:
        lines += ["protected", *constants]
    listed = "".join(f"<li>{k}: {v}</li>" for k, v in info.items())
    told = string(f"<html><p>Ports in SI units and values of the realisations:</p><ul>{listed}</ul></html>")
    return class_text("partial block Ports", f"{text}: ports and values", lines, told, within)


def _port(kind: str, p: Input | Output, name: str, shape: str, at: str) -> str:
    unit, factor = si(p.unit)
    text = p.text or kind
    converted = factor != 1 or zero(p.unit) != 0
    if p.unit and (converted or not unit):
        text += f" ({p.unit} in the model)" if unit else f" ({p.unit})"
    each = "each " if shape else ""
    shown = [f'{each}unit = "{unit}"'] + ([f'{each}displayUnit = "{p.unit}"'] if converted else []) if unit else []
    given = f"({', '.join(shown)})" if shown else ""
    return f"  HystFMU.Interfaces.Real{kind} {name}{shape}{given} {sentence(text)} annotation ({at});"


def _constants(p: Input | Output, name: str) -> list[str]:
    unit, factor = si(p.unit)
    found = [f'  constant Real {unit_constant(name)}(unit = "{unit}") = {number(factor)} "One {p.unit}";']
    if above := zero(p.unit):
        text = f"Where {p.unit} counts 0"
        found.append(f'  constant Real {zero_constant(name)}(unit = "{unit}") = {number(above)} "{text}";')
    return found


def rate_declarations(w: Wiring, rates: Mapping[str, Rate]) -> tuple[list[str], list[str]]:
    """Return the declarations and the equations of the input rates (time derivatives) that operators need.

    `rates` contains the rate of the input of each operator, by the name of its node.
    """
    if not rates:
        return [], []
    where, low = w.where, min(y for _, y in w.where.of.values()) - 40
    needed = {port for rate in rates.values() for port, _ in rate.terms}
    ports = [p for p in w.graph.inputs if p.name in needed]
    declared, stated, inner = [], [], {}
    for k, p in enumerate(ports):
        name, unit = w.ports[p.name], si(p.unit)[0]
        at, outer = (30 + RATE_STEP * k - where.edge, low), (-where.edge, RATE_PLACE + RATE_STEP * k)
        inner[p.name] = inner_rate(name) + (f"/{unit_constant(name)}" if unit else "")
        declared.append(
            f'  HystFMU.Interfaces.RealInput {inner_rate(name)}(unit = "{per_second(unit)}") "Rate of {name}" '
            f"annotation ({placed(*at)});"
        )
        stated.append(f"  connect({rate_name(name)}, {inner_rate(name)}) {line(outer, at)};")
    for k, (node, rate) in enumerate(rates.items()):
        part = w.parts[node]
        here = (where.of[node][0], low - 30 * (k + 1))
        declared.append(
            f'  HystFMU.Interfaces.RealOutput {inner_rate(part)}(unit = "1/s") "Rate of the input of {part}" '
            f"annotation ({placed(*here)});"
        )
        first = w.graph.node(node).block.of("input")[0].name
        there = on_component((-110, -70), where.of[node])
        stated += [
            f"  {inner_rate(part)} = {_rate(w, rate, inner)};",
            f"  connect({inner_rate(part)}, {part}.{rate_name(first)}) {line(here, there)};",
        ]
    return declared, stated


def _rate(w: Wiring, rate: Rate, inner: Mapping[str, str]) -> str:
    """Return the Modelica expression of the rate of the input of an operator, from the rates of the ports.

    The expression contains the gains of the scalings and sums on the path. Outside the limits of a scaling, the rate is
    0.
    """
    terms = []
    for port, through in rate.terms:
        found = inner[port]
        for node, index in reversed(through):
            k, u = f"values.{field(w.graph, node, FACTOR[node.type])}[{index}]", f"{w.parts[node.name]}.u[{index}]"
            limits, keys = [], {v.name for v in node.block.parameters}
            for key, relation, none in (("lo", ">", -1e300), ("hi", "<", 1e300)):
                if key in keys and node.value(key)[index - 1] != none:
                    limits.append(f"{u} {relation} values.{field(w.graph, node, key)}[{index}]")
            found = f"{k}*{found}" if not limits else f"(if {' and '.join(limits)} then {k}*{found} else 0)"
        terms.append(found)
    whole = " + ".join(terms)
    return f"noEvent({whole})" if " if " in f" {whole}".replace("(", " ") else whole
