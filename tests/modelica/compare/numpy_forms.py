"""Operators in plain numpy, written from their definitions alone: nothing here shares an idea with the C core.

Return-point operators are evaluated from the whole history at each row: its dominant extrema are found as the point
farthest from the start, the farthest one back from there, and so on; no list is carried from row to row.
"""

from __future__ import annotations

import functools
import itertools
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from numpy_slopes import bouc_wen, coleman_hodgdon, column, duhem, jiles_atherton

Array = NDArray[np.float64]
Rows = NDArray[np.int64]
Values = dict[str, Any]


def plays(u: Array, r: Array, z: Array) -> Array:
    """Play operators, one column each: Krejci & Kuhnen 2001, eq. 3."""
    out = np.empty((len(u), len(r)))
    for k, x in enumerate(u):
        out[k] = z = np.clip(z, x - r, x + r)
    return out


def dominant(x: Array, x0: float) -> list[float]:
    """The dominant extrema of a history that began at x0, and the present value at the end."""
    path = np.concatenate([[x0], x])
    k = int(len(path) - 1 - np.argmax(np.abs(path[::-1] - x0)))
    points = [float(path[k])]
    falling = path[k] > x0
    while k < len(path) - 1:
        rest = path[k + 1 :][::-1]
        k = len(path) - 1 - int(np.argmin(rest) if falling else np.argmax(rest))
        points.append(float(path[k]))
        falling = not falling
    return points


def return_point(x: Array, rows: Rows, x0: float, h0: float, g: Callable[[Array], Array]) -> Array:
    """Masing's rule on the dominant extrema: h0 +- g(2 |x_1 - x0|)/2 +- g(|x_2 - x_1|) +- ..."""
    h = np.zeros(len(x))
    for k in rows:
        points = np.array(dominant(x[: k + 1], x0))
        ways = np.diff(points)
        virgin = points[0] - x0
        h[k] = h0 + np.sign(virgin) * 0.5 * g(np.abs(2 * virgin))
        h[k] += np.sum(np.sign(ways) * g(np.abs(ways))) if len(ways) else 0.0
    return h


def last_extremum(x: Array, x0: float, g: Callable[[Array], Array]) -> Array:
    """The literal reading: a branch starts at the last extremum, whatever was passed."""
    h, x_p, h_p, direction = np.zeros(len(x)), x0, 0.0, 0.0
    before, value = x0, 0.0
    for k, now in enumerate(x):
        s = np.sign(now - before)
        if s != 0:
            if direction * s < 0:
                x_p, h_p = before, value
            direction = s
            value = h_p + np.sign(now - x_p) * float(g(np.abs(now - x_p)))
            before = now
        h[k] = value
    return h


def zhao_tan_branch(d: Array) -> Array:
    return (1 - np.exp(-d)) * d


def constraint_factor_branch(v: Values) -> Callable[[Array], Array]:
    powers = 2 * np.arange(len(v["a"])) + 1
    polynomial = np.zeros(2 * len(v["a"]))
    polynomial[0], polynomial[powers] = v["a0"], v["a"]
    p = np.polynomial.Polynomial(polynomial)
    top = float(v["d_max"])
    slope = np.exp(-top) * p(top) + (1 - np.exp(-top)) * p.deriv()(top)

    def g(d: Array) -> Array:
        e = np.minimum(d, top)
        return (1 - np.exp(-e)) * p(e) + slope * (d - e)

    return g


def inverse_of(g: Callable[[Array], Array]) -> Callable[[Array], Array]:
    """Inverse of an increasing branch by bisection to the last bit."""

    def inverse(v: Array) -> Array:
        lo, hi = np.zeros_like(v), np.ones_like(v)
        while (g(hi) < v).any():
            hi = 2 * hi
        for _ in range(70):
            middle = 0.5 * (lo + hi)
            above = g(middle) > v
            lo, hi = np.where(above, lo, middle), np.where(above, middle, hi)
        return 0.5 * (lo + hi)

    return inverse


def prandtl_ishlinskii_branch(v: Values) -> Callable[[Array], Array]:
    r, w = np.asarray(v["r"]), np.asarray(v["w"])
    return lambda d: v["w0"] * d + 2 * np.maximum(np.multiply.outer(d, 0.5 * np.ones(len(r))) - r, 0) @ w


def kernels(u: Array, v: Values) -> Array:
    i, j = np.tril_indices(int(v["n"]))
    a = (v["hi"] - v["lo"]) / v["n"]
    k = np.clip(2 * (v["u0"] - v["lo"] - a * (i + j) / 2) / a - 1, -1, 1)
    rising, falling = (np.clip(2 * np.subtract.outer(u, v["lo"] + a * p) / a - 1, -1, 1) for p in (i, j))
    y = np.empty(len(u))
    for i in range(len(u)):
        k = np.minimum(np.maximum(k, rising[i]), falling[i])
        y[i] = v["offset"] + np.dot(v["w"], k)
    return y[:, None]


def preisach(u: Array, rows: Rows, v: Values) -> Array:
    """Everett sums over the staircase of dominant extrema of the whole history."""
    n, lo, hi = int(v["n"]), v["lo"], v["hi"]
    E = np.zeros((n + 2, n + 2))
    E[np.tril_indices(n + 1, -1)] = v["E"]
    x = np.clip(u, lo, hi)

    def everett(alpha: Array | float, beta: Array | float) -> Array:
        p, q = ((np.asarray(t) - lo) / (hi - lo) * n for t in (alpha, beta))
        i, j = np.minimum(p, n - 1).astype(int), np.minimum(q, n - 1).astype(int)
        a, b = p - i, q - j
        low = (1 - a) * E[i, j] + (a - b) * E[i + 1, j] + b * E[i + 1, j + 1]
        high = (1 - b) * E[i, j] + (b - a) * E[i, j + 1] + a * E[i + 1, j + 1]
        return np.where(a >= b, low, high)

    full = float(E[n, 0])
    virgin = functools.cache(lambda first: demagnetised(everett, first, lo, hi, full))
    y = np.zeros(len(x))
    for k in rows:
        history = x[: k + 1]
        points = dominant(history, lo if v["start"] == "low" else hi if v["start"] == "high" else 0.5 * (lo + hi))
        first = points[0]
        if v["start"] == "low":
            y[k] = v["offset"] - full + 2 * everett(first, lo)
        elif v["start"] == "high":
            y[k] = v["offset"] + full - 2 * everett(hi, first)
        else:
            y[k] = v["offset"] + virgin(first)
        for a, b in itertools.pairwise(points):
            y[k] += 2 * everett(b, a) if b > a else -2 * everett(a, b)
    return y[:, None]


STAIRS = 20000


def demagnetised(everett: Callable[..., Array], u: float, lo: float, hi: float, full: float) -> float:
    """First branch from the demagnetised state: limit of a staircase of ever smaller loops."""
    middle = 0.5 * (lo + hi)
    # from positive saturation down and up again along alpha + beta = lo + hi, until the amplitude is that of u
    ends = middle + np.linspace(hi - middle, abs(u - middle), STAIRS + 1)
    lower = 2 * middle - 0.5 * (ends[1:] + ends[:-1])
    y = full + 2 * float(np.sum(everett(ends[1:], lower) - everett(ends[:-1], lower)))
    return y - 2 * float(everett(ends[-1], u)) if u < middle else y


def creep(u: Array, v: Values, h: float) -> Array:
    T, q = np.asarray(v["T"]), np.full(len(v["T"]), u[0] if v["start"] == "steady" else 0.0)
    y = np.empty(len(u))
    y[0] = v["w0"] * u[0] + np.dot(v["w"], q)
    for k in range(1, len(u)):
        q = np.exp(-h / T) * q + (1 - np.exp(-h / T)) * u[k]
        y[k] = v["w0"] * u[k] + np.dot(v["w"], q)
    return y[:, None]


def creep_inverse(u: Array, v: Values, h: float) -> Array:
    """The output of creep is linear in its inputs: its rows are solved for them, one after the other."""
    T, w, w0 = np.asarray(v["T"]), np.asarray(v["w"]), float(np.squeeze(v["w0"]))
    assert v["start"] == "rest"
    n = len(u)
    answer = np.array([np.dot(w, np.exp(-j * h / T) * (1 - np.exp(-h / T))) for j in range(n)])  # to a pulse of a step
    y = np.empty(n)
    y[0] = u[0] / w0
    for k in range(1, n):
        y[k] = (u[k] - np.dot(answer[1:k], y[k - 1 : 0 : -1])) / (w0 + answer[0])
    return y[:, None]


def chosen(u: Array, v: Values, rows: Rows, g: Callable[[Array], Array]) -> Array:
    """An operator that remembers its dominant extrema, or the last one alone."""
    return column(last_extremum(u, v["x0"], g) if v["memory"] == "last" else return_point(u, rows, v["x0"], 0.0, g))


def inverted(u: Array, v: Values, rows: Rows, g: Callable[[Array], Array]) -> Array:
    """The inverse of an operator at rest at x0, by the same memory."""
    return column(return_point(u, rows, 0.0, v["x0"], g))


def prandtl_ishlinskii_inverse(u: Array, v: Values, rows: Rows) -> Array:
    rest = (v["w0"] + np.sum(v["w"])) * v["u0"]
    return column(return_point(u, rows, rest, v["u0"], inverse_of(prandtl_ishlinskii_branch(v))))


def bank(u: Array, v: Values) -> Array:
    return plays(u, np.asarray(v["r"]), np.asarray(v["z0"]))


@dataclass(frozen=True)
class Form:
    """An independent form of a class: its outputs, one column each, for the input u, right at least at some rows.

    Attributes
    ----------
    at : callable
        Outputs from the input, the values of the parameters, the step and the rows.
    fast : bool
        Is its time in proportion to the rows?
    bound : float
        Of its own error, relative to the largest output; 0: rounding.
    """

    at: Callable[[Array, Values, float, Rows], Array]
    fast: bool = False
    bound: float = 0.0

    def outputs(self, u: Array, v: Values, h: float, rows: Rows) -> Array:
        """Outputs at some rows of the input u."""
        return self.at(u, v, h, rows)[rows]


# a class that is not here is compared with the C core alone, whose vectors are its oracle
FORMS = {
    "PlayBank": Form(lambda u, v, h, rows: bank(u, v), fast=True),
    "StopBank": Form(lambda u, v, h, rows: u[:, None] - bank(u, v), fast=True),
    "BacklashSum": Form(lambda u, v, h, rows: column(v["w0"] * u + bank(u, v) @ v["w"]), fast=True),
    "PrandtlIshlinskii": Form(
        lambda u, v, h, rows: column(
            v["w0"] * u + plays(u, np.asarray(v["r"]), np.full(len(v["r"]), v["u0"])) @ v["w"]
        ),
        fast=True,
    ),
    "PrandtlIshlinskiiInverse": Form(lambda u, v, h, rows: prandtl_ishlinskii_inverse(u, v, rows)),
    "ZhaoTan": Form(lambda u, v, h, rows: chosen(u, v, rows, zhao_tan_branch)),
    "ConstraintFactor": Form(lambda u, v, h, rows: chosen(u, v, rows, constraint_factor_branch(v))),
    "ConstraintFactorInverse": Form(
        lambda u, v, h, rows: inverted(u, v, rows, inverse_of(constraint_factor_branch(v)))
    ),
    "ZhaoTanInverse": Form(lambda u, v, h, rows: inverted(u, v, rows, inverse_of(zhao_tan_branch))),
    "ZhaoTanInverseReconstructed": Form(lambda u, v, h, rows: inverted(u, v, rows, lambda d: (1 + np.exp(-d)) * d)),
    "KrasnoselskiiPokrovskii": Form(lambda u, v, h, rows: kernels(u, v)),
    # plain Runge-Kutta with a corner at 0
    "BoucWen": Form(lambda u, v, h, rows: bouc_wen(u, v), fast=True, bound=1e-7),
    "ColemanHodgdon": Form(lambda u, v, h, rows: coleman_hodgdon(u, v), fast=True, bound=1e-7),
    "JilesAtherton": Form(lambda u, v, h, rows: jiles_atherton(u, v), fast=True, bound=1e-7),
    "Duhem": Form(lambda u, v, h, rows: duhem(u, v), fast=True, bound=1e-7),
    # a staircase of many loops
    "Preisach": Form(lambda u, v, h, rows: preisach(u, rows, v), bound=1e-5),
    "Creep": Form(lambda u, v, h, rows: creep(u, v, h), fast=True),
    "CreepInverse": Form(lambda u, v, h, rows: creep_inverse(u, v, h)),
}
