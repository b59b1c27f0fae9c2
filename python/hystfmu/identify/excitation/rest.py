"""Estimation of the initial memory of a device from a record.

Before the first row, the input of a device often increases from 0 V, or from a bias, to the operating point. The plays
of the device are then at one side of their dead bands. A model that starts at rest at the first input has centred
plays, so its output has an error until a full swing wipes out the initial memory. Therefore sums of plays that were at
rest at different inputs are fitted. An input other than the first one is chosen only if its fit is clearly better. A
cubic static nonlinearity follows the plays. Plays alone have a large error if the device is nonlinear, and the initial
memory then changes this error only little.
"""

from typing import Any

import numpy as np
from scipy.optimize import minimize_scalar

from hystfmu.data import Dataset
from hystfmu.identify.catalogue import method, options
from hystfmu.identify.features.plays import plays, thresholds
from hystfmu.identify.solvers.nonnegative import nonnegative
from hystfmu.model import rms

PLAYS, ROWS = 20, 3000  # number of plays, and about the number of rows, of the compared fits
CLEARLY = 2.0  # required ratio of the errors with the first input and with another input
EQUALLY = 1.02  # ratio of errors up to which two inputs count as equally good
LEAST = 0.1  # required reduction of the error (% of the span)
MOST = 2.0  # error (% of the span) above which plays do not describe the device, so that its memory is not estimated
BENDS = 2  # number of iterations for the static nonlinearity; with one iteration, one bias in forty is not found
POWERS = 3  # number of coefficients of the static nonlinearity: offset, square and cube
STEPS = 16  # number of intervals of the grid over the range of the input


def rest(data: Dataset) -> float:
    """Return the input at which the device was at rest before row 0.

    Parameters
    ----------
    data : Dataset
        Data with a measured output. For several records, or for data with covariates, the result is the first input.

    Returns
    -------
    float
        Input in the unit of measure of u. If several inputs are equally good, the result is the first input of the
        record, 0, the lower end, or the upper end of the range, in this order of preference. If the error of the plays
        is too large, the result is the first input.
    """
    first = float(data.u[0])
    if len(data.starts) > 1 or data.covariates:
        return first
    least, at_first = LEAST / 100 * data.span, _error(data, first)
    u = data.u[: data.train.stop]
    # from the row at which the input has reached both ends of its range, no play remembers row 0
    wiped = max(int(np.argmax(u)), int(np.argmin(u)))
    if at_first <= least or at_first <= CLEARLY * _error(data, first, begin=wiped):
        return first
    u = data.u[data.train]
    grid = np.linspace(float(u.min()), float(u.max()), STEPS + 1)
    likely = [0.0, float(grid[0]), float(grid[-1])]
    errors = {v: _error(data, v) for v in [*likely, *map(float, grid[1:-1])]} | {first: at_first}
    near, step = min(errors, key=errors.__getitem__), float(grid[1] - grid[0])
    # the exact minimum is needed: if it lies between two grid points, their errors can be much larger
    found = minimize_scalar(
        lambda v: _error(data, float(v)),
        bounds=(near - step, near + step),
        method="bounded",
        options={"xatol": step / 50},
    )
    best = min(float(found.fun), errors[near])
    if best > MOST / 100 * data.span or at_first <= CLEARLY * best or at_first - best <= least:
        return first
    # trap: for butterfly loops, a second iteration can find an input that is wrongly better; the first iteration shows
    # this error
    once = [_error(data, v, 1) for v in (first, float(found.x))]
    if once[0] <= CLEARLY * once[1]:
        return first
    equal = [v for v in likely if errors[v] <= EQUALLY * best]
    return equal[0] if equal else float(found.x)


def places_memory(key: str) -> bool:
    """Return whether the kind `key` has an option for its memory before row 0 that its fit does not estimate itself."""
    kind = method(key)
    return not kind.own_memory and any(
        o.name == "u0" or (o.name == "start" and {"low", "high"} <= {*o.choices}) for o in kind.options
    )


def remembered(key: str, u0: float, data: Dataset) -> dict[str, Any]:
    """Return the options of a kind of model that set its initial memory to rest at the input u0.

    Parameters
    ----------
    key : str
        Key of the kind.
    u0 : float
        Input at which the device was at rest (unit of measure of u).
    data : Dataset
        Data to which the model is fitted.

    Returns
    -------
    dict
        The option ``u0``, or the option ``start`` with the value ``low`` or ``high`` if u0 is an end of the range. The
        dict is empty if u0 is the first input, which is the default of every kind, or if the kind has no such option.
    """
    if u0 == float(data.u[0]) or not places_memory(key):
        return {}
    if any(o.name == "u0" for o in options(key)):
        return {"u0": u0}
    u = data.u[data.train]
    return {"start": "low"} if u0 <= u.min() else {"start": "high"} if u0 >= u.max() else {}


def _error(data: Dataset, u0: float, bends: int = BENDS, begin: int = 0) -> float:
    """Fit plays that were at rest at u0, followed by a cubic nonlinearity; return the RMS error.

    The fit is iterative. The result is the smallest error of `bends` iterations. With `begin`, only the rows from this
    row are fitted, and the errors on the rows before it count as 0. If the plays then do not depend on u0, the result
    is smaller than the error on all rows for any u0.
    """
    rows = np.arange(len(data.u))[data.counted]
    rows = rows[:: max(1, len(rows) // ROWS)]
    total = len(rows)
    rows = rows[rows >= begin]
    columns = np.column_stack([data.u, plays(data.u, thresholds(data.u[data.train], PLAYS), u0)])[rows]
    if len(rows) <= columns.shape[1] + POWERS:
        return 0.0  # as many coefficients as rows leave no error
    y, one = data.y[rows], np.ones(len(rows))
    w, _ = nonnegative(columns, y, one[:, None])
    found = []
    for _ in range(bends):
        v = (columns @ w) / data.span  # input of the static nonlinearity; each iteration improves it
        free = np.column_stack([one, v**2, v**3])  # `POWERS` columns
        w, q = nonnegative(columns, y, free)
        found.append(rms(y - columns @ w - free @ q))
    return min(found) * float(np.sqrt(len(rows) / total))
