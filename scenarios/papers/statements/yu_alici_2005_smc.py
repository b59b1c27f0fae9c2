"""Numerical tests of Yu & Alici 2005: eqs. 1, 4 and 5, one-to-one mapping, rate dependence, and bounds.

The actuator is the numpy actuator in `rate_plant`.
"""

from __future__ import annotations

import numpy as np

from hystfmu.base.arrays import Array
from hystfmu.data import signals
from hystfmu.graph import Graph, Input, Node, Output
from papers import sliding_bound
from papers.rate_plant import RATE, actuator
from papers.row import Row
from papers.statements import relay_sum

SMC = {"eta": 5.0, "rho": 1.0, "eps": 0.01, "D": 1.0}  # for normalised signals; the printed bound requires eta > 1
SLOW = 1e-3  # change of the input per row, that is, 10 1/s
PATHS = ([0, 1, -0.2, 0.2], [0, -1, 0.2])  # both histories end at the same input, which rises
ROUNDING = 1e-12


def rows() -> list[Row]:
    """Return the table rows of the tests of equations and statements."""
    y = [actuator(signals.ramps(list(p), SLOW))[-1] for p in PATHS]
    low, high, small = _width(2, 1.0), _width(100, 1.0), _width(2, 0.5)
    return [
        relay_sum.block_row(),
        Row(
            "width of the loop at 100 Hz over that at 2 Hz",
            1.0,
            None,
            high / low,
            note="the paper: the width increases with the frequency",
            place="fig. 3",
            sense="least",
        ),
        Row(
            "width of the loop at amplitude 1 over that at 0.5",
            1.0,
            None,
            low / small,
            note="the paper: the width increases with the amplitude",
            place="sec. II",
            sense="least",
        ),
        Row(
            "difference of outputs at the same (u, du/dt), % of span",
            0.0,
            None,
            100 * abs(y[0] - y[1]) / 2,
            note="the mapping is not one-to-one: two slow rises through the same input after other extrema",
            place="sec. III",
            sense="equal",
        ),
        Row(
            "block sliding_mode against eqs. 4 and 5 in numpy, largest difference of u",
            None,
            None,
            _law(),
            ROUNDING,
            note="de/dt: backward difference",
            place="eqs. 4-5",
        ),
        *_bounds(),
    ]


def _width(frequency: float, amplitude: float) -> float:
    """Return the width of the steady-state loop of the actuator for a sine: the largest distance between its branches.

    `frequency` is in Hz. The distance is that of the outputs of the rising and the falling branch at the same input.
    """
    cycle = round(RATE / frequency)
    u = amplitude * np.sin(2 * np.pi * np.arange(4 * cycle) / cycle)
    x, y = u[-cycle:], actuator(u)[-cycle:]
    at = np.linspace(-0.9 * amplitude, 0.9 * amplitude, 200)
    turn = np.argsort(x)
    rising = np.gradient(x) > 0
    up, down = (turn[rising[turn]], turn[~rising[turn]])
    return float(np.abs(np.interp(at, x[up], y[up]) - np.interp(at, x[down], y[down])).max())


def _law() -> float:
    """Return the largest difference of u between the block `sliding_mode` and the printed law, on random signals."""
    h, lam, eta, rho, eps = 1e-3, 30.0, 2e-3, 0.4, 2.0
    y_d, y, u_nn = np.random.default_rng(0).normal(size=(3, 500)).cumsum(axis=1) / 30
    e: Array = y - y_d
    rate = np.diff(e, prepend=0.0) / h
    s = rate + lam * e
    expected = u_nn - eta * s - rho * s / (np.abs(s) + eps)
    node = Node("law", "sliding_mode", {}, {"lam": lam, "eta": eta, "rho": rho, "epsilon": eps})
    inputs = [Input(name, (f"law.{name}",)) for name in ("y_d", "y", "u_ff")]
    u = Graph([node], [], inputs, [Output("u", "law.u")]).run(np.column_stack([y_d, y, u_nn]), h)
    return float(np.abs(u - expected)[2:].max())


def _bounds() -> list[Row]:
    eta, eps = SMC["eta"], SMC["eps"]
    exact = sliding_bound.ultimate(**SMC)
    given = "eta 5, eps 0.01, rho 1, |d| <= 1"
    simulated = [sliding_bound.simulated(**SMC, error=error) for error in (False, True)]
    note = "the printed eps/(eta - 1) does not follow from eq. 5; literal: simulated law; ours: exact formula"
    other = f"eps/(lambda (eta - 1)), lambda {sliding_bound.LAM:g} 1/s: false as the bound of |s| is"
    return [
        Row(
            f"ultimate bound of |s|, {given}",
            sliding_bound.printed(eta, eps),
            simulated[0],
            exact,
            note=note,
            place="sec. IV",
            sense="equal",
        ),
        Row(
            f"ultimate bound of |e|, {given}",
            sliding_bound.printed_error(eta, eps),
            simulated[1],
            exact / sliding_bound.LAM,
            note=other,
            place="sec. IV",
            sense="equal",
        ),
        Row(
            "relative difference of simulation and exact bound of |s|",
            None,
            None,
            abs(simulated[0] / exact - 1),
            1e-3,
            place="sec. IV",
        ),
    ]
