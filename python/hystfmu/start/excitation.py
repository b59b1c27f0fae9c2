"""Designs the input for the next measurement. It excites properties that the record does not show.

These properties are memory, rate dependence, creep and dynamics. The input does not exceed the range and the greatest
speed of the input in the record. It consists of these parts:

- a full loop,
- nested half cosines: minor loops of all sizes and levels, at all speeds down to a fifth of the greatest speed,
- a rest,
- tones from half the frequency of a loop to eight times this frequency,
- a chirp of small amplitude up to the required frequency.

Levels and phases are random. Several random inputs are compared. The input with the most additional information about
the model is used (function `information`).

J contains the derivatives of the output with respect to relative changes of each parameter, on the record and on the
new input. sigma is the error of the fit. The information is log det(I + J'J / sigma^2). Thus each direction of the
parameters contributes the factor by which its uncertainty decreases from 100 % (D-optimal design; Pukelsheim, Optimal
Design of Experiments, 1993). A direction that the record already determines contributes little. For a model with many
parameters, the information is another quantity: the share of the model states on the new input that are far from all
states in the record.
"""

from itertools import pairwise
from pathlib import Path

import numpy as np

from hystfmu.base import Array, InputError
from hystfmu.data import Dataset
from hystfmu.data.columns import write_csv
from hystfmu.data.signals import ramps
from hystfmu.identify.estimate.runs import Runs
from hystfmu.identify.excitation.not_shown import new_states
from hystfmu.model import Model

MOST = 80  # elements of parameters whose derivatives are taken
MOST_COUNTED = 2000  # of each run that count: more are thinned evenly
LEAST_NOISE = 1e-4  # of the span: a fit without noise


def information(model: Model, data: Dataset, u: Array, h: float) -> float:
    """Return the information about the model that an input u (m,) with the step h (s) adds to `data`.

    `data` is the record to which the model was fitted.
    """
    values = {
        f"{model.graph.nodes[p.node].name}.{p.var.name}": np.asarray(p.start, dtype=np.float64)
        for p in model.graph.ports
        if p.is_parameter and p.var.type == "real"
    }
    changes = [
        {name: np.where(np.arange(len(v)) == k, v, 0.0)}
        for name, v in values.items()
        for k in np.flatnonzero((v != 0) & (np.abs(v) < 1e300))
    ]
    if not 0 < len(changes) <= MOST or len(model.graph.inputs) > 1:
        return new_states(data, u)
    runs, sigma = Runs(model.graph), max(float(model.fit.get("rms", 0.0)), LEAST_NOISE * data.span)

    def scaled(v: Array, step: float) -> Array:
        """Return the derivatives of the output divided by sigma, on evenly selected rows, shape (rows, changes)."""
        rows = np.arange(len(v))[:: -(-len(v) // MOST_COUNTED)]
        j = runs.sensitivities(v.reshape(-1, 1), step, changes, rows)[1]
        return np.asarray(j * (np.sqrt(len(v) / len(rows)) / sigma))

    known = np.vstack([np.eye(len(changes)), *(scaled(data.u[rows], data.h) for rows in data.records)])
    gain = _log_det(np.vstack([known, scaled(u, h)])) - _log_det(known)
    return float(gain) if np.isfinite(gain) else new_states(data, u)


def _log_det(a: Array) -> float:
    """Return log det a'a, computed by a QR decomposition. The result is NaN if `a` is not finite."""
    if not np.isfinite(a).all():
        return float("nan")
    return float(2 * np.log(np.abs(np.diag(np.linalg.qr(a, mode="r")))).sum())


DRAWS = 6
REVERSALS, SLOWEST = 30, 0.2  # nested half cosines; least greatest speed of one, relative to that of the record
TONES, FAST, CYCLES = 16, 8.0, 8.0  # number, last frequency and duration, relative to the frequency and to a full loop
STEEP = 1.3  # the amplitude of a tone falls with its frequency to this power
LEAST_ROWS = 40  # between two ends of the range
REST = 0.1  # of the duration of the loops: creep
FASTEST = 0.1  # last frequency of the sweep, of the sample rate
FINE = 0.01  # amplitude of the sweep, of half the range: a lightly damped resonance amplifies it
ROWS = 5.0  # in a period of its last frequency, at least
PERIODS, WIDEST = 15.0, 100.0  # of its first frequency; last over first frequency, at most
MOST_ROWS = 200_000


def write_excitation(
    path: Path, data: Dataset, frequency: float, up_to: float | None = None, model: Model | None = None
) -> str:
    """Write the columns t and u of `excitation` to a CSV file.

    Return a line of text with the last frequency of the sweep, the number of rows, the duration and the sampling rate.
    The line also states whether the sampling rate is higher than in the record `data`. `frequency`, `up_to` and `model`
    are those of `excitation`.
    """
    u, h = excitation(data, frequency, up_to, model)
    unit = f" [{data.unit_u}]" if data.unit_u else ""
    t: Array = h * np.arange(len(u), dtype=np.float64)
    write_csv(path, {"t [s]": t, f"u{unit}": u})
    highest = FASTEST / h if up_to is None else up_to
    line = f"chirp up to {highest:.4g} Hz, {len(u)} rows, {len(u) * h:.4g} s at {1 / h:.6g} Hz"
    if h == data.h:
        return f"{line}; fit it together with this record"
    return f"{line}: the record has {1 / data.h:.6g} Hz, enough for a chirp up to {1 / (ROWS * data.h):.4g} Hz only"


def excitation(
    data: Dataset, frequency: float, up_to: float | None = None, model: Model | None = None
) -> tuple[Array, float]:
    """Design an input for the range, the step and the speed of a record.

    Parameters
    ----------
    data : Dataset
        Previous measurement.
    frequency : float
        Frequency of a full loop (Hz) at the speed of the record.
    up_to : float, optional
        Last frequency of the sweep (Hz). It should be at least twice the highest frequency of interest.
    model : Model, optional
        Model with one input, fitted to the record. With a model, the random input with the most information is
        selected; without a model, the first one.

    Returns
    -------
    u : array, shape (n,)
        Input in the unit of measure of u. The first and the last value are the first input of the record. If an input
        with the speed of the record needs more than `MOST_ROWS` rows, the input is faster than the record.
    h : float
        Step (s). It is the step of the record or an integer fraction of it, such that a period of `up_to` has at least
        `ROWS` rows.

    Raises
    ------
    InputError
        `up_to` is not positive.
    """
    if up_to is not None and not 0 < up_to < np.inf:
        raise InputError(f"The 'up_to' of an excitation must be a float in (0, inf). Got {up_to:g} instead.")
    finer = 1 if up_to is None else max(1, int(np.ceil(ROWS * up_to * data.h * (1 - 1e-9))))
    h = data.h / finer
    lo, hi = float(data.u.min()), float(data.u.max())
    middle, half = (lo + hi) / 2, (hi - lo) / 2
    start = (float(data.u[0]) - middle) / half
    cycle = 1 / (frequency * h)
    last = FASTEST if up_to is None else up_to * h
    moved = np.concatenate([np.abs(np.diff(data.u[rows])) for rows in data.records]) / half
    speed = max(float(np.percentile(moved, 99)) / finer, 4 / cycle)
    while _rows(cycle, last) > MOST_ROWS and cycle > LEAST_ROWS:  # a cut would not end at the start
        cycle, speed = cycle / 2, speed * 2
    drawn = [middle + half * _path(start, cycle, speed, last, seed) for seed in range(1, 1 + DRAWS)]
    if model is None:
        return np.asarray(drawn[0]), h
    return np.asarray(max(drawn, key=lambda u: information(model, data, u, h))), h


def _rows(cycle: float, last: float) -> float:
    """Return the approximate number of rows of the designed input."""
    return (1 + REST) * (REVERSALS + CYCLES + 3) * cycle + PERIODS * WIDEST / last


def _path(start: float, cycle: float, speed: float, last: float, seed: int) -> Array:
    """Return a path in [-1, 1] that starts and ends at `start`.

    `cycle` is the number of rows of a full loop. `speed` is the greatest change between two rows. `last` is the last
    frequency of the sweep in cycles per row.
    """
    rng = np.random.default_rng(seed)
    step = min(4 / cycle, 2 / LEAST_ROWS)
    full = ramps([start, 1.0, -1.0, 1.0], step)
    parts = [full, _nested(1.0, speed, rng)]
    parts.append(np.zeros(round(REST * sum(map(len, parts)))))
    parts.append(_tones(cycle, speed, rng))
    parts.append(_sweep(1 / cycle, last, speed))
    parts.append(ramps([float(np.concatenate(parts)[-1]), start], step)[1:])
    return np.concatenate(parts)


def _nested(first: float, speed: float, rng: np.random.Generator) -> Array:
    """Return half cosines from `first` to 0. Each level is random between the last level and an end of the range."""
    levels = [first]
    for k in range(REVERSALS):
        levels.append(float(rng.uniform(levels[-1], 1.0) if k % 2 else rng.uniform(-1.0, levels[-1])))
    levels.append(0.0)
    parts = []
    for a, b in pairwise(levels):
        fastest = speed * float(np.exp(rng.uniform(np.log(SLOWEST), 0.0)))
        rows = max(int(np.ceil(np.pi / 2 * abs(b - a) / fastest)), 2)
        parts.append(a + (b - a) * (1 - np.cos(np.pi * np.arange(1, rows + 1) / rows)) / 2)
    return np.concatenate(parts)


def _tones(cycle: float, speed: float, rng: np.random.Generator) -> Array:
    """Return a sum of sines that starts and ends at 0, with the largest amplitude that range and speed allow."""
    n = round(CYCLES * cycle)
    f = np.geomspace(0.5 / cycle, min(FAST / cycle, FASTEST), TONES)
    k = np.arange(n)
    v = (f**-STEEP) @ np.sin(2 * np.pi * (f[:, None] * k + rng.uniform(0, 1, (TONES, 1))))
    v *= np.minimum(1.0, np.minimum(k, n - 1 - k) / (n / 10))
    return np.asarray(v * min(1 / np.abs(v).max(), speed / np.abs(np.diff(v)).max()))


def _sweep(first: float, last: float, speed: float) -> Array:
    """Return a sine with exponentially increasing frequency (cycles per row). It changes by at most `speed` per row."""
    first = max(first, last / WIDEST)
    if first >= last:
        return np.zeros(0)
    n = round(PERIODS * WIDEST / last)
    rate = np.log(last / first) / n
    f = first * np.exp(rate * np.arange(n))
    return np.asarray(
        np.minimum(FINE, speed / (2 * np.pi * f)) * np.sin(2 * np.pi * first * np.expm1(rate * np.arange(n)) / rate)
    )
