"""Where the memory rested before row 0, as the record shows.

A device that was raised from 0 V to its working point before the first row has plays that lean to one side.  At rest at
the first input they would stand in the middle, and the model would miss every row until a full swing has wiped them
out.  Plays from each of a few inputs are fitted in closed form; the record speaks where one of them is clearly better.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from hystfmu.data import Dataset
from hystfmu.identify.catalogue import options
from hystfmu.identify.features.plays import plays, thresholds
from hystfmu.identify.solvers.nonnegative import nonnegative
from hystfmu.model.accuracy import rms

PLAYS, ROWS = 20, 3000  # of the fits that are compared
CLEARLY = 2.0  # times the error
LEAST = 0.5  # % of the span: a smaller gain is left alone


def rest(data: Dataset) -> float:
    """Return the input at which the memory rested: the first of the record, 0, or the least or largest of the record.

    Parameters
    ----------
    data : Dataset
        With a measured output.  Of several records each rests at its first input, as does one with further inputs.

    Returns
    -------
    float
        In the unit of measure of u.
    """
    first = float(data.u[0])
    if len(data.starts) > 1 or data.covariates:
        return first
    u = data.u[data.train]
    others = [v for v in (0.0, float(u.min()), float(u.max())) if v != first]
    errors = {v: _error(data, v) for v in (first, *others)}
    best = min(others, key=errors.__getitem__)
    gain = errors[first] - errors[best]
    return best if errors[first] > CLEARLY * errors[best] and gain > LEAST / 100 * data.span else first


def places_memory(key: str) -> bool:
    """Whether a kind of model has an option for its memory before row 0."""
    return any(o.name == "u0" or (o.name == "start" and {"low", "high"} <= {*o.choices}) for o in options(key))


def remembered(key: str, u0: float, data: Dataset) -> dict[str, Any]:
    """Return the options of a kind of model for a memory that rested at u0.

    Parameters
    ----------
    key : str
        Of the kind.
    u0 : float
        Input at which it rested (unit of measure of u).
    data : Dataset

    Returns
    -------
    dict
        ``u0``, or ``start`` = low or high; empty for the first input, the default, and for a kind without such options.
    """
    first = float(data.u[0])
    if u0 == first or not places_memory(key):
        return {}
    if any(o.name == "u0" for o in options(key)):
        return {"u0": u0}
    return {"start": "low" if u0 < first else "high"}


def _error(data: Dataset, u0: float) -> float:
    """Return the RMS error of plays that rest at u0 (unit of measure of y)."""
    rows = np.arange(len(data.u))[data.counted]
    rows = rows[:: max(1, len(rows) // ROWS)]
    columns = np.column_stack([data.u, plays(data.u, thresholds(data.u[data.train], PLAYS), u0)])[rows]
    w, (offset,) = nonnegative(columns, data.y[rows], np.ones((len(rows), 1)))
    return rms(data.y[rows] - columns @ w - offset)
