"""Signals that excite a device for a fit, and held-out signals that test the model.

The signals are computed from seeds, without the C core. Values lie in [-1, 1], unless another range is stated.

>>> import hystfmu as hy
>>> sorted(hy.signals.held_out())
['fast decay', 'minor loops', 'nested reversals', 'slow decay', 'two tones']
"""

from itertools import pairwise

import numpy as np

from hystfmu.base import Array, checked

__all__ = ["decaying_sine", "held_out", "minor_loops", "nested_reversals", "ramps", "training", "two_tones"]


@checked
def decaying_sine(
    cycles: float = 10.0, decay: float = 0.1, samples: int = 200, amplitude: float = 1.0, offset: float = 0.0
) -> Array:
    """Return the signal offset + amplitude e^(-decay c) sin(2 pi c), shape (n,).

    The variable c counts the cycles, from 0 to `cycles`. Each cycle has `samples` rows.
    """
    c = np.arange(round(cycles * samples) + 1) / samples
    return np.asarray(offset + amplitude * np.exp(-decay * c) * np.sin(2 * np.pi * c))


@checked
def two_tones(cycles: float = 12.0, ratio: float = 3.7, share: float = 0.4, samples: int = 200) -> Array:
    """Return the sum of two sines, shape (n,).

    The slow sine has the amplitude 1 - share. The fast sine has the amplitude `share`, and `ratio` times the frequency
    of the slow sine. So the signal has minor loops at changing offsets. Its length is `cycles` periods of the slow
    sine, of `samples` rows each.
    """
    c = np.arange(round(cycles * samples) + 1) / samples
    return np.asarray((1 - share) * np.sin(2 * np.pi * c) + share * np.sin(2 * np.pi * ratio * c))


@checked
def nested_reversals(count: int = 100, seed: int = 0, step: float = 0.01) -> Array:
    """Return a signal of alternating ramps up and down with steps of about `step`, shape (n,).

    The signal starts at 0. Its `count` reversals are random. The value at each reversal is uniformly distributed
    between the last reversal and the end of the range: +1 for a ramp up, -1 for a ramp down. So many loops are nested.
    The number `seed` initialises the random generator.
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
    """Return a signal (n,) of ramps between the given levels, with equal steps of at most `step` on each ramp."""
    parts = [np.array(levels[:1])]
    for a, b in pairwise(levels):
        parts.append(np.linspace(a, b, max(2, int(np.ceil(abs(b - a) / step))) + 1)[1:])
    return np.concatenate(parts)


@checked
def minor_loops(loops: int = 6, amplitude: float = 0.25, samples: int = 120) -> Array:
    """Return a ramp from 0 to -1, followed by three cycles of a small sine at each of `loops` offsets; shape (n,).

    The offsets increase up to 1 - amplitude. A cycle has `samples` rows.
    """
    c = np.arange(1, 3 * samples + 1) / samples
    parts = [np.linspace(0.0, -1.0, samples)]
    for centre in np.linspace(-1 + amplitude, 1 - amplitude, loops):
        parts.append(np.linspace(parts[-1][-1], centre, samples // 2)[1:])
        parts.append(centre + amplitude * np.sin(2 * np.pi * c))
    return np.concatenate(parts)


@checked
def held_out(seed: int = 1000) -> dict[str, Array]:
    """Return the held-out signals that test a model, by name, with values in [-1, 1].

    Parameters
    ----------
    seed : int
        Seed of the random reversals. It must differ from the seed of the training data.

    Returns
    -------
    dict of str to array, shape (n,)
        Decaying sines, two tones, nested reversals and minor loops.
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
    """Return a training signal in [-1, 1], shape (n,), which consists of a full loop and random nested reversals.

    The signal has `count` random reversals and steps of about `step` (see `nested_reversals`). The same `seed` gives
    the same reversals. A good model needs at least 60 reversals.
    """
    full = ramps([0.0, 1.0, -1.0, 1.0, -1.0, 0.0], step)
    return np.concatenate([full, nested_reversals(count, seed, step)[1:]])
