"""A transfer function discretised for one step: x_k = A x_(k-1) + b_new u_k + b_old u_(k-1), y_k = c x_k + d u_k."""

from __future__ import annotations

import numpy as np

from hystfmu.base.arrays import Array
from hystfmu.base.errors import InputError
from hystfmu.graph import Node

TEXTS = {
    "A": "state of the last step",
    "b_new": "new input",
    "b_old": "input before it",
    "c": "output row",
    "d": "direct term",
    "x_steady": "state at a first input of 1",
}


def state_space(node: Node, h: float) -> dict[str, Array]:
    """Return the matrices of a ``transfer_function`` for the step `h` (s), in the form of `Dynamics.StateSpace`.

    As in the unit, the input is held at its new value over the step (``hold = "zoh"``), or changes linearly from the
    last value to the new value ("foh"). One matrix exponential gives the integrals for the old and the new input (Van
    Loan, IEEE Trans. Autom. Control 23 (1978) 395-404).

    Returns
    -------
    dict
        A (n, n); b_new, b_old, c, x_steady (n,); d (1,).

    Raises
    ------
    InputError
        The block has an integrator and should begin in equilibrium.
    """
    from scipy.linalg import expm

    a, b = node.value("a"), node.value("b")
    n = len(a) - 1
    numerator = np.concatenate([np.zeros(n + 1 - len(b)), b]) / a[0]
    alpha = a[1:] / a[0]
    # controllable canonical form in the time scale of the last coefficient, which keeps the numbers near 1
    sigma = abs(alpha[-1]) ** (1 / n) if alpha[-1] != 0 else 1.0
    weights = sigma ** np.arange(1, n + 1)
    scaled = alpha / weights
    F = np.eye(n, k=1)
    F[-1] = -scaled[::-1]
    block = np.zeros((n + 2, n + 2))
    block[:n, :n], block[n - 1, n], block[n, n + 1] = F * sigma * h, sigma * h, 1.0
    E = expm(block)
    whole, ramp = E[:n, n], E[:n, n + 1]
    straight = node.value("hold")[0] == 1
    steady = np.zeros(n)
    if node.value("start")[0] == 1:
        if scaled[-1] == 0:
            raise InputError(f"block {node.name!r}: start = steady: an integrator has no steady state")
        steady[0] = 1 / scaled[-1]
    return {
        "A": E[:n, :n],
        "b_new": ramp if straight else whole,
        "b_old": whole - ramp if straight else np.zeros(n),
        "c": ((numerator[1:] - numerator[0] * alpha) / weights)[::-1],
        "d": numerator[:1],
        "x_steady": steady,
    }
