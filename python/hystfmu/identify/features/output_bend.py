"""Fit an operator not to y but to a polynomial of y that is fitted with it: a bent readout then does not distort it.

An operator h with a network after it has to satisfy y = f(x, h), f mostly a bend.  With q = f^-1 near a polynomial,
h = y + q_2 P_2(y) + q_3 P_3(y) + .. is linear in the weights of h and in the q: one least-squares problem for both.
"""

from __future__ import annotations

import numpy as np

from hystfmu.base.arrays import Array
from hystfmu.identify.options import Option

OPTION = Option("bend", 5, 1, 20, text="degree of the polynomial of y that the operator is fitted to; 1: y itself")


def straightened(x: Array, y: Array, degree: int) -> tuple[Array, Array]:
    """What an operator that rises with x is to follow, up to a combination of free columns.

    Parameters
    ----------
    x, y : array, shape (n,)
        Input and measured output.
    degree : int
        Of the polynomial of y.

    Returns
    -------
    v : array, shape (n,)
        y scaled to [-1, 1]; negated where y falls as x rises.
    free : array, shape (n, degree)
        Columns 1, P_2(v), .., P_degree(v) (Legendre) whose weights are free.
    """
    v = (2 * y - y.max() - y.min()) / np.ptp(y)
    v = np.asarray(v * np.copysign(1.0, float(np.dot(x - x.mean(), v))))
    return v, np.delete(np.polynomial.legendre.legvander(v, degree), 1, axis=1)
