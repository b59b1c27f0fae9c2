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
from papers.row import Row, Stated
from papers.statements import relay_sum

ROW = Stated(__name__)

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
        ROW("rate_width", ours=high / low),
        ROW("amplitude_width", ours=low / small),
        ROW("one_to_one", ours=100 * abs(y[0] - y[1]) / 2),
        ROW("law", ours=_law(), target=ROUNDING),
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
        ROW("bound_s", simulated[0], exact, printed=sliding_bound.printed(eta, eps), note=note, given=given),
        ROW(
            "bound_e",
            simulated[1],
            exact / sliding_bound.LAM,
            printed=sliding_bound.printed_error(eta, eps),
            note=other,
            given=given,
        ),
        ROW("simulated", ours=abs(simulated[0] / exact - 1)),
    ]
