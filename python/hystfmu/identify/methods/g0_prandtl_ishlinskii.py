"""Hysteresis, then linear dynamics with delay: y = c + e^(-s tau) G0(s) PI[u], as in Yu & Alici 2005, fig. 1.

G0(s) = 1 / (s^2/omega_n^2 + 2 zeta s/omega_n + 1).  The weights of the plays enter linearly: for every trial of (f_n,
zeta, tau) the plays, filtered by G0 and delayed, are columns of a non-negative least-squares problem, and only three
parameters are left to search (variable projection, Golub & Pereyra 1973).

Thresholds beside the true ones bend every loop a little, and the dynamics take the blame: 40 even ones can put f_n 5 %
off.  So after a first search with N even thresholds, those that get a weight among FINER N are kept (non-negative least
squares picks few), and the dynamics are searched again with them.

A ramp between the samples of a sine loses (omega h)^2/12 of its amplitude, and again the dynamics take the blame: with
f_n 400 Hz, zeta 0.7 and cycles down to 10 ms, f_n is 1.7 % off at 50 samples in the shortest cycle; take 100 or more.

The delay is a whole number of samples in a delay block and the rest of it as a Pade approximant of e^(-s tau) of order
2 inside the transfer function: its phase is off by (omega tau)^5/720, 5e-9 rad at a fiftieth of the sample rate.  A
rate-independent operator commutes with a delay, so it does not matter where the delay lies.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

import numpy as np
from scipy.optimize import OptimizeResult, least_squares

from hystfmu.base.arrays import Array
from hystfmu.base.errors import InputError
from hystfmu.data import Dataset
from hystfmu.graph import Graph, Input, Node, Output
from hystfmu.identify.features.initial_memory import u0_of, u0_option
from hystfmu.identify.features.plays import plays, thresholds
from hystfmu.identify.options import Option
from hystfmu.identify.solvers.nonnegative import nonnegative
from hystfmu.model import Model

MOST_ROWS = 5000  # more rows than this are thinned evenly, after filtering at the full rate
TRIALS = 11  # of f_n, over four decades at most, that begin the search
FINER, ROUNDS = 8, 2  # the thresholds in use are picked from so many times N, and so often
MOST_EVALUATIONS = 40  # of the residuals and their Jacobian, for each of the starts that go on
DIFFERENCE = 1e-5  # step of the Jacobian in ln f_n, ln zeta and samples of delay
LEAST_REST = 1e-6  # a shorter rest of the delay, in samples, is dropped

OPTIONS = (
    Option("N", 40, 1, 10000, text="number of plays in the first search"),
    Option("w0_min", 0.0, 0.0, 1e300, text="least weight of the linear term; an inverse needs more than 0"),
    u0_option("every play rests"),
    Option("hold", "foh", choices=("foh", "zoh"), text="input between rows: a ramp, or held (at the new value)"),
    Option("delay_max", 10.0, 0.0, 1e5, text="longest delay tried, in samples"),
    Option("zeta_max", 5.0, 0.01, 1e3, text="largest damping ratio tried"),
)


@dataclass(frozen=True)
class Dynamics:
    """G0 and the delay: natural frequency (Hz), damping ratio, delay (s)."""

    f_n: float
    zeta: float
    delay: float

    def nodes(self, h: float, hold: str) -> list[Node]:
        """Blocks in a chain for the step h (s): ``g0`` (transfer_function), and ``delay`` if it is a sample or more."""
        whole = math.floor(self.delay / h + LEAST_REST)
        b, a = polynomials(self, max(self.delay - whole * h, 0.0) if self.delay / h - whole > LEAST_REST else 0.0)
        g0 = Node("g0", "transfer_function", {}, {"b": b, "a": a, "hold": hold, "start": "steady"})
        return [g0, Node("delay", "delay", {"n": whole})] if whole else [g0]

    def filter(self, columns: Array, h: float, hold: str) -> Array:
        """Columns (rows, n) after G0 and the delay, each from its steady state, run by the C core."""
        g0, *delays = self.nodes(h, hold)
        graph = Graph.single(g0)
        out = np.column_stack([graph.run(c, h) for c in columns.T])
        if not delays:
            return out
        n = min(delays[0].dims["n"], len(out))
        return np.vstack([np.repeat(out[:1], n, axis=0), out[: len(out) - n]])


def polynomials(g: Dynamics, rest: float) -> tuple[Array, Array]:
    """Numerator and denominator of G0(s) times Pade(2, 2) of e^(-s rest), highest power of s first."""
    w = 2 * np.pi * g.f_n
    b, a = np.array([w * w]), np.array([1.0, 2 * g.zeta * w, w * w])
    if rest == 0:
        return b, a
    pade = np.array([1.0, 6 / rest, 12 / rest**2])
    return np.polymul(b, pade * [1, -1, 1]), np.polymul(a, pade)


def build(
    data: Dataset, options: Mapping[str, Any], seed: int, progress: Callable[[float], None]
) -> tuple[Graph, int, dict[str, float]]:
    """The graph ``scaling -> prandtl_ishlinskii -> transfer_function [-> delay] -> scaling``, the number of its
    parameters, and f_n (Hz), zeta, delay (s).

    Without dynamics in the data, f_n ends at its upper bound, the Nyquist frequency.
    """
    rows, h = data.train, data.h
    u0 = u0_of(data, options)
    middle, half = float(data.u[rows].max() + data.u[rows].min()) / 2, float(np.ptp(data.u[rows])) / 2
    x = (data.u - middle) / half
    x0 = (u0 - middle) / half
    stride = -(-(rows.stop - rows.start) // MOST_ROWS)
    y = data.y[rows][::stride]
    ones = np.ones((len(y), 1))
    hold, least = options["hold"], options["w0_min"] * half

    def project(g: Dynamics, columns: Array) -> tuple[Array, Array, float]:
        """Residuals, weights, offset."""
        filtered = g.filter(columns, h, hold)[rows][::stride]
        w, (offset,) = nonnegative(filtered, y - least * filtered[:, 0], ones)
        w[0] += least
        return filtered @ w + offset - y, w, float(offset)

    r = thresholds(x[rows], options["N"])
    columns = np.column_stack([x, plays(x, r, x0)])
    g = search(lambda g: project(g, columns)[0], data, options, lambda f: progress(0.5 * f))
    for i in range(ROUNDS):
        finer = thresholds(x[rows], FINER * options["N"])
        columns = np.column_stack([x, plays(x, finer, x0)])
        r = finer[project(g, columns)[1][1:] > 0]
        if not len(r):
            r = finer[-1:]
        columns = np.column_stack([x, plays(x, r, x0)])
        g = search(lambda g: project(g, columns)[0], data, options, lambda f: None, g)  # noqa: B023 - called at once
        progress(0.5 + 0.5 * (i + 1) / ROUNDS)
    _, w, offset = project(g, columns)
    return graph(g, w, r, x0, (middle, half, offset), hold, data), len(r) + 5, vars(g).copy()


def search(
    residuals: Callable[[Dynamics], Array],
    data: Dataset,
    options: Mapping[str, Any],
    progress: Callable[[float], None],
    near: Dynamics | None = None,
) -> Dynamics:
    """The dynamics with the smallest residuals: trust-region steps from `near`, or the best two on a grid of f_n."""
    h, n = data.h, data.train.stop - data.train.start
    slowest, fastest = 1 / (n * h), 0.5 / h
    lo = np.array([np.log(slowest), np.log(0.01), 0.0])
    hi = np.array([np.log(fastest), np.log(options["zeta_max"]), max(options["delay_max"], 1e-9)])

    def at(p: Array) -> Dynamics:
        return Dynamics(float(np.exp(p[0])), float(np.exp(p[1])), float(p[2]) * h)

    def inside(p: Sequence[float]) -> Array:
        return np.clip(p, lo + 1e-9 * (hi - lo), hi - 1e-9 * (hi - lo))

    scale = data.span * np.sqrt(n)

    def error(p: Array) -> Array:
        return np.asarray(residuals(at(p)) / scale)

    def jacobian(p: Array) -> Array:
        here = error(p)
        signs = np.where(p + DIFFERENCE > hi, -1, 1)
        steps = DIFFERENCE * signs
        return np.column_stack([(error(p + s * e) - here) / s for s, e in zip(steps, np.eye(3), strict=True)])

    def refine(p: Array) -> OptimizeResult:
        return least_squares(
            error, p, jacobian, (lo, hi), x_scale=np.ones(3), ftol=1e-10, xtol=1e-9, max_nfev=MOST_EVALUATIONS
        )

    if near is not None:
        return at(refine(inside([np.log(near.f_n), np.log(near.zeta), near.delay / h])).x)
    grid = np.linspace(np.log(fastest), np.log(max(slowest, 1e-4 * fastest)), TRIALS)
    trials = []
    for i, ln_f in enumerate(grid):
        for delay in (0.0, 2.0):
            p = inside([ln_f, np.log(0.7), delay])
            e = error(p)
            trials.append((float(e @ e), p))
        progress(0.3 * (i + 1) / len(grid))
    found = []
    for i, (_, p) in enumerate(sorted(trials, key=lambda t: t[0])[:2]):
        found.append(refine(p))
        progress(0.3 + 0.35 * (i + 1))
    return at(min(found, key=lambda f: f.cost).x)


def graph(
    g: Dynamics, w: Array, r: Array, x0: float, scale: tuple[float, float, float], hold: str, data: Dataset
) -> Graph:
    """The model with input `u` and output `y`; `scale` is the middle and half range of u, and the offset of y."""
    middle, half, offset = scale
    dynamics = g.nodes(data.h, hold)
    if len(dynamics) > 1:
        dynamics[1] = dynamics[1].with_values(y0=float(w.sum() * x0))
    chain = [
        Node("input", "scaling", {"n": 1}, {"gain": 1 / half, "offset": -middle / half}),
        Node("hysteresis", "prandtl_ishlinskii", {}, {"w0": w[0], "r": r, "w": w[1:], "u0": x0}),
        *dynamics,
        Node("readout", "scaling", {"n": 1}, {"offset": offset}),
    ]
    wires = [(f"{a.name}.y", f"{b.name}.u") for a, b in pairwise(chain)]
    inputs = [Input("u", ("input.u",), data.unit_u, data.u[0])]
    return Graph(chain, wires, inputs, [Output("y", "readout.y", data.unit_y)])


def hysteresis(model: Model) -> Model:
    """The model without G0 and delay: the static part, which `hystfmu.inverse.inverse` inverts exactly.

    In front of that inverse belongs a ``feedforward`` block with ``f_n`` and ``zeta`` of ``model.fit``, which needs the
    reference with two derivatives, taken ``delay`` seconds ahead.

    Raises
    ------
    InputError
        A model of another key.
    """
    if model.key != "g0_prandtl_ishlinskii":
        raise InputError(f"hysteresis() takes a model of key 'g0_prandtl_ishlinskii'; got {model.key!r}")
    g = model.graph
    chain = [g.node(name) for name in ("input", "hysteresis", "readout")]
    wires = [(f"{a.name}.y", f"{b.name}.u") for a, b in pairwise(chain)]
    return replace(model, key="prandtl_ishlinskii", graph=Graph(chain, wires, g.inputs, g.outputs), fit={})
