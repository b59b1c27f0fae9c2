"""Fit of an operator to a polynomial of y, fitted with it, so that a nonlinear readout does not distort the operator.

An operator h followed by a network satisfies y = f(x, h), with f mostly a static nonlinearity of h.  If q = f^-1 is
near a polynomial, h = y + q_2 P_2(y) + q_3 P_3(y) + .. is linear in the weights of h and in the q: one least-squares
problem gives both.  With covariates the q are linear in them.
"""

from __future__ import annotations

import numpy as np

from hystfmu.base.arrays import Array
from hystfmu.identify.options import Option

OPTION = Option("bend", 5, 1, 20, text="degree of the polynomial of y that the operator is fitted to; 1: y itself")


def straightened(x: Array, y: Array, degree: int, covariates: Array | None = None) -> tuple[Array, Array]:
    """Return the target of an operator that rises with x, up to a combination of free columns.

    Parameters
    ----------
    x, y : array, shape (n,)
        Input and measured output.
    degree : int
        Degree of the polynomial of y.
    covariates : array, shape (n, m), optional

    Returns
    -------
    v : array, shape (n,)
        y scaled to [-1, 1], negated if y falls as x rises.
    free : array, shape (n, degree + m (degree + 1))
        Legendre polynomials 1, P_2(v), .., P_degree(v), and all of them times each covariate, with free weights.
    """
    v = (2 * y - y.max() - y.min()) / np.ptp(y)
    v = np.asarray(v * np.copysign(1.0, float(np.dot(x - x.mean(), v))))
    basis = np.polynomial.legendre.legvander(v, degree)
    if covariates is None:
        covariates = np.zeros((len(v), 0))
    middle, half = (covariates.max(axis=0) + covariates.min(axis=0)) / 2, np.ptp(covariates, axis=0) / 2
    bilinear = [basis * c[:, None] for c in ((covariates - middle) / half).T]
    return v, np.hstack([np.delete(basis, 1, axis=1), *bilinear])
