"""The graph of an identified model as one class of the slot of an actuator: values folded, in volts and metres."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from hystfmu.base.arrays import Array
from hystfmu.graph import Graph, Node
from hystfmu.modelica import classes
from hystfmu.modelica.literals import array, number

KNOTS = 24  # of the bend: each takes time at every step
INSIDE = 0.999999  # of the bound of z: the class refuses a start beyond it
CHAIN = ["scaling", "prandtl_ishlinskii", "dead_zones", "creep", "transfer_function", "delay", "scaling"]


@dataclass(frozen=True)
class Slot:
    """A class of `HystFMU.Actuators.Hysteresis`, before its units of measure.

    Attributes
    ----------
    name : str
        Name of the class.
    values : dict of (str, str)
        Modelica literals of its own parameters.
    gain, shift, scale, offset : float
        Scaled voltage of an input of 1 and at 0; output of a scaled output of 1 and of 0.
    rest : float
        Scaled voltage at which the memory rests at the start.
    left_out : list of str
        Parts of the model that the actuator has not.
    first_slope, least_slope : float
        Slope of the output at the start, and the least of all branches, where it may be below 0: a stack whose charge
        falls while its voltage rises has no stable circuit.
    """

    name: str
    values: dict[str, str]
    rest: float
    gain: float = 1.0
    shift: float = 0.0
    scale: float = 1.0
    offset: float = 0.0
    left_out: list[str] = field(default_factory=list)
    first_slope: float = 1.0
    least_slope: float = 1.0


def slot(graph: Graph) -> Slot | None:
    """The slot of a model, or None if the library has no class for it.

    Parameters
    ----------
    graph : Graph
        Of an identified model.
    """
    return next((found for of in (_chain, _one_operator, _bouc_wen, _network) if (found := of(graph))), None)


def _value(node: Node, key: str) -> float:
    return float(node.value(key)[0])


def _numbers(node: Node, *keys: str) -> dict[str, str]:
    return {k: array(np.asarray(node.value(k))) for k in keys}


def _chain(graph: Graph) -> Slot | None:
    """Scaling, plays, bend, creep, dynamics, readout: each block at most once in this order, the plays at least."""
    types = [n.type for n in graph.nodes]
    places = iter(CHAIN if types[:1] == ["scaling"] else CHAIN[1:])
    if "prandtl_ishlinskii" not in types or not all(t in places for t in types):
        return None
    at = {n.type: n for n in graph.nodes if n.type != "scaling"}
    scalings = [n for n in graph.nodes if n.type == "scaling"]
    first = scalings.pop(0) if types[0] == "scaling" else None
    plays, bend, creep, g0 = (
        at["prandtl_ishlinskii"],
        at.get("dead_zones"),
        at.get("creep"),
        at.get("transfer_function"),
    )
    values = {"n": str(plays.dims["n"]), "w0": number(_value(plays, "w0")), **_numbers(plays, "r", "w")}
    scale = _value(scalings[0], "gain") if scalings else 1.0
    if g0 is not None:
        scale *= float(g0.value("b")[-1] / g0.value("a")[-1])
    name = "PrandtlIshlinskii" if bend is None and creep is None else "BentPrandtlIshlinskii"
    at_0 = 0.0
    if bend is not None:
        at_0, b0, r, w = thinned(_value(bend, "w0"), bend.value("r"), bend.value("w"))
        values |= {"m": str(len(r)), "b0": number(b0), "knots": array(r), "b": array(w)}
    if creep is not None:
        direct = _value(creep, "w0")
        scale *= direct
        at_0 *= 1 + float(creep.value("w").sum()) / direct
        values |= {
            "lags": str(creep.dims["n"]),
            "creep": array(creep.value("w") / direct),
            "T": array(creep.value("T")),
        }
    elif name == "BentPrandtlIshlinskii":
        values |= {"lags": "1", "creep": "{0.0}", "T": "{1.0}"}
    if bend is None and creep is not None:
        values |= {"m": "1", "b0": "1.0", "knots": "{1.0}", "b": "{0.0}"}
    return Slot(
        name,
        values,
        _value(plays, "u0"),
        _value(first, "gain") if first else 1.0,
        _value(first, "offset") if first else 0.0,
        scale,
        scale * at_0 + (_value(scalings[0], "offset") if scalings else 0.0),
        [_left_out(at["delay"])] if "delay" in at else [],
    )


def thinned(w0: float, r: Array, w: Array) -> tuple[float, float, Array, Array]:
    """A sum of dead zones with at most `KNOTS` of them, through the old one at each that is left.

    Parameters
    ----------
    w0 : float
        Slope at 0.
    r, w : array
        Thresholds and weights, each (n,).

    Returns
    -------
    at_0, w0 : float
        Value and slope at 0.
    r, w : array
        Thresholds and weights, each (m,).
    """
    order = np.argsort(r)
    r, w = r[order], w[order]
    if len(r) <= KNOTS or not r[0] < 0 < r[-1]:
        return 0.0, w0, r, w
    left = r[np.unique(np.linspace(0, len(r) - 1, KNOTS).round().astype(int))]
    x = np.concatenate([[left[0] - 1.0], left, [left[-1] + 1.0]])
    side = np.where(r > 0, np.maximum(x[:, None] - r, 0.0), np.minimum(x[:, None] - r, 0.0))
    y = w0 * x + side @ w
    slopes = np.diff(y) / np.diff(x)
    middle = int(np.searchsorted(x, 0.0)) - 1  # the piece that 0 lies in
    bends = np.diff(slopes)
    return float(y[middle] - slopes[middle] * x[middle]), float(slopes[middle]), left, np.where(left > 0, bends, -bends)


def _one_operator(graph: Graph) -> Slot | None:
    """One Preisach or Krasnosel'skii-Pokrovskii operator."""
    if len(graph.nodes) != 1:
        return None
    node = graph.nodes[0]
    match node.type:
        case "krasnoselskii_pokrovskii":
            rest = _value(node, "u0")
            values = {"n": str(node.dims["n"])} | _limits(node) | _numbers(node, "w")
            return Slot("KrasnoselskiiPokrovskii", values, rest, offset=_value(node, "offset"))
        case "preisach":
            values = {"n": str(node.dims["n"])} | _limits(node) | _numbers(node, "E") | classes.choices(node)
            lo, hi = _value(node, "lo"), _value(node, "hi")
            rest = {"low": lo, "high": hi}.get(classes.word(node, "start"), 0.5 * (lo + hi))
            return Slot("Preisach", values, rest, offset=_value(node, "offset"))
    return None


def _bouc_wen(graph: Graph) -> Slot | None:
    """A Bouc-Wen operator beside its input, then dynamics and a readout, as `bouc_wen` and `g0_bouc_wen` make them."""
    types = [n.type for n in graph.nodes]
    places = iter(["transfer_function", "delay", "scaling"])
    if types[:3] != ["scaling", "bouc_wen", "sum"] or not all(t in places for t in types[3:]):
        return None
    first, operator, total, *rest = graph.nodes
    weights = total.value("k")
    wanted = {(f"{first.name}.y", f"{total.name}.u[1]"), (f"{operator.name}.z", f"{total.name}.u[2]")}
    if len(weights) != 2 or not wanted <= set(graph.wires):
        return None
    at = {n.type: n for n in rest}
    dynamics, readout = at.get("transfer_function"), at.get("scaling")
    scale = _value(readout, "gain") if readout else 1.0
    if dynamics is not None:
        scale *= float(dynamics.value("b")[-1] / dynamics.value("a")[-1])
    shift = _value(first, "offset")  # the input of the operator at 0 V, where the actuator starts
    values = {k: number(_value(operator, k)) for k in ("A", "beta", "gamma")} | {"z0": number(_z(operator, shift))}
    values |= {"knee": number(_value(operator, "n")), "w0": number(weights[0]), "w": number(weights[1])}
    A, beta, gamma = (_value(operator, k) for k in ("A", "beta", "gamma"))
    slopes = [float(weights[0] + weights[1] * s) for s in (A, 0.0, 2 * A * beta / (beta + gamma))]
    return Slot(
        "BoucWen",
        values,
        shift,
        _value(first, "gain"),
        shift,
        scale,
        scale * _value(total, "offset") + (_value(readout, "offset") if readout else 0.0),
        [_left_out(at["delay"])] if "delay" in at else [],
        slopes[0],
        min(slopes),
    )


def _z(operator: Node, u: float) -> float:
    """Return z of a Bouc-Wen operator behind the path from u0 to u, inside its bound in spite of rounding."""
    bound = (_value(operator, "A") / (_value(operator, "beta") + _value(operator, "gamma"))) ** (
        1 / _value(operator, "n")
    )
    z = float(Graph.single(operator).run(np.array([u]))[0, 1])
    return float(np.clip(z, -INSIDE * bound, INSIDE * bound))


def _left_out(delay: Node) -> str:
    return f"the delay of {delay.dims['n']} samples"


def _limits(node: Node) -> dict[str, str]:
    return {k: number(_value(node, k)) for k in ("lo", "hi")}


def _network(graph: Graph) -> Slot | None:
    """Plays and a network on them, with or without a linear readout, as `play_bank_mlp` makes it."""
    nodes = {n.name: n for n in graph.nodes}
    types = {n: node.type for n, node in nodes.items() if n not in ("linear", "total")}
    wanted = {"input": "scaling", "bank": "play_bank", "features": "scaling", "network": "mlp", "readout": "scaling"}
    if types != wanted or len(graph.inputs) != 1:
        return None
    first, bank, features, network, readout = (nodes[n] for n in wanted)
    gain, shift = (features.value(k) for k in ("gain", "offset"))
    size = bank.dims["n"] + 1
    if len(gain) != size:
        return None
    W1: Array = network.value("W1").reshape(-1, size)
    out = _value(readout, "gain")
    k, at_0 = np.zeros(size), out * _value(network, "b2") + _value(readout, "offset")
    if "linear" in nodes:
        k, at_0 = nodes["linear"].value("k"), at_0 + _value(nodes["linear"], "offset")
    values = {
        "n": str(bank.dims["n"]),
        "n_hidden": str(len(W1)),
        **_numbers(bank, "r"),
        "k": array(k),
        "W1": array(W1 * gain),
        "b1": array(network.value("b1") + W1 @ shift),
        "W2": array(out * network.value("W2")),
        "b2": number(at_0),
        **classes.choices(network),
    }
    rest = float(bank.value("z0")[0])
    return Slot("PlayBankMlp", values, rest, _value(first, "gain"), _value(first, "offset"))
