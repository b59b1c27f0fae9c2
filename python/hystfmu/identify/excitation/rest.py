"""Estimate of the memory state before row 0 from the record.

Before the first row, the input of a device often rises from 0 V, or from a bias, to the working point. Then the plays
of the device are displaced to one side. A model that starts at rest at the first input has centred plays. Its output
has an error until a full swing wipes out the initial memory. Therefore sums of plays that start at rest at several
inputs are fitted in closed form. A start is chosen only if its fit is clearly better. The fit includes a cubic bend
after the plays, because the error of a nonlinear output would hide the improvement.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.optimize import minimize_scalar

from hystfmu.data import Dataset
from hystfmu.identify.catalogue import options
from hystfmu.identify.features.plays import plays, thresholds
from hystfmu.identify.solvers.nonnegative import nonnegative
from hystfmu.model.accuracy import rms

PLAYS, ROWS = 20, 3000  # of the fits that are compared
CLEARLY = 2.0  # times the error
EQUALLY = 1.02
LEAST = 0.1  # % of the span: a smaller gain is left alone
MOST = 2.0  # % of the span: plays that leave more do not describe the device, and say nothing about its memory
BENDS = 2  # fits of the bend: what a single one leaves hid one bias in forty
STEPS = 16  # of the range of the input, between its ends


def rest(data: Dataset) -> float:
    """Return the input at which the device was at rest before row 0.

    Parameters
    ----------
    data : Dataset
        Data with a measured output. With several records, or with further inputs, each record is assumed to start at
        rest at its first input.

    Returns
    -------
    float
        Input in the unit of measure of u. If several inputs explain the record equally well, it is the first input of
        the record, or 0, or the end of the range, in this order. If plays do not explain the record, it is the first
        input.
    """
    first = float(data.u[0])
    if len(data.starts) > 1 or data.covariates:
        return first
    least, at_first = LEAST / 100 * data.span, _error(data, first)
    if at_first <= least:
        return first
    u = data.u[data.train]
    grid = np.linspace(float(u.min()), float(u.max()), STEPS + 1)
    likely = [0.0, float(grid[0]), float(grid[-1])]
    errors = {v: _error(data, v) for v in [*likely, *map(float, grid[1:-1])]} | {first: at_first}
    near, step = min(errors, key=errors.__getitem__), float(grid[1] - grid[0])
    # the point itself: where first lies between two of the grid, these are hardly better
    found = minimize_scalar(
        lambda v: _error(data, float(v)),
        bounds=(near - step, near + step),
        method="bounded",
        options={"xatol": step / 50},
    )
    best = min(float(found.fun), errors[near])
    if best > MOST / 100 * data.span or at_first <= CLEARLY * best or at_first - best <= least:
        return first
    # trap: on butterflies a further fit of the bend finds one input that seems far better; the first fit tells
    once = [_error(data, v, 1) for v in (first, float(found.x))]
    if once[0] <= CLEARLY * once[1]:
        return first
    equal = [v for v in likely if errors[v] <= EQUALLY * best]
    return equal[0] if equal else float(found.x)


def places_memory(key: str) -> bool:
    """Return whether a kind of model has an option for its memory before row 0."""
    return any(o.name == "u0" or (o.name == "start" and {"low", "high"} <= {*o.choices}) for o in options(key))


def remembered(key: str, u0: float, data: Dataset) -> dict[str, Any]:
    """Return the options of a kind of model for a memory that was at rest at u0.

    Parameters
    ----------
    key : str
        Key of the kind.
    u0 : float
        Input at which the memory was at rest (unit of measure of u).
    data : Dataset

    Returns
    -------
    dict
        ``u0``, or ``start`` = low or high if u0 is that end of the range. Empty if u0 is the first input, which is the
        default, and for a kind without these options.
    """
    if u0 == float(data.u[0]) or not places_memory(key):
        return {}
    if any(o.name == "u0" for o in options(key)):
        return {"u0": u0}
    u = data.u[data.train]
    return {"start": "low"} if u0 <= u.min() else {"start": "high"} if u0 >= u.max() else {}


def _error(data: Dataset, u0: float, bends: int = BENDS) -> float:
    """Return the RMS error of plays from rest at u0, followed by a cubic bend that is refined `bends` times."""
    rows = np.arange(len(data.u))[data.counted]
    rows = rows[:: max(1, len(rows) // ROWS)]
    columns = np.column_stack([data.u, plays(data.u, thresholds(data.u[data.train], PLAYS), u0)])[rows]
    y, one = data.y[rows], np.ones(len(rows))
    w, _ = nonnegative(columns, y, one[:, None])
    found = []
    for _ in range(bends):
        v = (columns @ w) / data.span  # nearer to the input of the bend each time
        free = np.column_stack([one, v**2, v**3])
        w, q = nonnegative(columns, y, free)
        found.append(rms(y - columns @ w - free @ q))
    return min(found)
