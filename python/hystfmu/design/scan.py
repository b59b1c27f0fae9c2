"""Feed-forward of a scan: the tones of a triangle with rounded turns, passed through the inverse of linear dynamics.

A lightly damped stage cannot be inverted sample by sample without exciting it, but a periodic reference has a few tones
below its resonances.  Their inverse is exact in the steady state, with the delay and the hold of the command.
"""

from __future__ import annotations

import numpy as np

from hystfmu.base.arrays import Array
from hystfmu.base.errors import InputError
from hystfmu.design.linear import linearise
from hystfmu.graph import Graph
from hystfmu.model import Model


def scan_harmonics(n: Array, turn: float) -> Array:
    """Return the amplitudes of sin(2 pi n f t) in the triangle of amplitude 1 of the block ``reference``.

    The acceleration of a triangle consists of impulses. With turns of stated length they become rectangles, whose
    spectrum is a sinc, and the speed of the lines increases.

    Parameters
    ----------
    n : array, shape (m,)
        Numbers of the harmonics, from 1 on; even ones are 0.
    turn : float
        Share of the period for the turns, as the parameter of the block.
    """
    return np.asarray(8 / (np.pi * n) ** 2 * np.sin(np.pi * n / 2) * np.sinc(n * turn / 2) / (1 - turn / 2))


def scan_feedforward(
    dynamics: Graph | Model,
    frequency: float,
    h: float,
    *,
    turn: float = 0.1,
    phase: float = 0.0,
    delay: float = 0.0,
    highest: float = 1200.0,
) -> dict[str, Array]:
    """Return the tones of the command that make linear dynamics follow a scan of amplitude 1.

    Parameters
    ----------
    dynamics : Graph or Model
        Continuous dynamics from the held command to the position.
    frequency : float
        Of the scan (Hz).
    h : float
        Step for which the command is held (s).
    turn, phase : float
        As the parameters of the block ``reference``; phase in rad.
    delay : float
        Steps between the command and the dynamics.
    highest : float
        Largest frequency of a tone (Hz), below the Nyquist rate and within the range of the known dynamics.

    Returns
    -------
    dict
        ``f`` (Hz), ``a``, ``ph`` (rad), shape (m,): parameters of the block ``reference`` with shape multisine.

    Raises
    ------
    InputError
        No tone below `highest`, or `highest` above the Nyquist rate.
    """
    if not frequency <= highest < 0.5 / h:
        raise InputError(f"The highest tone must lie from {frequency:g} to {0.5 / h:g} Hz. Got {highest:g} instead.")
    A, B, C, D = linearise(dynamics)
    n = np.arange(1.0, int(highest / frequency) + 1, 2)
    f, s = n * frequency, 2j * np.pi * n * frequency
    G = np.array([(C @ np.linalg.solve(x * np.eye(len(A)) - A, B) + D)[0, 0] for x in s])
    response = G * np.sinc(f * h) * np.exp(-s * h * (delay + 0.5))  # held for a step: half a step late
    b = scan_harmonics(n, turn)
    return {"f": f, "a": np.abs(b / response), "ph": n * phase + np.angle(b / response)}
