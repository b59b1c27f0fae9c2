"""Conversion of graphs to the hysteresis of an actuator: an operator with static nonlinearities, lags and dynamics."""

from dataclasses import replace
from itertools import pairwise

import numpy as np

from hystfmu.graph import Graph, Node, Output
from hystfmu.modelica import classes
from hystfmu.modelica.actuator.slot import Slot, after, behind, lags, limits, numbers, static_gain, value, zones
from hystfmu.modelica.literals import number
from hystfmu.modelica.measures import si, to_si

OPERATORS = ("prandtl_ishlinskii", "preisach")
BEHIND = ("dead_zones", "creep", "transfer_function", "delay", "scaling")
BEND, CREEP = ("m", "b0", "knots", "b"), ("lags", "creep", "T")


def chain(graph: Graph) -> Slot | None:
    """Return the actuator hysteresis for a series connection of blocks; None if the graph has another structure.

    The order is scaling, operator (`OPERATORS`), and the types in `BEHIND`. Each block occurs at most once. Only the
    operator is required.
    """
    nodes = list(graph.nodes)
    first = nodes.pop(0) if nodes[0].type == "scaling" else None
    types = [n.type for n in nodes]
    places = iter(BEHIND)
    if not nodes or types[0] not in OPERATORS or not all(t in places for t in types[1:]):
        return None
    if len(graph.wires) != len(graph.nodes) - 1:
        return None
    at = dict(zip(types, nodes, strict=True))
    name, values, rest, offset = _operator(nodes[0])
    gain, at_0 = 1.0, 0.0
    if g0 := at.get("transfer_function"):
        gain *= static_gain(g0)
    bend, creep, readout = (at.get(k) for k in ("dead_zones", "creep", "scaling"))
    if bend is not None and offset:
        return None
    if bend is not None:
        more, at_0 = zones(bend, BEND)
        values |= more
    if creep is not None:
        direct = value(creep, "w0")
        if not direct:
            return None
        values |= lags(creep, CREEP, 1 / direct)[0]
        gain *= direct
        at_0, offset = ((1 + float(creep.value("w").sum()) / direct) * x for x in (at_0, offset))
    if name == "PrandtlIshlinskii" and (bend is not None or creep is not None):
        name = "BentPrandtlIshlinskii"
        values = {"m": "1", "b0": "1.0", "knots": "{1.0}", "b": "{0.0}"} | values
    if readout is not None:
        gain *= value(readout, "gain")
    return Slot(
        name,
        values,
        rest,
        value(first, "gain") if first else 1.0,
        value(first, "offset") if first else 0.0,
        gain,
        gain * (at_0 + offset) + (value(readout, "offset") if readout else 0.0),
        behind(at)[2],
    )


def _operator(node: Node) -> tuple[str, dict[str, str], float, float]:
    """Return class name, parameters, rest voltage and offset of an operator.

    The rest voltage is the scaled voltage at which the memory is at rest.
    """
    values = {"n": str(node.dims["n"])}
    if node.type == "prandtl_ishlinskii":
        values |= {"w0": number(value(node, "w0")), **numbers(node, "r", "w")}
        return "PrandtlIshlinskii", values, value(node, "u0"), 0.0
    return "Preisach", values | relays(node), rest_of_relays(node), value(node, "offset")


def relays(node: Node) -> dict[str, str]:
    """Return the limits, the Everett function and the initial state of a Preisach operator as Modelica parameters."""
    return limits(node) | numbers(node, "E") | classes.choices(node)


def rest_of_relays(node: Node) -> float:
    """Return the input at which the memory of a Preisach operator is at rest."""
    lo, hi = value(node, "lo"), value(node, "hi")
    return {"low": lo, "high": hi}.get(classes.word(node, "start"), 0.5 * (lo + hi))


CHANGE = ("gm", "gb0", "gknots", "gb")


def temperatures(graph: Graph) -> bool:
    """Return whether a graph has one input, or one input and a temperature as the second input."""
    return all(si(p.unit)[0] == "K" for p in graph.inputs[1:]) and 1 <= len(graph.inputs) <= 2


def warm(graph: Graph) -> Slot | None:
    """Return the actuator hysteresis for a series connection with a static nonlinearity that depends on temperature.

    The result is None if the graph has another structure.
    """
    if len(graph.inputs) != 2 or not temperatures(graph):
        return None
    T = graph.inputs[1]
    nodes = {n.name: n for n in graph.nodes}
    beside = [
        n for n in graph.nodes if n.name in ("covariates", "gain", "scheduled", "following") or _follows(n, T.name)
    ]
    kept = [n for n in graph.nodes if n not in beside]
    if not {"covariates", "following", "bend"} <= set(nodes) or T.to != ("covariates.u[1]",):
        return None
    wires = [(f"{a.name}.y", f"{b.name}.u") for a, b in pairwise(kept)]
    found = chain(Graph(kept, wires, graph.inputs[:1], [Output("y", f"{kept[-1].name}.y")]))
    if found is None:
        return None
    scaled, total = nodes["covariates"], nodes["following"].value("k")
    gain, shift, lo, hi = (value(scaled, k) for k in ("gain", "offset", "lo", "hi"))
    g = float(nodes["gain"].value("k")[0]) if "gain" in nodes else 0.0
    at_0 = g * zones(nodes["bend"], CHANGE)[1] + float(total[1])
    values: dict[str, str] = {}
    if bend := nodes.get(f"bend_{T.name}"):
        values, more = zones(bend, CHANGE)
        at_0 += more
    degrees = {"T_middle": -shift / gain, "T_min": lo, "T_max": hi}
    values |= {k: number(to_si(x, T.unit)) for k, x in degrees.items()}
    values |= {"T_gain": number(gain / si(T.unit)[1]), "g": number(g), "g0": number(at_0)}
    return replace(found, values=found.values | values)


def _follows(node: Node, name: str) -> bool:
    return node.name in (f"bend_{name}", f"times_{name}")


CURVE, OF_X = ("m_x", "c0", "knots_x", "curve"), ("lags_x", "creep_x", "T_x")
FASTEST = 1  # time constant, in steps, below which a lag is replaced by a direct weight
INSIDE = 0.999999  # largest initial z over the bound of z: the class refuses an initial value beyond the bound
PREISACH = {
    "hysteresis": "preisach",
    "creep": "creep",
    "lag": "creep",
    "middle": "scaling",
    "bend_of_lag": "dead_zones",
    "readout": "sum",
}


def preisach(graph: Graph, h: float) -> Slot | None:
    """Return the actuator hysteresis for a Preisach operator in parallel with creep and a nonlinear lag of the input.

    `h` is the step (s) of the model. The result is None if the graph has another structure.
    """
    if {n.name: n.type for n in graph.nodes} != PREISACH:
        return None
    operator, creep, lag, middle, bend, readout = (graph.node(n) for n in PREISACH)
    wired = {"hysteresis.y": "readout.u[1]", "creep.y": "readout.u[2]", "bend_of_lag.y": "readout.u[3]"}
    wired |= {"lag.y": "middle.u", "middle.y": "bend_of_lag.u"}
    if set(graph.wires) != set(wired.items()) or lag.dims["n"] != 1 or value(middle, "gain") != 1:
        return None
    k = readout.value("k")
    slow, at_once = lags(creep, OF_X, float(k[1]), FASTEST * h)
    values = {"n": str(operator.dims["n"]), "b0": number(k[0]), "c0": number(at_once)} | relays(operator) | slow
    more, at_0 = zones(bend, ("m_lag", "c_lag", "knots_lag", "widening"), float(k[2] * lag.value("w")[0]))
    if value(bend, "w0") or value(lag, "w0") or lag.value("w")[0] != 1:
        return None
    del more["c_lag"]
    values |= more | {"T_lag": number(lag.value("T")[0]), "middle": number(-value(middle, "offset"))}
    offset = float(k[0] * value(operator, "offset")) + at_0 + value(readout, "offset")
    return Slot("Preisach", values, rest_of_relays(operator), offset=offset)


def bouc_wen(graph: Graph, h: float) -> Slot | None:
    """Return the actuator hysteresis for a Bouc-Wen operator in parallel with its input, or a nonlinearity and lags.

    Linear dynamics may follow in series. `h` is the step (s) of the model. The result is None if the graph has another
    structure.
    """
    nodes = {n.name: n for n in graph.nodes}
    operators = [n for n in graph.nodes if n.type == "bouc_wen"]
    if len(operators) != 1 or graph.nodes[0].type != "scaling" or len(graph.outputs) != 1:
        return None
    first, operator = graph.nodes[0], operators[0]
    totals = [n for n in graph.nodes if n.type == "sum"]
    if len(totals) != 1:
        return None
    total, x, z = totals[0], f"{first.name}.y", f"{operator.name}.z"
    last = after(graph, total)
    if last is None or (x, f"{operator.name}.u") not in graph.wires:
        return None
    beside = _beside(graph, nodes, total, (x, z), FASTEST * h)
    if beside is None:
        return None
    w0, w, values, at_0, curve = beside
    scale, offset, left_out = behind(last)
    A, beta, gamma, n, z0 = (value(operator, k) for k in ("A", "beta", "gamma", "n", "z0"))
    bound = (A / (beta + gamma)) ** (1 / n)
    values |= {k: number(v) for k, v in (("A", A), ("beta", beta), ("gamma", gamma), ("knee", n), ("w0", w0), ("w", w))}
    values["z0"] = number(float(np.clip(z0, -INSIDE * bound, INSIDE * bound)))
    slopes = [w0 + w * s for s in (A, 0.0, 2 * A * beta / (beta + gamma))]
    return Slot(
        "BoucWen",
        values,
        value(operator, "u0"),
        value(first, "gain"),
        value(first, "offset"),
        scale,
        scale * (value(total, "offset") + at_0) + offset,
        left_out,
        scale * (slopes[0] + curve),
        scale * (min(slopes) + curve),
    )


def _beside(
    graph: Graph, nodes: dict[str, Node], total: Node, ends: tuple[str, str], fastest: float
) -> tuple[float, float, dict[str, str], float, float] | None:
    """Return the values that the terms of the sum `total` give to a Bouc-Wen hysteresis; None for an unknown term.

    The results are the weights of the input x and of the hysteretic variable z, the parameters of the parallel terms,
    the value of these terms at 0, and the smallest slope of the static nonlinearity.
    """
    source = {to: origin for origin, to in graph.wires}
    weights = {source.get(f"{total.name}.u[{i + 1}]", ""): float(k) for i, k in enumerate(total.value("k"))}
    (x, z), at_0, least, late = ends, 0.0, 0.0, None
    w0, w = weights.pop(x, 0.0), weights.pop(z, 0.0)
    values: dict[str, str] = {}
    for end, k in weights.items():
        node = nodes.get(end.partition(".")[0])
        origin = source.get(f"{node.name}.u") if node else None
        if node and node.type == "dead_zones" and origin == x:
            more, at_0 = zones(node, CURVE, k)
            least = _least_slope(node, k)
        elif node and node.type == "creep" and origin == x:
            more, at_once = lags(node, OF_X, k, fastest)
            w0 += at_once
        elif node and node.type == "creep" and origin == z:
            more, late = {}, (node, k)
            w += lags(node, CREEP, k, fastest)[1]
        else:
            return None
        values |= more
    if late is not None:  # in the class, creep acts on w0 x + w z; so w0 x moves into the static nonlinearity
        if not w:
            return None
        values |= lags(late[0], CREEP, late[1] / w, fastest)[0]
        values["c0"] = number(float(values.get("c0", "0")) + w0)
        w0, least = 0.0, least + w0
    return w0, w, values, at_0, least


def _least_slope(node: Node, k: float) -> float:
    """Return the smallest slope of a sum of dead zones, multiplied by `k`."""
    w0, r, w = value(node, "w0"), node.value("r"), node.value("w")
    ends = [0.0, *np.nextafter(r, np.where(r > 0, np.inf, -np.inf))]
    return min(k * float(w0 + w[((r > 0) & (x > r)) | ((r < 0) & (x < r))].sum()) for x in ends)
