"""The interval for new rows covers the share that it states, on records that had no part in it."""

from __future__ import annotations

import numpy as np
import plants
import pytest
from scipy.signal import lfilter

import hystfmu as hy
from hystfmu.base.arrays import Array
from hystfmu.data.signals import training
from hystfmu.model.accuracy import interval, width

DRAWS = np.random.SeedSequence()  # drawn anew in every run; a failure prints it


def stationary(rng: np.random.Generator, n: int, memory: float) -> Array:
    """Errors that forget their past within about `memory` rows."""
    return np.asarray(lfilter([1.0], [1.0, -np.exp(-1 / memory)], rng.normal(size=n + 1000))[1000:])


def covered(given: Array, other: Array) -> float:
    """The share of other errors inside the interval that given ones make."""
    found = interval(given)
    assert found is not None
    return float(np.mean(np.abs(other) <= found.half_width))


def enough(shares: list[float]) -> None:
    """The mean of the shares is 95 % or more, within three standard errors of these draws."""
    mean, error = np.mean(shares), np.std(shares, ddof=1) / np.sqrt(len(shares))
    assert mean >= 0.95 - 3 * error, (mean, error, DRAWS.entropy)


def in_order(n: int, share: float) -> int:
    """The place of the least of n sizes that a share of n + 1 does not exceed: rows as if they were independent."""
    return int(np.ceil((n + 1) * share)) - 1


@pytest.mark.parametrize("memory", [1, 10, 60])
def test_the_stated_share_of_another_record_is_inside(memory: int) -> None:
    rng = np.random.default_rng(DRAWS)
    pairs = [(stationary(rng, 1000, memory), stationary(rng, 1000, memory)) for _ in range(60)]
    enough([covered(given, other) for given, other in pairs])


def test_rows_are_not_counted_as_independent() -> None:
    """A record of seven memories: the quantile of its rows covers too little, the interval over blocks does not."""
    rng = np.random.default_rng(5)
    pairs = [(stationary(rng, 700, 100), stationary(rng, 700, 100)) for _ in range(200)]
    enough([covered(given, other) for given, other in pairs])
    alone = [np.mean(np.abs(b) <= np.sort(np.abs(a))[in_order(len(a), 0.95)]) for a, b in pairs]
    assert np.mean(alone) < 0.93


def fitted_shares(seeds: int) -> list[float]:
    """Fit plays to a plant with noise in the middle half of a record; the errors of another record inside."""
    shares = []
    for seed in np.random.default_rng(DRAWS).integers(2**31, size=seeds).tolist():
        rng = np.random.default_rng(seed)
        records = [training(60, seed + k, 0.05) for k in (0, 1)]
        y = [plants.prandtl_ishlinskii(u) for u in records]
        noise = 2e-3 * np.ptp(y[0])
        y = [v + noise * stationary(rng, len(v), 5) for v in y]
        n = len(y[0])
        data = hy.Dataset(np.arange(n) * 1e-3, records[0], y[0], train=(0, n // 2))
        model = hy.fit(data, "prandtl_ishlinskii", N=20)
        errors = [v - model.predict(u, 1e-3) for u, v in zip(records, y, strict=True)]
        shares.append(covered(errors[0][n // 2 :], errors[1]))
    return shares


def test_the_rows_of_another_record_of_a_fit_are_inside() -> None:
    enough(fitted_shares(6))


@pytest.mark.stress
def test_the_rows_of_another_record_of_many_fits_are_inside() -> None:
    enough(fitted_shares(100))


def test_the_interval_says_where_it_does_not_hold() -> None:
    e = np.random.default_rng(2).normal(size=4000)
    e[1000:1200] *= 10  # a block of its own
    found = interval(e)
    assert found is not None
    assert found.lowest < 50
    assert 95 < found.coverage < 99
    assert (found.rows, found.blocks) == (4000, 40)
    assert interval(e[:79]) is None


def test_the_width_counts_one_more_block_of_infinite_errors() -> None:
    """With 19 blocks all errors are inside; with 39, 97.4 % of them, a long block counting as much as a short one."""
    assert width([np.array([1.0, k]) for k in range(2, 21)]) == 20
    blocks = [np.arange(1.0, 41.0) for _ in range(38)]
    assert width([*blocks, np.full(1000, 0.5)]) == 39  # (38 * 39/40 + 1)/40 = 0.951 and with 38: 0.928
    assert width([*blocks, np.full(2, 99.0)]) == 40  # 38 * 40/40 / 40 = 0.95
