"""Validation blocks tell what a kind has learned only where it has seen the outermost loop, and beside true noise."""

import secrets

import numpy as np
import pytest
from random_plants import draw

from hystfmu import Dataset
from hystfmu.data import signals
from hystfmu.identify.catalogue import candidates
from hystfmu.identify.one import fit_one
from hystfmu.identify.race import FOLDS, Race, Trial
from hystfmu.model.accuracy import rms

CANDIDATES = candidates()
SEEDS = [secrets.randbelow(10**6) for _ in range(3)]
drawn = pytest.mark.parametrize("seed", SEEDS, ids=range(3))  # workers draw apart: names must not tell the draw


@drawn
def test_the_folds_of_a_decaying_sine_tell_the_same(seed):
    """A network that had not seen the first loop erred there three times as much, and lost or won by luck."""
    u = signals.decaying_sine(10, np.random.default_rng(seed).uniform(0.07, 0.15))
    race = Race(Dataset.from_signal(u, draw("plays", seed)(u), 1e-3), 0)
    errors = [rms(race.fitted(f, "constraint_factor_mlp", {"starts": 1}, lambda done: None)[1]) for f in FOLDS]
    assert max(errors) < 2 * sorted(errors)[1]


def entered(u, y):
    race = Race(Dataset.from_signal(u, y, 1e-3), 0)
    race.first("prandtl_ishlinskii", *CANDIDATES["prandtl_ishlinskii"], lambda done: None)
    return race


@drawn
def test_noise_that_a_model_refutes_hides_no_error(seed):
    """Kinks of few coarse rows look like noise: the estimate stopped the search at the first kind below it."""
    u = signals.training(40, seed, 0.08)[:200]
    race = entered(u, draw("plays", seed)(u))
    assert not race.explained()
    u = signals.training(40, seed, 0.015)
    y = draw("plays", seed)(u)
    sigma = 0.005 * np.ptp(y)
    noisy = entered(u, y + sigma * np.random.default_rng(seed).normal(size=len(y)))
    assert noisy.floor() <= noisy.sigma**2
    if noisy.sigma < 1.05 * sigma:  # one estimate in 200 is 15 % too large: the model refutes that one rightly
        assert noisy.floor() > 0.7 * noisy.sigma**2
    assert not noisy.explained()  # the estimate is uncertain: a worse kind below it must not end the race


def test_one_oscillation_does_not_tell_close_kinds_apart():
    u = signals.decaying_sine(5, 0.1, 60)
    data = Dataset.from_signal(u, draw("plays", 1)(u), 1e-3)
    model = fit_one(data, "prandtl_ishlinskii", 0, lambda done: None, {})
    candidate = CANDIDATES["prandtl_ishlinskii"][1]
    best, near, loser = (
        Trial(str(e), "prandtl_ishlinskii", candidate, model, np.full(99, e * data.span), 0.0)
        for e in (0.01, 0.014, 0.016)
    )
    for poor in (False, True):
        race = Race(data, 0, poor)
        race.trials = {t.name: t for t in (best, near, loser)}
        assert [race.as_good(t, best) for t in (best, near, loser)] == [True, poor, False]
