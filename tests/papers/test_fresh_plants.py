"""The table of random plants: its plants are what they claim to be, its seeds are said, its targets hold."""

import re

import numpy as np
import plants
import pytest

from hystfmu.data import signals
from papers import drawn_plants, fresh_plants, reproduce

SEED = int(np.random.SeedSequence().generate_state(1)[0])


@pytest.mark.parametrize("name", ["play_sum", "bent", "stop_like", "butterfly"])
def test_a_plant_is_rate_independent_and_returns_to_its_path(name):
    plant = getattr(drawn_plants, name)(np.random.default_rng(SEED))
    loop = signals.ramps([0, 1, -1, 0.4, -0.2, 0.4, 1], 0.02)
    y = plant(loop)
    first, back = np.flatnonzero(np.abs(loop - 0.4) < 1e-12)[-2:]
    assert y[first] == pytest.approx(y[back], abs=1e-12), SEED  # the minor loop closes
    assert plant(np.repeat(loop, 2))[::2] == pytest.approx(y, abs=1e-12), SEED


def test_bent_plants_increase_and_others_do_not():
    v = np.linspace(-1, 1, 201)
    rise = signals.ramps([0, -1, 1], 0.01)[100:]
    for seed in (SEED, SEED + 1, SEED + 2):
        assert np.diff(drawn_plants.bent(np.random.default_rng(seed))(rise)).min() > -1e-12, seed
    assert np.diff(drawn_plants.butterfly(np.random.default_rng(SEED))(v)).min() < 0


def test_the_plays_are_those_of_the_oracle():
    u = signals.nested_reversals(10, SEED)
    rng = np.random.default_rng(SEED)
    r, w = np.sort(rng.uniform(0.05, 0.6, drawn_plants.PLAYS)), rng.uniform(0.3, 1.7, drawn_plants.PLAYS)
    y = drawn_plants.play_sum(np.random.default_rng(SEED))(u)
    assert y == pytest.approx((3 * u + plants.plays(u, r) @ w) / (3 + (1 - r) @ w), abs=1e-14)


def test_a_row_says_its_seeds_and_meets_its_target():
    (row,) = fresh_plants._odd_rows("butterfly", f"seed {SEED}", (SEED,))
    assert row.met, row
    assert str(SEED) in row.quantity


@pytest.mark.stress
def test_all_targets_hold_on_seeds_drawn_now():
    report = reproduce("fresh_plants")
    missed = [(r.quantity, r.ours) for r in report.rows if r.met is False]
    assert not missed
    drawn = {m for r in report.rows for m in re.findall(r"drawn, first (\d+)|, seed (\d+)", r.quantity)}
    assert len(drawn) >= 2
