"""Structured actuator: which part is kept at which gain, in which order the parts are tried."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from hystfmu import Dataset
from hystfmu.identify.estimate.dynamics import Dynamics
from hystfmu.identify.features import bent_chain
from hystfmu.identify.features.bent_chain import Fitting as Fit
from hystfmu.identify.features.bent_chain import Parts, Trial
from hystfmu.identify.features.bent_sum import BentSum
from hystfmu.identify.methods import actuator

H = 1e-3
RISING, BUTTERFLY = np.array([0.0, 1.0]), np.array([0.0, 0.1, 1.0])
G = Dynamics(60.0, 0.5, 0.0)


def trial(error, monotone=True, **parts):
    return Trial(Parts(**parts), BentSum(np.ones(2), RISING if monotone else BUTTERFLY, np.zeros(0)), error)


@pytest.mark.parametrize(
    ("mine", "other", "better"),
    [
        (trial(1.0), trial(0.949), True),
        (trial(1.0), trial(0.951), False),
        (trial(1.0), trial(0.499, monotone=False), True),
        (trial(1.0), trial(0.501, monotone=False), False),
        (trial(1.0, monotone=False), trial(0.949, monotone=False), True),
        (trial(1.0, monotone=False), trial(0.96), False),
    ],
)
def test_a_part_must_gain_five_percent_and_a_bend_without_inverse_half(mine, other, better):
    assert (mine.or_better(other) is other) is better


class Fitting:
    """Errors by structure instead of fits."""

    def __init__(self, error, options=None, rows=600):
        self.options = {"operator": None, "bend": None, "creep": None, "dynamics": None, "covariates": None} | (
            options or {}
        )
        self.error, self.asked = error, []
        self.data = Dataset.from_signal(np.arange(float(rows)), np.arange(float(rows)), H)
        self.kept = np.arange(90)

    def tried(self, parts, start=None, wanted=np.inf):
        self.asked.append((parts, start))
        return Trial(parts, start or trial(1.0).fit, self.error(parts))

    def dynamics(self, of, rows, progress):
        progress(1.0)
        self.asked.append((of.parts, rows))
        return G


def test_the_degree_rises_while_the_error_falls():
    f = Fitting(lambda p: {1: 1.0, 3: 0.5, 5: 0.49, 8: 0.1}[p.degree])
    assert actuator._bent(f, trial(1.0)).parts.degree == 3  # 5 gains too little: 8 is not tried
    assert [p.degree for p, _ in f.asked] == [3, 5, 5]
    assert f.asked[2][1].w.tolist() == [1.0, 1.0]  # once more from equal weights
    f = Fitting(lambda p: 1 / p.degree)
    assert actuator._bent(f, trial(1.0)).parts.degree == 8
    assert [p.degree for p, _ in f.asked] == [3, 5, 8]
    assert actuator._bent(f, trial(0.3, degree=3)).parts.degree == 8
    f = Fitting(lambda p: 0.1, {"bend": 4})
    assert actuator._bent(f, trial(0.01)).parts.degree == 4
    same = trial(0.01, degree=4)
    assert actuator._bent(f, same) is same


def test_equal_weights_help_an_even_output():
    f = Fitting(lambda p: 1.0)
    errors = iter([0.99, 0.2, 0.5, 0.5])
    f.error = lambda p: next(errors)
    best = actuator._bent(f, replace(trial(1.0), fit=replace(trial(1.0).fit, w=np.array([0.3, 0.4]))))
    assert best.parts.degree == 3
    assert f.asked[0][1].w.tolist() == [0.3, 0.4]
    assert f.asked[1][1].w.tolist() == [1.0, 1.0]


@pytest.mark.parametrize(("option", "error", "kept"), [(None, 0.9, True), (None, 0.96, False), ("yes", 2.0, True)])
def test_dynamics_are_searched_on_every_third_row(option, error, kept):
    f, told = Fitting(lambda p: error, {"dynamics": option}), []
    found = actuator._moving(f, trial(1.0), told.append)
    assert (found.parts.g is G) is kept
    assert f.asked[0][1].tolist() == list(range(0, 90, 3))
    assert told == [1.0]


@pytest.mark.parametrize(("option", "error", "kept"), [(None, 0.9, True), (None, 0.96, False), ("yes", 2.0, True)])
@pytest.mark.parametrize("g", [None, Dynamics(1.0, 1.0, 0.0)])
def test_lags_a_decade_apart_up_to_a_third_of_the_record(option, error, kept, g):
    f = Fitting(lambda p: error, {"creep": option}, rows=6000)
    found = actuator._creeping(f, trial(1.0, g=g))
    assert bool(found.parts.T) is kept
    T = f.asked[0][0].T
    assert pytest.approx((0.02, 0.2, 2.0)) == T  # ten samples are 0.01 s
    if g is not None:  # found again beside the creep
        assert f.asked[1][1].tolist() == list(range(0, 90, 3))
        assert f.asked[2][0].g is G
    assert len(f.asked) == (1 if g is None else 3)


@pytest.mark.parametrize(("rows", "first", "lags"), [(30, 0.02, 1), (300, 0.01, 2), (3 * 10**7, 0.1, 6)])
def test_one_to_six_lags(rows, first, lags):
    f = Fitting(lambda p: 1.0)
    f.data = SimpleNamespace(h=H, train=slice(0, rows))
    actuator._creeping(f, trial(1.0))
    T = f.asked[0][0].T
    assert len(T) == lags
    assert T[0] == pytest.approx(first)
    assert pytest.approx([first * 10**k for k in range(lags)]) == T


@pytest.mark.parametrize(
    ("errors", "degree", "found"),
    [
        ({"none": 9.0, "offset": 2.0, "gain": 1.0, "bend": 0.9}, 3, "bend"),
        ({"none": 9.0, "offset": 2.0, "gain": 1.0, "bend": 0.96}, 3, "gain"),
        ({"none": 9.0, "offset": 2.0, "gain": 1.0, "bend": 0.9}, 1, "gain"),  # no bend to follow
        ({"none": 9.0, "offset": 1.04, "gain": 1.0, "bend": 1.0}, 3, "offset"),
        ({"none": 9.0, "offset": 1.06, "gain": 1.0, "bend": 1.0}, 3, "gain"),
        ({"none": 1.05, "offset": 1.04, "gain": 1.0, "bend": 1.0}, 3, "none"),
    ],
)
@pytest.mark.parametrize("place", [0, 1])
def test_what_follows_a_covariate(errors, degree, found, place):
    def error(parts):
        mine = parts.levels[place]
        rest = parts.levels[1 - place]
        return errors[mine] * (1.0 if rest == "gain" else 100.0)

    f = Fitting(error)
    best = actuator._following(f, trial(1.0, degree=degree, levels=("gain", "gain")))
    assert best.parts.levels[place] == found
    assert best.parts.levels[1 - place] == "gain"
    f.options["covariates"] = "offset"
    same = trial(1.0, degree=3, levels=("offset",))
    assert actuator._following(f, same) is same


# ---- the whole ------------------------------------------------------------------------------------------------------
def record():
    rng = np.random.default_rng(4)
    u = np.interp(np.arange(400), 10 * np.arange(41), rng.uniform(-1, 1, 41))
    T = rng.uniform(20, 30, 400)
    y = 3 * u + 0.2 * (T - 25) + 1e-3 * rng.normal(size=400)
    return Dataset(H * np.arange(400), u, y, covariates={"T": T, "quiet": rng.random(400)})


OPTIONS = {
    "N": 3, "operator": None, "bend": 1, "creep": "no", "dynamics": "no", "covariates": None,
    "w0_min": 1e-3, "u0": None, "hold": "foh",
    "delay_max": 0.0, "zeta_max": 5.0,
}  # fmt: skip


def test_the_parts_are_counted_and_told():
    told, data = [], record()
    graph, count, found = actuator.build(data, OPTIONS, 0, told.append)
    assert found["parts"] == "plays, offset that follows T"
    assert count == 4 + 2 + 1  # weights, bend, offset
    assert found["warnings"] == [
        "the covariate 'quiet' does not reduce the error on validation blocks: it is not an input of the model"
    ]
    assert [i.name for i in graph.inputs] == ["u", "T"]
    assert 0 < found["validation_percent"] < 0.1
    assert told == [0.2, 0.8]
    _, count, found = actuator.build(data, {**OPTIONS, "creep": "yes", "bend": 3, "covariates": "bend"}, 0, told.append)
    assert found["parts"] == "plays, bend of degree 3, bend that follows T, bend that follows quiet, creep with 2 lags"
    assert count == 4 + 4 + 2 + 2 * 4


def test_dynamics_are_searched_twice_more_on_all_rows(monkeypatch):
    told, rows, searched = [], [], iter([Dynamics(90.0 + k, 0.7, 0.0) for k in range(3)])

    def search(residuals, data, options, progress, near=None):
        progress(0.5)
        rows.append(len(residuals(Dynamics(90.0, 0.7, 0.0))))
        return next(searched)

    monkeypatch.setattr(bent_chain, "search", search)
    data = Dataset.from_signal(record().u, record().y, H)
    graph, count, found = actuator.build(data, {**OPTIONS, "dynamics": "yes"}, 0, told.append)
    kept = len(Fit(data, OPTIONS).kept)
    assert rows == [-(-kept // 3), 400, 400]
    assert (found["f_n"], found["zeta"], found["delay"]) == (92.0, 0.7, 0.0)
    assert found["parts"].endswith("G0(s) with delay")
    assert count == 4 + 2 + 3
    assert told[:2] == pytest.approx([0.2, 0.2 + 0.4 * 0.5])
    assert told[-1] == 0.8
    b, a = (graph.node("g0").value(k) for k in "ba")
    assert np.sqrt(b[0]) == pytest.approx(2 * np.pi * 92)
    assert len(a) == 3
