"""Slot of a network on plays, or on an operator that plays replace."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hystfmu.base.arrays import Array
from hystfmu.graph import Graph, Node
from hystfmu.modelica import classes
from hystfmu.modelica.actuator.slot import Slot, value
from hystfmu.modelica.literals import array, number

PLAYS = 24  # that stand for the branch of an operator: a polygon
FINE = 2001  # points of its loading curve
BLOCKS = {"input": "scaling", "features": "scaling", "network": "mlp", "readout": "scaling"}


@dataclass(frozen=True)
class _Plays:
    """Inputs of a network: `matrix` (m, n + 1) times (x, plays of half-widths r) + `at_0` (m,); all start at `rest`."""

    r: Array
    matrix: Array
    at_0: Array
    rest: float


def network(graph: Graph) -> Slot | None:
    """Return the slot of a network on scaled input and plays or one operator, with or without linear readout."""
    nodes = {n.name: n for n in graph.nodes}
    operators = [n for n in graph.nodes if n.name in ("bank", "operator")]
    types = {n: node.type for n, node in nodes.items() if n not in ("linear", "total", "bank", "operator")}
    if types != BLOCKS or len(operators) != 1 or len(graph.inputs) != 1:
        return None
    first, features, net, readout = (nodes[n] for n in BLOCKS)
    plays = _plays(operators[0], _reach(graph, first))
    if plays is None:
        return None
    gain, shift = (features.value(k) for k in ("gain", "offset"))
    W1: Array = net.value("W1").reshape(-1, len(plays.matrix))
    out = value(readout, "gain")
    k, at_0 = np.zeros(len(plays.matrix)), out * value(net, "b2") + value(readout, "offset")
    if "linear" in nodes:
        k, at_0 = nodes["linear"].value("k"), at_0 + value(nodes["linear"], "offset")
    values = {
        "n": str(len(plays.r)),
        "n_hidden": str(len(W1)),
        "r": array(plays.r),
        "k": array(k @ plays.matrix),
        "W1": array(W1 * gain @ plays.matrix),
        "b1": array(net.value("b1") + W1 @ (shift + gain * plays.at_0)),
        "W2": array(out * net.value("W2")),
        "b2": number(at_0 + float(k @ plays.at_0)),
        **classes.choices(net),
    }
    return Slot("PlayBankMlp", values, plays.rest, value(first, "gain"), value(first, "offset"))


def _reach(graph: Graph, first: Node) -> tuple[float, float]:
    """Return the range of the scaled input for which the features were scaled."""
    features = graph.node("features")
    middle, half = -features.value("offset")[0] / features.value("gain")[0], 1 / abs(features.value("gain")[0])
    return float(middle - half), float(middle + half)


def _plays(node: Node, reach: tuple[float, float]) -> _Plays | None:
    """Return plays, a sum of plays, or the plays that replace an operator with return-point memory."""
    match node.type:
        case "play_bank":
            n = node.dims["n"] + 1
            return _Plays(node.value("r"), np.eye(n), np.zeros(n), float(node.value("z0")[0]))
        case "prandtl_ishlinskii":
            rows = np.zeros((2, node.dims["n"] + 1))
            rows[0, 0], rows[1] = 1.0, [value(node, "w0"), *node.value("w")]
            return _Plays(node.value("r"), rows, np.zeros(2), value(node, "u0"))
    if any(v.name == "memory" for v in node.block.parameters) and classes.word(node, "memory") == "dominant":
        x0 = value(node, "x0")
        r, w = _polygon(node, x0, max(abs(reach[0] - x0), abs(reach[1] - x0), (reach[1] - reach[0]) / 2))
        rows = np.zeros((2, len(r) + 1))
        rows[0, 0], rows[1, 1:] = 1.0, w
        return _Plays(r, rows, np.array([0.0, -w.sum() * x0]), x0)
    return None


def _polygon(node: Node, x0: float, longest: float) -> tuple[Array, Array]:
    """Return half-widths and weights of plays, each (n,), that approximate the loading curve of an operator.

    The loading curve of the plays is a polygon. Its corners are denser where the curve bends, so that the largest
    distance is about the same in every segment.
    """
    q = np.linspace(0, longest, FINE)
    phi = Graph.single(node).run(x0 + q).reshape(FINE, -1)[:, 0]
    bends = np.cumsum(np.sqrt(np.abs(np.diff(phi, 2))) + 1e-6 * np.ptp(phi) / FINE)
    corners = np.interp(np.linspace(0, bends[-1], PLAYS + 1), bends, q[1:-1])
    corners[[0, -1]] = 0.0, longest
    slopes = np.diff(np.interp(corners, q, phi)) / np.diff(corners)
    return corners[:-1], np.diff(slopes, prepend=0.0)
