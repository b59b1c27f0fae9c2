"""Accuracy of a model: errors on one record and on every held-out signal."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from hystfmu.base.arrays import Array
from hystfmu.data.signals import held_out
from hystfmu.model.coverage import clamped
from hystfmu.model.model import Model

__all__ = ["errors", "held_out_table", "rms"]


def rms(e: Array) -> float:
    """Return the root mean square of e (n,), in its unit of measure."""
    return float(np.sqrt(np.mean(e**2)))


def errors(y: Array, measured: Array, span: float) -> dict[str, float]:
    """Compute RMS and largest error, absolute and in percent of `span`.

    Parameters
    ----------
    y, measured : array, shape (n,)
        Output of the model, and the measured output.
    span : float
        100 % of full scale, in the unit of measure of y.

    Returns
    -------
    dict of str to float
        ``rms``, ``max``, ``rms_percent``, ``max_percent``.
    """
    e = y - measured
    typical, most = rms(e), float(np.abs(e).max())
    return {"rms": typical, "max": most, "rms_percent": 100 * typical / span, "max_percent": 100 * most / span}


def held_out_table(
    model: Model, plant: Callable[[Array], Array], span: float, signals: dict[str, Array] | None = None
) -> dict[str, dict[str, float]]:
    """Compute the errors of a model against a plant on every held-out signal.

    Parameters
    ----------
    model : Model
        Model; it runs free from a fresh start.
    plant : function
        Returns the true output (n,) for an input (n,), from a fresh start.
    span : float
        100 % of full scale: the span of y in the training data.
    signals : dict of str to array, optional
        Held-out signals; default `held_out()`.

    Returns
    -------
    dict of str to dict
        For each signal the errors of `errors`, and `clamped_percent`, the share of rows at which the limits of a
        network act (%).
    """
    h = 1.0 if model.step is None else model.step
    return {
        name: {
            **errors(model.predict(u), plant(u), span),
            "clamped_percent": 100 * float(np.mean(clamped(model.graph, u, h))),
        }
        for name, u in (held_out() if signals is None else signals).items()
    }
