"""Excitation and held-out signals; a model is never scored on its training signal alone.

All generators are seeded and independent of the C core.  Values lie in [-1, 1] times `amplitude` unless stated.

>>> import hystfmu as hy
>>> sorted(hy.signals.held_out())
['fast decay', 'minor loops', 'nested reversals', 'slow decay', 'two tones']
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from hystfmu.base.arrays import Array
from hystfmu.base.calls import checked

__all__ = ["decaying_sine", "held_out", "minor_loops", "nested_reversals", "ramps", "training", "two_tones"]


@checked
def decaying_sine(
    cycles: float = 10.0, decay: float = 0.1, samples: int = 200, amplitude: float = 1.0, offset: float = 0.0
) -> Array:
    """Return offset + amplitude e^(-decay c) sin(2 pi c), shape (n,); c is the number of cycles of `samples` rows."""
    c = np.arange(round(cycles * samples) + 1) / samples
    return np.asarray(offset + amplitude * np.exp(-decay * c) * np.sin(2 * np.pi * c))


@checked
def two_tones(cycles: float = 12.0, ratio: float = 3.7, share: float = 0.4, samples: int = 200) -> Array:
    """Return the sum of a sine of amplitude 1 - share and a sine `ratio` times as fast of amplitude share; shape (n,).

    The minor loops of the signal drift. Its length is `cycles` periods of the slow sine, of `samples` rows each.
    """
    c = np.arange(round(cycles * samples) + 1) / samples
    return np.asarray((1 - share) * np.sin(2 * np.pi * c) + share * np.sin(2 * np.pi * ratio * c))


@checked
def nested_reversals(count: int = 100, seed: int = 0, step: float = 0.01) -> Array:
    """Return a path of alternating ramps with steps of about `step`, shape (n,).

    The `count` reversals are drawn from `seed`, uniformly between the last reversal and +-1. Half of the reversals lie
    inside the last loop, so that the loops are nested. The path starts at 0.
    """
    rng = np.random.default_rng(seed)
    levels = [0.0]
    up = bool(rng.random() < 0.5)
    for _ in range(count):
        levels.append(float(rng.uniform(levels[-1], 1.0) if up else rng.uniform(-1.0, levels[-1])))
        up = not up
    return ramps(levels, step)


@checked
def ramps(levels: list[float], step: float = 0.01) -> Array:
    """Return a path through `levels`, shape (n,), with equal steps of at most `step` on each ramp."""
    parts = [np.array(levels[:1])]
    for a, b in pairwise(levels):
        parts.append(np.linspace(a, b, max(2, int(np.ceil(abs(b - a) / step))) + 1)[1:])
    return np.concatenate(parts)


@checked
def minor_loops(loops: int = 6, amplitude: float = 0.25, samples: int = 120) -> Array:
    """Return a ramp from 0 to -1, then three cycles of a small sine at each of `loops` rising offsets; shape (n,).

    The last offset is 1 - amplitude. A cycle has `samples` rows.
    """
    c = np.arange(1, 3 * samples + 1) / samples
    parts = [np.linspace(0.0, -1.0, samples)]
    for centre in np.linspace(-1 + amplitude, 1 - amplitude, loops):
        parts.append(np.linspace(parts[-1][-1], centre, samples // 2)[1:])
        parts.append(centre + amplitude * np.sin(2 * np.pi * c))
    return np.concatenate(parts)


@checked
def held_out(seed: int = 1000) -> dict[str, Array]:
    """Return the held-out signals of every table by name: other decay rates, two tones, nested reversals, minor loops.

    Parameters
    ----------
    seed : int
        Seed of the random reversals; it must differ from the seed of the training data.

    Returns
    -------
    dict of str to array, shape (n,)
    """
    return {
        "slow decay": decaying_sine(14, 0.04),
        "fast decay": decaying_sine(8, 0.25),
        "two tones": two_tones(),
        "nested reversals": nested_reversals(120, seed),
        "minor loops": minor_loops(),
    }


@checked
def training(count: int = 150, seed: int = 1, step: float = 0.01) -> Array:
    """Return an informative excitation in [-1, 1], shape (n,): a full loop, then random nested reversals.

    There are `count` reversals, drawn from `seed`, with ramps of about `step` per row (`nested_reversals`). At least 60
    reversals identify a model well.
    """
    full = ramps([0.0, 1.0, -1.0, 1.0, -1.0, 0.0], step)
    return np.concatenate([full, nested_reversals(count, seed, step)[1:]])
