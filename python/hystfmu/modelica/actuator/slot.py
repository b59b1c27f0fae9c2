"""Class and parameters of the replaceable component ``hysteresis`` of an actuator (actuator hysteresis for short)."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from hystfmu.base import Array
from hystfmu.graph import Graph, Node
from hystfmu.modelica.literals import array, number

KNOTS = 24  # of the static nonlinearity; every knot costs computing time at every step


@dataclass(frozen=True)
class Slot:
    """A class of `HystFMU.Actuators.Hysteresis` with its parameters, before the conversion to SI units.

    Attributes
    ----------
    name : str
        Name of the class.
    values : dict of (str, str)
        Modelica literals of the parameters of the class.
    gain, shift, scale, offset : float
        The scaled voltage is gain times the input plus shift. The output is scale times the scaled output plus offset.
    rest : float
        Initial scaled voltage, at which the memory is at rest.
    left_out : list of str
        Descriptions of the parts of the model that the actuator does not contain.
    first_slope, least_slope : float
        Slope of the output at the start, and the smallest slope of all branches. The smallest slope is computed only
        for operators whose slope can be negative. A stack whose charge decreases while its voltage rises has no stable
        circuit.
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


def value(node: Node, key: str) -> float:
    """Return the scalar parameter `key` of a block."""
    return float(node.value(key)[0])


def numbers(node: Node, *keys: str) -> dict[str, str]:
    """Return the parameters `keys` of a block as Modelica array literals, by name."""
    return {k: array(np.asarray(node.value(k))) for k in keys}


def limits(node: Node) -> dict[str, str]:
    """Return the lower and upper limit of the grid of a block as Modelica literals, by name."""
    return {k: number(value(node, k)) for k in ("lo", "hi")}


def after(graph: Graph, total: Node) -> dict[str, Node] | None:
    """Return the blocks after the node `total` by type: linear dynamics, delay and scaling, each at most once.

    The result is None if another block follows, or if their order is different.
    """
    last = list(graph.nodes[graph.nodes.index(total) + 1 :])
    places = iter(("transfer_function", "delay", "scaling"))
    return {n.type: n for n in last} if all(n.type in places for n in last) else None


def behind(at: Mapping[str, Node]) -> tuple[float, float, list[str]]:
    """Return factor and offset of the blocks behind an operator, and descriptions of the parts that are left out.

    `at` contains these blocks by type: linear dynamics, delay and scaling. The mechanics replace the dynamics.
    """
    scale, offset = (value(at["scaling"], k) for k in ("gain", "offset")) if "scaling" in at else (1.0, 0.0)
    if g0 := at.get("transfer_function"):
        scale *= static_gain(g0)
    return scale, offset, [f"the delay of {at['delay'].dims['n']} samples"] if "delay" in at else []


def static_gain(dynamics: Node) -> float:
    """Return the static gain of linear dynamics."""
    return float(dynamics.value("b")[-1] / dynamics.value("a")[-1])


def zones(node: Node, names: tuple[str, str, str, str], gain: float = 1.0) -> tuple[dict[str, str], float]:
    """Return the Modelica parameters of a sum of dead zones, and the value of this sum at 0.

    `names` are the names of four parameters: number of dead zones, slope at 0, thresholds, weights. All outputs are
    multiplied by `gain`.
    """
    at_0, slope, r, w = thinned(value(node, "w0"), node.value("r"), node.value("w"))
    given = (str(len(r)), number(gain * slope), array(r), array(gain * w))
    return dict(zip(names, given, strict=True)), gain * at_0


def lags(
    node: Node, names: tuple[str, str, str], gain: float = 1.0, fastest: float = 0.0
) -> tuple[dict[str, str], float]:
    """Return the Modelica parameters of the lags of a creep block, and its direct weight.

    `names` are the names of three parameters: number, weights and time constants of the lags. All weights are
    multiplied by `gain`. Lags with a time constant below `fastest` (s) are added to the direct weight, because the
    samples of a record do not resolve them.
    """
    w, T = gain * node.value("w"), node.value("T")
    slow = fastest <= T
    kept = (w[slow], T[slow]) if slow.any() else (np.zeros(1), np.ones(1))
    given = (str(len(kept[0])), array(kept[0]), array(kept[1]))
    return dict(zip(names, given, strict=True)), float(gain * value(node, "w0") + w[~slow].sum())


def thinned(w0: float, r: Array, w: Array) -> tuple[float, float, Array, Array]:
    """Return a sum of at most `KNOTS` dead zones that equals the original sum at the remaining thresholds.

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
    middle = int(np.searchsorted(x, 0.0)) - 1  # the linear segment that contains 0
    bends = np.diff(slopes)
    return float(y[middle] - slopes[middle] * x[middle]), float(slopes[middle]), left, np.where(left > 0, bends, -bends)
