"""A shorter record for the race: thinned where nothing is lost, else the part that shows most."""

import numpy as np
import pytest

from hystfmu import Dataset
from hystfmu.identify.cuts import beginning, shortened

H = 1e-3


def sine(n, cycles, late=0.0):
    t = np.arange(n) / n
    return (1 - late + late * t) * np.sin(2 * np.pi * cycles * t)


def test_a_short_record_and_several_stay_as_they_are():
    data = Dataset.from_signal(sine(3000, 10), sine(3000, 10), H)
    assert shortened(data, 3000) is data
    several = Dataset.joined([data, data])
    assert shortened(several, 1000) is several


def test_slow_signals_are_thinned():
    u = sine(20_000, 10)
    data = Dataset(H * np.arange(20_000), u, u**3, train=slice(4000, 16_000), covariates={"T": np.arange(20_000.0)})
    made = shortened(data, 3000)
    assert made.h == pytest.approx(4 * H)
    assert (made.train.start, made.train.stop) == (1000, 4000)
    assert made.u.tolist() == u[:16_000:4].tolist()
    assert made.covariates.values[:, 0].tolist() == list(range(0, 16_000, 4))


def test_what_would_be_lost_is_not_thinned():
    """A tone at a quarter of the rate, in the output alone; white noise of the sensor may go."""
    n = 20_000
    u, t = sine(n, 10), np.arange(n)
    rung = Dataset.from_signal(u, u + 0.05 * np.sin(2 * np.pi * 0.2 * t), H)
    made = shortened(rung, 5000)
    assert made.h == pytest.approx(H)
    assert len(made.t) == 5000
    noisy = u + 0.01 * np.random.default_rng(4).normal(size=n)
    assert shortened(Dataset.from_signal(u, noisy, H), 5000).h == pytest.approx(4 * H)


@pytest.mark.parametrize(("late", "first"), [(0.0, 0), (0.8, 15_000)])
def test_the_part_with_most_range_and_speed_or_the_first_of_equal_ones(late, first):
    u = sine(20_000, 400, late)
    data = Dataset.from_signal(u, u, H)
    made = shortened(data, 5000)
    assert made.u.tolist() == u[first : first + 5000].tolist()
    assert made.train == slice(0, 5000)


def test_the_beginning_keeps_what_is_held_out():
    u = sine(4000, 40)
    held = np.arange(4000) % 7 == 0
    made = beginning(Dataset.from_signal(u, u, H).with_held(held), 1000)
    assert len(made.t) == 1000
    assert made.held.tolist() == held[:1000].tolist()
