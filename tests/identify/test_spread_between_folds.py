"""Where fits to different rows disagree, blocks of one record do not tell; the race counts it as an error."""

from itertools import pairwise
from types import SimpleNamespace

import numpy as np
import pytest

from hystfmu import Dataset, Model, blocks
from hystfmu.data import signals
from hystfmu.data.reversals import turning_points
from hystfmu.identify.catalogue import ANY, Candidate, candidates
from hystfmu.identify.features.other_memory import other_memory
from hystfmu.identify.race import FOLDS, LOSER, Race, Trial

DECAY = signals.decaying_sine(10, 0.1)


def trial(name, errors=0.01, **more):
    """Return a candidate with errors of this size on the blocks; `others` has the outputs of the folds."""
    model = SimpleNamespace(fit={"parameters": 3})
    return Trial(name, name, Candidate(ANY, 1.0, 0.1), model, np.full(50, errors), 0.0, **more)


def test_the_spread_is_the_standard_error_of_a_mean():
    """The fit is a mean of n values, a fold leaves one out: the standard error is s / sqrt(n)."""
    values = np.random.default_rng(4).normal(size=7)
    means = [np.delete(values, k) for k in range(len(values))]
    found = trial("mean", others=[np.full(3, v.mean()) for v in means]).spread
    assert found == pytest.approx(values.std(ddof=1) / np.sqrt(len(values)), rel=1e-12)
    assert trial("once", others=[np.ones(3)]).spread == 0.0
    assert trial("wild", others=[np.ones(3), np.full(3, np.inf)]).spread == np.inf


def test_a_loser_returns_when_the_fits_of_the_others_disagree():
    race = Race(Dataset.from_signal(DECAY, 2 * DECAY), 0)
    firm, shaky = trial("firm", 2 * LOSER * 0.01), trial("shaky")
    race.trials = {t.name: t for t in (firm, shaky)}
    assert race.late() == [shaky]
    shaky.folds, shaky.others = len(FOLDS), [np.full(9, v) for v in (0.0, 0.1, 0.2)]
    assert race.risk(shaky) > race.risk(firm) > race.excess(shaky)
    assert race.late() == [firm]
    assert race.best() is firm


def test_folds_of_one_kind_agree_where_the_plant_is_of_this_kind():
    """A straight line is found from any rows; a grid of kernels leaves states to each fold that it has not seen."""
    plays = Model.of_block(blocks.PrandtlIshlinskii(w0=0.5, r=[0.13, 0.41], w=[0.6, 0.4]))
    spreads = {}
    for name, y in (("prandtl_ishlinskii", 2 * DECAY + 0.5), ("krasnoselskii_pokrovskii", plays.predict(DECAY))):
        race = Race(Dataset.from_signal(DECAY, y, 1e-3), 0)
        race.first(name, name, candidates()[name][1], lambda done: None)
        race.again(list(race.trials.values()))
        assert race.trials[name].folds == 2
        spreads[name] = race.trials[name].spread
    assert spreads["prandtl_ishlinskii"] < 1e-9 < 1e-4 < spreads["krasnoselskii_pokrovskii"]


@pytest.mark.parametrize("scale", [1.0, 1e-6])
def test_the_input_with_other_memory_moves_as_the_record_does(scale):
    """Half cycles of one duration and shape, within the range, and loops that are not those of the record."""
    n = 40
    turns = np.cumsum(np.resize([1.0, -2.0, 1.6, -1.2, 0.9], 20)) * scale
    blend = 0.5 - 0.5 * np.cos(np.pi * np.arange(1, n + 1) / n)
    u = np.concatenate([[0.0], *[a + (b - a) * blend for a, b in pairwise([0.0, *turns])]])
    v = other_memory(u, 0.0)
    assert v[0] == 0.0
    assert u.min() <= v.min() < u.min() + 1e-12
    assert u.max() - 1e-12 < v.max() <= u.max()
    found = turning_points(v, 0.0)
    np.testing.assert_array_equal(found % n, 0)
    for a in found[:-1]:
        np.testing.assert_allclose(v[a + 1 : a + n + 1], v[a] + (v[a + n] - v[a]) * blend, atol=1e-12 * scale)
    assert len(np.unique(np.round(v[found] / scale, 6))) > 3 * len(np.unique(np.round(turns / scale, 6)))


def test_a_record_of_one_sweep_has_an_input_with_other_memory():
    v = other_memory(np.linspace(2.0, 3.0, 101), 2.0)
    assert v.min() == 2.0
    assert v.max() == 3.0
    assert len(turning_points(v, 0.0)) > 100
