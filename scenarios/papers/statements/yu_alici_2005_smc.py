"""Numerical tests of Yu & Alici 2005: eqs. 1, 4 and 5, one-to-one mapping, rate dependence, and bounds.

The actuator is the numpy actuator in `rate_plant`. `ultimate` is the bound of |s| for the control law (eq. 5): ds/dt =
-eta s - rho s/(|s| + eps) + d, where s is the sliding variable. For a disturbance with |d| <= D, it solves eta s + rho
s/(s + eps) = D, which is quadratic in s. The printed bound eps/(eta - 1) contains neither D nor rho and does not follow
from the law.
"""

import math

import numpy as np

from hystfmu.base import Array
from hystfmu.data import signals
from hystfmu.graph import Graph, Input, Node, Output, Value
from papers.rate_plant import RATE, actuator
from papers.statements import relay_sum
from papers.table import Row, Stated

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
    exact = ultimate(**SMC)
    given = "eta 5, eps 0.01, rho 1, |d| <= 1"
    literal = [simulated(**SMC, error=error) for error in (False, True)]
    note = "the printed eps/(eta - 1) does not follow from eq. 5; literal: simulated law; ours: exact formula"
    other = f"eps/(lambda (eta - 1)), lambda {LAM:g} 1/s: false as the bound of |s| is"
    return [
        ROW("bound_s", literal[0], exact, printed=printed(eta, eps), note=note, given=given),
        ROW("bound_e", literal[1], exact / LAM, printed=printed_error(eta, eps), note=other, given=given),
        ROW("simulated", ours=abs(literal[0] / exact - 1)),
    ]


LAM = 20.0  # slope of the sliding line in `simulated` (1/s), on which the bound does not depend


def printed(eta: float, eps: float) -> float:
    """Return the bound of |s| that the paper prints: eps / (eta - 1), for eta > 1."""
    return eps / (eta - 1)


def ultimate(eta: float, rho: float, eps: float, D: float) -> float:
    """Return the exact ultimate bound of |s| for a disturbance |d| <= D.

    eta is in 1/s. eps has the unit of measure of s. rho and D have the unit of measure of ds/dt.
    """
    b = eta * eps + rho - D
    root = math.sqrt(b * b + 4 * eta * D * eps)
    # positive root of eta s^2 + b s - D eps, in a form without cancellation
    return 2 * D * eps / (b + root) if b > 0 else (root - b) / (2 * eta)


def printed_error(eta: float, eps: float, lam: float = LAM) -> float:
    """Return the bound of |e| that the paper prints: eps / (lam (eta - 1)), for eta > 1."""
    return printed(eta, eps) / lam


def simulated(
    eta: float, rho: float, eps: float, D: float, h: float = 1e-4, seconds: float = 4.0, error: bool = False
) -> float:
    """Simulate the block `sliding_mode` with the plant e'' = -LAM e' + u + d and d = D, and return the largest |s|.

    The largest value is that over the last quarter of the run. For this plant, ds/dt = u + d, as the paper assumes.
    `eta`, `rho` and `eps` are the parameters of the control law, `h` is the step (s), and `seconds` is the duration. If
    `error` is True, the largest |e| is returned instead.
    """
    control = {"lam": LAM, "eta": eta, "rho": rho, "epsilon": eps}
    plant: dict[str, Value] = {"b": [1.0], "a": [1.0, LAM, 0.0], "hold": "zoh"}
    nodes = [
        Node("plant", "transfer_function", {}, plant),
        Node("control", "sliding_mode", {}, control),
        Node("add", "sum", {"n": 2}),
    ]
    wires = [("plant.y", "control.y"), ("control.u", "add.u[1]"), ("add.y", "plant.u")]
    output = Output("e", "plant.y") if error else Output("s", "control.s")
    graph = Graph(nodes, wires, [Input("d", ("add.u[2]",))], [output])
    s = graph.run(np.full(round(seconds / h), D), h)
    return float(np.abs(s[-len(s) // 4 :]).max())
