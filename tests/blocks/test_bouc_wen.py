"""The Bouc-Wen operator against an integration of its equation in u, and for paths divided into more rows."""

from itertools import pairwise

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from hystfmu.graph.blocks import BoucWen

Array = NDArray[np.float64]

LAWS = {
    "saturates on both sides": {"A": 1.3, "beta": 0.4, "gamma": 0.6, "n": 1.4},
    "no bend on the way back": {"A": 1.0, "beta": 0.5, "gamma": 0.5, "n": 2.5},
    "steeper on the way back": {"A": 1.0, "beta": 1.4, "gamma": -0.3, "n": 4.6},
    "far beyond its middle": {"A": 2.0, "beta": 2.0, "gamma": -1.9, "n": 3.0},
    "nearly linear knee": {"A": 1.0, "beta": 2.0, "gamma": -1.0, "n": 1.0001},
    "sharp knee": {"A": 1.0, "beta": 0.6, "gamma": 0.4, "n": 20.0},
    "nearly a play": {"A": 1.0, "beta": 0.5, "gamma": 0.5 - 1e-15, "n": 2.0},
}
every_law = pytest.mark.parametrize("law", LAWS)


def bound(values: dict[str, float]) -> float:
    return float((values["A"] / (values["beta"] + values["gamma"])) ** (1 / values["n"]))


def walk(values: dict[str, float], rows: int) -> Array:
    """Return an input that passes the knee on most of its paths."""
    return np.cumsum(np.random.default_rng(7).normal(size=rows)) * 0.7 * bound(values) / values["A"]


def integrated(u: Array, z: float, A: float, beta: float, gamma: float, n: float) -> Array:
    """Integrate z over every path, up to and from z = 0, where the equation changes."""
    out = [z]
    for first, last in pairwise(u):
        s, way = np.sign(last - first), abs(last - first)
        for _ in range(2):
            v = s * z

            def rate(xi: float, x: Array, v: float = v) -> Array:
                return np.asarray(A - (gamma + beta if v >= 0 else gamma - beta) * np.abs(x) ** n)

            def at_zero(xi: float, x: Array) -> float:
                return float(x[0])

            at_zero.terminal, at_zero.direction = v < 0, 1  # type: ignore[attr-defined]
            r = solve_ivp(rate, (0, way), [v], "DOP853", events=at_zero, rtol=3e-14, atol=1e-16)
            z, way = s * float(r.y[0, -1]), way - float(r.t[-1])
            if r.status != 1 or way <= 0:
                break
            z = 0.0
        out.append(z)
    return np.array(out)


@every_law
def test_z_is_the_integral_of_its_equation(law: str) -> None:
    values = LAWS[law]
    u, top = walk(values, 12), bound(values)
    z = BoucWen(**values, z0=0.3 * top, u0=u[0])(u)[:, 1]
    assert np.abs(z - integrated(u, 0.3 * top, **values)).max() <= 2e-13 * top


@every_law
def test_rows_between_two_reversals_change_nothing(law: str) -> None:
    values = LAWS[law]
    u = walk(values, 12)
    fine = np.concatenate([*(np.linspace(a, b, 501)[:-1] for a, b in pairwise(u)), u[-1:]])
    assert np.array_equal(BoucWen(**values)(fine)[::500], BoucWen(**values)(u))
