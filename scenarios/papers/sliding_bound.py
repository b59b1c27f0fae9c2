"""Ultimate bound of |s| for the control law of Yu & Alici 2005 (eq. 5): ds/dt = -eta s - rho s/(|s| + eps) + d.

s is the sliding variable. For a disturbance with |d| <= D, the bound solves eta s + rho s/(s + eps) = D, which is
quadratic in s. The printed bound eps/(eta - 1) contains neither D nor rho and does not follow from the law.
"""

from __future__ import annotations

import math

import numpy as np

from hystfmu.graph import Graph, Input, Node, Output, Value

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
