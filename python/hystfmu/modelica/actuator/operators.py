"""Conversion of an operator, alone or with a magnetisation law or a network, to the hysteresis of an actuator."""

import math
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from hystfmu.base import Array
from hystfmu.graph import Graph, Node
from hystfmu.graph.splines import uniform_splines
from hystfmu.modelica import classes
from hystfmu.modelica.actuator.slot import Slot, after, behind, limits, numbers, value
from hystfmu.modelica.literals import array, number

DUHEM = ["scaling", "duhem", "scaling"]
REACH = 1.0  # largest scaled input in the fits
BRANCH_POINTS, INSIDE = 1001, 11  # number of points along a branch of the loop, and between the two branches


def operator(graph: Graph) -> Slot | None:
    """Return the actuator hysteresis for a Krasnosel'skii-Pokrovskii or Duhem operator; None for other graphs."""
    types = [n.type for n in graph.nodes]
    if types == ["krasnoselskii_pokrovskii"]:
        (node,) = graph.nodes
        values = {"n": str(node.dims["n"])} | limits(node) | numbers(node, "w")
        return Slot("KrasnoselskiiPokrovskii", values, value(node, "u0"), offset=value(node, "offset"))
    if types != DUHEM:
        return None
    first, node, readout = graph.nodes
    values = {"n": str(node.dims["m"]), "q": str(node.dims["q"]), "w_start": number(value(node, "w0"))}
    values |= {k: number(value(node, k)) for k in ("k", "w_max")}
    values |= numbers(node, *(f"{k}_{way}" for k in "abc" for way in ("rise", "fall")))
    (gain, shift), (scale, offset) = ([value(x, k) for k in ("gain", "offset")] for x in (first, readout))
    return Slot("Duhem", values, value(node, "u0"), gain, shift, scale, offset, [], *_slopes(node))


def _slopes(node: Node) -> tuple[float, float]:
    """Return the slope of a Duhem operator for a rising input at the start, and its smallest slope in the largest loop.

    The smallest slope is the minimum over both directions of the input and over all points inside the loop.
    """
    k, u0, up = value(node, "k"), value(node, "u0"), np.linspace(-REACH, REACH, BRANCH_POINTS)
    way = np.concatenate([up[up >= u0], up[::-1], up, up[::-1], up])
    w = (Graph.single(node).run(way).reshape(-1) - k * way)[-2 * BRANCH_POINTS :].reshape(2, BRANCH_POINTS)
    x, inside = np.tile(up, (INSIDE, 1)), np.linspace(w[0, ::-1], w[1], INSIDE)
    least = min(float(_slope(node, x, inside, way).min()) for way in ("rise", "fall"))
    return k + float(_slope(node, np.array(u0), np.array(value(node, "w0")), "rise")), k + least


def _slope(node: Node, x: Array, w: Array, way: str) -> Array:
    """Return dw/dx of a Duhem operator for a rising or falling input. `x`, `w` and the result have the same shape."""
    a = node.value(f"a_{way}")
    b, c = (np.reshape(node.value(f"{key}_{way}"), (len(a), -1)) for key in "bc")
    v = w.reshape(-1, 1)
    powers = v ** np.arange(b.shape[1])
    of_w = a + (v * powers) @ b.T + (np.abs(v) * powers) @ c.T
    return np.asarray(np.sum(uniform_splines(x.ravel(), len(a)) * of_w, axis=1).reshape(np.shape(w)))


MOST_FIELD = 3.0  # largest scaled field in the fits: half of the range is 1, and the bias is at most 2


def magnetic(graph: Graph) -> Slot | None:
    """Return the actuator hysteresis for a Jiles-Atherton operator; None for other graphs.

    A scaling precedes the operator. The output is a weighted sum of the field, the magnetisation, and the square of the
    magnetisation.
    """
    nodes = {n.name: n for n in graph.nodes}
    if [n.type for n in graph.nodes][:2] != ["scaling", "jiles_atherton"]:
        return None
    total = next((n for n in graph.nodes if n.type == "sum"), None)
    if total is None:
        return None
    first, operator = graph.nodes[:2]
    squares = [n for n in graph.nodes if n.type == "product"]
    last = after(graph, total)
    if len(squares) > 1 or last is None:
        return None
    parts = [f"{first.name}.y", f"{operator.name}.y", *(f"{n.name}.y" for n in squares)]
    wires = {f"{total.name}.u[{i + 1}]": part for i, part in enumerate(parts)}
    wires |= {f"{operator.name}.u": parts[0], **{f"{n.name}.u[{i}]": parts[1] for n in squares for i in (1, 2)}}
    wires |= {f"{b.name}.u": f"{a.name}.y" for a, b in pairwise([total, *last.values()])}
    if {(a, b) for b, a in wires.items()} != set(graph.wires) or len(nodes) != 3 + len(squares) + len(last):
        return None
    Ms, a, k, c, alpha = (value(operator, key) for key in ("Ms", "a", "k", "c", "alpha"))
    w0, w, w2 = (*(float(x) for x in total.value("k")), 0.0)[:3]
    w, w2, alpha = w * Ms, w2 * Ms**2, alpha * Ms
    scale, offset, left_out = behind(last)
    least = c / a * _langevin_slope((MOST_FIELD + abs(alpha)) / a)
    least = w0 + (w - 2 * abs(w2)) * least / (1 - alpha * least)
    values = {"a": a, "k": k, "c": c, "alpha": alpha, "w0": w0, "w": w, "w2": w2, "m_start": value(operator, "m0") / Ms}
    return Slot(
        "JilesAtherton",
        {name: number(x) for name, x in values.items()},
        value(operator, "u0"),
        value(first, "gain"),
        value(first, "offset"),
        scale,
        scale * value(total, "offset") + offset,
        left_out,
        w0 + w * c / (3 * a),
        least if w > 2 * abs(w2) else w - 2 * abs(w2),
    )


def _langevin_slope(h: float) -> float:
    return 1 / h**2 - 1 / math.sinh(min(h, 300.0)) ** 2


PLAYS = 24  # number of plays that approximate an operator; their loading curve is a polygon
CURVE_POINTS = 2001  # number of points of the loading curve
BLOCKS = {"input": "scaling", "features": "scaling", "network": "mlp", "readout": "scaling"}


@dataclass(frozen=True)
class _Plays:
    """Plays whose outputs give the inputs of a network.

    The inputs (m,) are `matrix` (m, n + 1) times the vector (x, outputs of n plays) plus `at_0` (m,). The half-widths
    of the plays are `r` (n,). All plays start at `rest`.
    """

    r: Array
    matrix: Array
    at_0: Array
    rest: float


def network(graph: Graph) -> Slot | None:
    """Return the actuator hysteresis for a network; None for other graphs.

    The inputs of the network are the scaled input and the outputs of plays or of one operator. A linear term of these
    signals may be added to the output of the network.
    """
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
    """Return the smallest and the largest scaled input for which the inputs of the network were scaled to -1...1."""
    features = graph.node("features")
    middle, half = -features.value("offset")[0] / features.value("gain")[0], 1 / abs(features.value("gain")[0])
    return float(middle - half), float(middle + half)


def _plays(node: Node, reach: tuple[float, float]) -> _Plays | None:
    """Return the plays of a block, or plays that approximate an operator with return-point memory.

    The result is None for other blocks.
    """
    match node.type:
        case "play_bank":
            n = node.dims["n"] + 1
            return _Plays(node.value("r"), np.eye(n), np.zeros(n), float(node.value("z0")[0]))
        case "prandtl_ishlinskii":
            rows = np.zeros((2, node.dims["n"] + 1))
            rows[0, 0], rows[1] = 1.0, [value(node, "w0"), *node.value("w")]
            return _Plays(node.value("r"), rows, np.zeros(2), value(node, "u0"))
    if node.block.parameter("memory") and classes.word(node, "memory") == "dominant":
        x0 = value(node, "x0")
        r, w = _polygon(node, x0, max(abs(reach[0] - x0), abs(reach[1] - x0), (reach[1] - reach[0]) / 2))
        rows = np.zeros((2, len(r) + 1))
        rows[0, 0], rows[1, 1:] = 1.0, w
        return _Plays(r, rows, np.array([0.0, -w.sum() * x0]), x0)
    return None


def _polygon(node: Node, x0: float, longest: float) -> tuple[Array, Array]:
    """Return half-widths and weights of plays, each (n,), that approximate the loading curve of an operator.

    The curve starts at the input `x0` and has the length `longest`. The loading curve of the plays is a polygon. The
    vertices are denser where the curvature is larger, so that the largest error is about the same in every segment.
    """
    q = np.linspace(0, longest, CURVE_POINTS)
    phi = Graph.single(node).run(x0 + q).reshape(CURVE_POINTS, -1)[:, 0]
    bends = np.cumsum(np.sqrt(np.abs(np.diff(phi, 2))) + 1e-6 * np.ptp(phi) / CURVE_POINTS)
    corners = np.interp(np.linspace(0, bends[-1], PLAYS + 1), bends, q[1:-1])
    corners[[0, -1]] = 0.0, longest
    slopes = np.diff(np.interp(corners, q, phi)) / np.diff(corners)
    return corners[:-1], np.diff(slopes, prepend=0.0)
