"""A class for the slot of an actuator, and the computation of its values from the blocks of a graph."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from hystfmu.base.arrays import Array
from hystfmu.graph import Node
from hystfmu.modelica.literals import array, number

KNOTS = 24  # of the bend: each takes time at every step


@dataclass(frozen=True)
class Slot:
    """A class of `HystFMU.Actuators.Hysteresis` with values that have no units of measure yet.

    Attributes
    ----------
    name : str
        Name of the class.
    values : dict of (str, str)
        Modelica literals of the parameters of the class.
    gain, shift, scale, offset : float
        Scaled voltage is gain times the input plus shift; the output is scale times the scaled output plus offset.
    rest : float
        Scaled voltage at which the memory is at rest at the start.
    left_out : list of str
        Parts of the model that the actuator omits.
    first_slope, least_slope : float
        Slope of the output at the start, and the least slope of all branches if it may be negative. A stack whose
        charge decreases while its voltage rises has no stable circuit.
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
    """Return a scalar parameter."""
    return float(node.value(key)[0])


def numbers(node: Node, *keys: str) -> dict[str, str]:
    """Return parameters as Modelica arrays."""
    return {k: array(np.asarray(node.value(k))) for k in keys}


def limits(node: Node) -> dict[str, str]:
    """Return the ends of a grid."""
    return {k: number(value(node, k)) for k in ("lo", "hi")}


def left_out(delay: Node) -> str:
    """Return the name of a delay that the actuator omits."""
    return f"the delay of {delay.dims['n']} samples"


def zones(node: Node, names: tuple[str, str, str, str], gain: float = 1.0) -> tuple[dict[str, str], float]:
    """Return number, slope at 0, thresholds and weights of a sum of dead zones by name, and its value at 0."""
    at_0, slope, r, w = thinned(value(node, "w0"), node.value("r"), node.value("w"))
    given = (str(len(r)), number(gain * slope), array(r), array(gain * w))
    return dict(zip(names, given, strict=True)), gain * at_0


def lags(
    node: Node, names: tuple[str, str, str], gain: float = 1.0, fastest: float = 0.0
) -> tuple[dict[str, str], float]:
    """Return number, weights and time constants of the lags of a creep block by name, and the direct weight.

    The direct weight includes lags faster than `fastest` (s), because the samples of a record do not resolve these
    lags.
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
    middle = int(np.searchsorted(x, 0.0)) - 1  # the piece that 0 lies in
    bends = np.diff(slopes)
    return float(y[middle] - slopes[middle] * x[middle]), float(slopes[middle]), left, np.where(left > 0, bends, -bends)
