"""Validation.BaseClasses.TestSignal, written once more in numpy, also at a finer grid than that of a simulation."""

import library
import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def signal_form(t: Array) -> Array:
    """The signal of amplitude 1 at the times t."""
    pieces = [
        np.sin(2 * np.pi * 10 * t),
        0.6 * np.sin(2 * np.pi * 10 * (t - 0.2)) + 0.35 * np.sin(2 * np.pi * 40 * (t - 0.2)),
        np.exp(-6 * (t - 0.5)) * np.sin(2 * np.pi * 30 * (t - 0.5)),
        np.interp(
            t, [0.8, 0.85, 0.9, 0.92, 0.95, 1.0, 1.001, 1.05, 1.051], [0, 0.7, 0.7, 0.9, 0.9, 0.2, -0.8, -0.8, 0.6]
        ),
        0.6 * np.cos(2 * np.pi * (t - 1.1) / 0.15) + 0.01 * np.sin(2 * np.pi * 120 * (t - 1.1)),
    ]
    return np.choose(np.searchsorted([0.2, 0.5, 0.8, 1.1], t, side="right"), pieces)


def fine(name: str, t: Array, h: float) -> tuple[Array, NDArray[np.int64], float]:
    """The input of a Validation model at a grid of step h, the places of the times t in it, and h.

    The value that is held over a step is the one of its middle: second order for the linear lags.
    """
    keep = np.rint(t / h).astype(np.int64)
    tested = library.classes()[name].tree.symbols["tested"]
    creeps = str(tested.type).endswith("Creep")
    signal = library.classes()[name].tree.symbols["signal"]
    v = {k: library.evaluate(e, {}) for k, e in library.modifiers(signal.class_modification).items()}
    grid = np.maximum(h * (np.arange(keep[-1] + 1) - (0.5 if creeps else 0.0)), 0.0)
    return v["offset"] + v["amplitude"] * signal_form(grid), keep, h
