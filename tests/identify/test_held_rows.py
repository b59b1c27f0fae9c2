"""Rows that are held out of the training rows: no kind that competes in `auto` may use their output."""

import numpy as np
import plants
import pytest

from hystfmu import Dataset, InputError
from hystfmu.data import signals
from hystfmu.identify.catalogue import candidates
from hystfmu.identify.cuts import EVERY, fitted_and_held, validation_rows
from hystfmu.identify.one import fit_one

CHEAP = ("prandtl_ishlinskii", "krasnoselskii_pokrovskii", "polynomial_narx")
SHORT = {"starts": 1, "iterations": 5}
KEYS = sorted({key for key, _ in candidates().values()})
U = signals.training(12, 3, 0.05)
Y = plants.asymmetric(U)


def held():
    rows = validation_rows(U, 1)
    rows[: int(np.argmin(Y)) + 1] = False  # the span of y stays that of all rows
    return rows


def outcome(data, key):
    """Return the output of the model, or the refusal, which has figures of the data too."""
    given = (
        SHORT
        if key.endswith("_mlp")
        else {"m": 2, "q": 1}
        if key == "duhem"
        else {"n_u": 2, "n_f": 2}
        if "narx" in key
        else {}
    )
    try:
        return fit_one(data, key, 0, lambda f: None, given).graph.run(U, 1e-3).tobytes()
    except InputError as e:
        return str(e)


@pytest.mark.parametrize("key", [k if k in CHEAP else pytest.param(k, marks=pytest.mark.stress) for k in KEYS])
def test_no_kind_uses_the_output_of_held_rows(key):
    """The same model from data whose held rows are wrong, another one if they count."""
    rows, wrong = held(), Y.copy()
    wrong[rows] *= 0.7
    made = [outcome(Dataset.from_signal(U, y, 1e-3).with_held(rows), key) for y in (Y, wrong)]
    assert made[0] == made[1]
    assert outcome(Dataset.from_signal(U, wrong, 1e-3), key) != made[0]


def test_rows_that_count():
    rows = held()
    data = Dataset.from_signal(U, Y, 1e-3, train=slice(30, len(U) - 10)).with_held(rows)
    wanted = [k for k in range(30, len(U) - 10) if not rows[k]]
    assert list(data.counted) == wanted
    assert data.with_output(Y + 1).held is rows
    assert Dataset.from_signal(U, Y).counted == slice(0, len(U))


@pytest.mark.parametrize("fold", range(EVERY))
def test_beside_a_fold_that_is_held_out_there_are_blocks_that_tell_which_parts_to_take(fold):
    rows = validation_rows(U, fold)
    every, fitted, tested = fitted_and_held(Dataset.from_signal(U, Y, 1e-3).with_held(rows), len(U))
    assert len(tested) > 0.1 * len(U)
    assert not rows[every].any()
    assert sorted([*fitted, *tested]) == every.tolist()
