"""Kinds of signals that a record does not contain. The error of a model on the record is not valid for these signals.

The state at a row consists of the input and of the outputs of `PLAYS` plays, which represent the memory. To test a kind
of signal, such a signal is generated over the range of the record. If more than a share `FEW` of its states have no
near state in the record, the record does not contain this kind of signal. A record with one speed or one frequency is
not informative about other speeds or frequencies.
"""

import numpy as np

from hystfmu.base import Array
from hystfmu.data import Dataset
from hystfmu.data.signals import held_out, ramps
from hystfmu.identify.excitation import minor_loops
from hystfmu.identify.features.plays import plays
from hystfmu.model.coverage import near

PLAYS = 2
NEAR = 0.05  # largest distance of a near state: RMS over the elements of the state, relative to the range of the input
FEW = 0.05
MOST_ROWS = 5000  # maximum number of rows of a record or of a signal; more rows are thinned evenly
KINDS = {
    "slow decay": "decaying oscillations",
    "fast decay": "decaying oscillations",
    "two tones": "sums of tones",
    "nested reversals": "nested reversals",
    "minor loops": "minor loops at several levels",
}
SPEEDS = "other speeds"


def kinds_not_shown(data: Dataset) -> tuple[str, ...]:
    """Return the kinds of signals that the training rows do not contain.

    Parameters
    ----------
    data : Dataset
        Record of a device.

    Returns
    -------
    tuple of str
        Elements of `KINDS`, in the same order.
    """
    u = data.u[data.train]
    lo, hi = float(u.min()), float(u.max())
    middle, half = (lo + hi) / 2, (hi - lo) / 2
    found = []
    for name, signal in held_out().items():
        way_in = ramps([(float(data.u[0]) - middle) / half, float(signal[0])])[:-1]
        if new_states(data, middle + half * np.concatenate([way_in, signal]), len(way_in)) > FEW:
            found.append(KINDS[name])
    return tuple(dict.fromkeys(found))


def new_states(data: Dataset, u: Array, first: int = 0) -> float:
    """Return the share of the rows of u (n,), from row `first`, whose state has no near state in the record `data`."""
    span = float(np.ptp(data.u[data.train]))
    r = span / 2 * np.arange(1, PLAYS + 1) / (PLAYS + 1)

    def states(v: Array) -> Array:
        return np.asarray(np.column_stack([v, plays(v, r, float(v[0]))]) / (span * np.sqrt(PLAYS + 1)))

    return float(np.mean(~near(data.along(states)[data.train], states(u)[first:], NEAR, MOST_ROWS)))


def one_speed(data: Dataset) -> bool:
    """Return whether all half cycles of all records have about the same mean speed, or about the same duration."""
    return min(minor_loops.spreads(*(data.u[r] for r in data.records))) <= minor_loops.SPEEDS
