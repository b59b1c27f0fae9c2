"""Operators that state the slope of their output, in plain numpy: Runge-Kutta steps along the input."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Values = dict[str, Any]
RK_STEPS = 2


def column(y: Array) -> Array:
    return np.asarray(y)[:, None]


def runge_kutta_in_u(
    u: Array, start: tuple[float, float], slope: Callable[[float, float, float], float], bound: float = np.inf
) -> Array:
    """dz/du = slope(u, z, direction) within the bound, from u and z at the start to every row, by Runge-Kutta steps."""
    z = np.empty(len(u))
    last, value = start
    for k in range(len(u)):
        steps = RK_STEPS + int(2500 * abs(u[k] - last))
        h = float(u[k] - last) / steps
        s = float(np.sign(h))
        for i in range(steps if h != 0 else 0):
            x = float(last + i * h)
            k1 = slope(x, value, s)
            k2 = slope(x + h / 2, value + h / 2 * k1, s)
            k3 = slope(x + h / 2, value + h / 2 * k2, s)
            k4 = slope(x + h, value + h * k3, s)
            value = max(-bound, min(bound, value + h / 6 * (k1 + 2 * (k2 + k3) + k4)))
        z[k], last = value, u[k]
    return z


def bouc_wen(u: Array, v: Values) -> Array:
    A, beta, gamma, n = v["A"], v["beta"], v["gamma"], v["n"]
    start = v["u0"], v["z0"]
    z = runge_kutta_in_u(u, start, lambda _, z, s: A - s * beta * abs(z) ** (n - 1) * z - gamma * abs(z) ** n)
    return np.column_stack([v["k"] * (v["alpha"] * u + (1 - v["alpha"]) * z), z])


def coleman_hodgdon(u: Array, v: Values) -> Array:
    start = v["u0"], v["y0"]
    return column(runge_kutta_in_u(u, start, lambda x, y, s: s * v["alpha"] * (v["b"] * x - y) + v["k"]))


def duhem(u: Array, v: Values) -> Array:
    rows = len(v["a_rise"])
    tables = {
        sign: [
            (a, list(zip(b, c, strict=True)))
            for a, b, c in zip(*(_rows(v[f"{m}_{end}"], rows) for m in "abc"), strict=True)
        ]
        for sign, end in ((1.0, "rise"), (-1.0, "fall"))
    }

    def slope(x: float, w: float, s: float) -> float:
        f = 0.0
        for i, (a, pairs) in enumerate(tables[s]):
            f += x**i * (a[0] + sum(b * w**j + c * abs(w) * w ** (j - 1) for j, (b, c) in enumerate(pairs, 1)))
        return f

    return (v["k"] * u + runge_kutta_in_u(u, (v["u0"], v["w0"]), slope, v["w_max"]))[:, None]


def langevin(x: float) -> tuple[float, float]:
    """coth x - 1/x and its slope."""
    if abs(x) < 1e-2:
        return x / 3 - x**3 / 45 + 2 * x**5 / 945, 1 / 3 - x**2 / 15 + 2 * x**4 / 189
    return 1 / np.tanh(x) - 1 / x, 1 / x**2 - 1 / np.sinh(x) ** 2


def jiles_atherton(u: Array, v: Values) -> Array:
    Ms, a, k, c, alpha = (float(v[key]) for key in ("Ms", "a", "k", "c", "alpha"))
    first = 0.0
    for _ in range(200):  # a contraction
        first = (1 - c) * v["m0"] + c * Ms * langevin((v["u0"] + alpha * first) / a)[0]

    def slope(x: float, y: float, s: float) -> float:
        curve, rise = langevin((x + alpha * y) / a)
        chi = max(0.0, s * (Ms * curve - y)) / k + c * Ms / a * rise
        return chi / (1 - alpha * chi)

    return column(runge_kutta_in_u(u, (v["u0"], first), slope))


def _rows(flat: Array, rows: int) -> list[list[float]]:
    return [[float(x) for x in row] for row in np.asarray(flat).reshape(rows, -1)]
