"""Magnetostrictive actuator in numpy: strain proportional to the squared magnetisation (Jiles-Atherton model).

The equations are M = (1 - c) M_i + c M_an, dM_i/dH = (M_an - M_i)/(k sgn(dH) - alpha (M_an - M_i)), M_an = coth(H_e/a)
- a/H_e and H_e = H + alpha M (Jiles & Atherton 1986). M_i changes only if the domain wall moves in the direction of the
field. The strain y is proportional to M^2 and is measured from the bias field. Unlike the synthetic piezo stack, this
actuator is asymmetric and is not a sum of plays.
"""

from __future__ import annotations

import math

import numpy as np

from hystfmu.base.arrays import Array

# parameters a, alpha, k and c; fields and M are relative to saturation
SHAPE, COUPLING, PINNING, REVERSIBLE = 0.3, 0.05, 0.25, 0.1
FINER = 10  # number of integration steps in a sample
WAY_IN = 200  # number of samples from field 0 to the bias field


def strain(x: Array, bias: float) -> Array:
    """Return the strain (n,) relative to its first value, for the field bias + x, where x has shape (n,).

    The field first increases from 0 to bias + x[0] along the virgin curve.
    """
    n = len(x)
    field = np.concatenate([np.linspace(0, bias + x[0], WAY_IN, endpoint=False), bias + x])
    fine = np.interp(np.arange((len(field) - 1) * FINER + 1) / FINER, np.arange(len(field)), field)
    out = np.zeros(len(fine))
    wall = m = 0.0
    for i, (before, now) in enumerate(zip(fine[:-1].tolist(), fine[1:].tolist(), strict=True), 1):
        away = _langevin(((before + now) / 2 + COUPLING * m) / SHAPE) - wall
        step = now - before
        if away * step > 0:  # otherwise the domain wall does not move
            wall += away / (math.copysign(PINNING, step) - COUPLING * away) * step
        m = (1 - REVERSIBLE) * wall + REVERSIBLE * (wall + away)
        out[i] = m
    y = out[::FINER][-n:] ** 2
    return np.asarray(y - y[0])


def _langevin(x: float) -> float:
    return x / 3 if abs(x) < 1e-4 else 1 / math.tanh(x) - 1 / x
