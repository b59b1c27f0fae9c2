"""`--model auto` on one numpy plant of each memory class: the choice, the discarded candidates, the reasons."""

import functools
from contextlib import suppress
from itertools import pairwise

import numpy as np
import plants
import pytest

from hystfmu import Dataset, InputError, signals
from hystfmu.identify import auto, fit, options
from hystfmu.identify.catalogue import candidates
from hystfmu.identify.excitation.minor_loops import examine
from hystfmu.identify.race import AS_GOOD, EXACT
from hystfmu.inverse import Inverses

U = signals.training(60, 1)
CANDIDATES = candidates()


def last_extremum(u):
    """u/2 + h, h = h_p + sgn(u - u_p)(1 - e^-d) d from the last extremum u_p, whether it was passed or not."""
    x, h, start, base, direction, out = 0.0, 0.0, 0.0, 0.0, 0.0, []
    for v in u:
        if v != x:
            s = np.sign(v - x)
            if direction * s < 0:
                start, base = x, h
            direction, x = s, v
            d = abs(v - start)
            h = base + np.sign(v - start) * (1 - np.exp(-d)) * d
        out.append(h + v / 2)
    return np.array(out)


@pytest.fixture
def only(monkeypatch):
    """Let only some candidates compete."""

    def patch(*names):
        monkeypatch.setattr(auto, "candidates", lambda: {n: CANDIDATES[n] for n in names})

    return patch


def static(u):
    return np.tanh(2 * u) + 0.3 * u**2


@functools.cache
def automatic(plant):
    """Return the model chosen for a plant and the reported progress; fit once."""
    fractions = []
    return fit(Dataset.from_signal(U, plant(U), 1e-3), "auto", progress=fractions.append), fractions


@pytest.mark.turn("the choice of a kind")
@pytest.mark.some(1)
@pytest.mark.parametrize(("plant", "memory", "chosen", "limit"), [
    pytest.param(
        plants.prandtl_ishlinskii, "return-point", {"prandtl_ishlinskii", "actuator", "fitted_operator_mlp"}, 0.1,
        marks=pytest.mark.stress),
    (plants.bouc_wen, "no return-point", {"bouc_wen"}, 0.01),
    pytest.param(last_extremum, "no return-point", {"zhao_tan_mlp"}, 5.0, marks=pytest.mark.stress),
    pytest.param(static, "none", {"constraint_factor_mlp", "fitted_operator_mlp", "zhao_tan_mlp", "play_bank_mlp"}, 0.1,
        marks=pytest.mark.stress),
])  # fmt: skip
def test_each_class_of_memory(plant, memory, chosen, limit):
    """`limit`: %FS on nested reversals; that of the last extremum is unbounded, and the network is limited."""
    m, fractions = automatic(plant)
    assert m.fit["memory"] == memory
    assert m.key in chosen
    v = signals.nested_reversals(60, 9)
    e = m.predict(v) - plant(v)
    assert np.sqrt(np.mean(e**2)) < limit / 100 * np.ptp(plant(U))
    scores, parameters, left = (m.provenance[k] for k in ("auto", "auto_parameters", "auto_left_out"))
    assert list(scores) == sorted(scores, key=scores.get) == list(parameters)
    assert set(scores) | set(left) == set(CANDIDATES)
    assert set(scores) & set(left) == set()
    assert fractions == sorted(fractions)
    assert fractions[-1] <= 1
    if plant is last_extremum:
        assert m.provenance["options"]["memory"] == "last"
    if memory == "none":
        assert any("function of the input" in w for w in m.fit["warnings"])
    # no more parameters than the best
    best, chosen = next(iter(scores)), m.provenance["auto_choice"]
    assert scores[chosen] <= AS_GOOD * max(scores[best], EXACT)
    assert parameters[chosen] <= parameters[best]


@pytest.mark.stress
def test_rate_dependence_needs_several_speeds(only):
    """A first-order lag behind the plays; constant speed hides it, half cosines of one duration do not."""
    assert not examine(Dataset.from_signal(U, plants.prandtl_ishlinskii(U))).several_speeds
    turns = signals.nested_reversals(50, 3, step=2.0)[::2]
    blend = 0.5 - 0.5 * np.cos(np.pi * np.arange(1, 61) / 60)
    u = np.concatenate([turns[:1], *[a + (b - a) * blend for a, b in pairwise(turns)]])
    y, out = plants.prandtl_ishlinskii(u), np.zeros(len(u))
    for k in range(1, len(u)):
        out[k] = out[k - 1] + 0.3 * (y[k] - out[k - 1])
    only("prandtl_ishlinskii", "g0_prandtl_ishlinskii")
    lagged = fit(Dataset.from_signal(u, out, 1e-3), "auto")
    at_once = fit(Dataset.from_signal(u, y, 1e-3), "auto")
    assert lagged.fit["rate"] == "seen"
    assert lagged.key == "g0_prandtl_ishlinskii"
    assert at_once.fit["rate"] == "not seen"
    assert at_once.key == "prandtl_ishlinskii"


def test_candidates_state_options_of_their_kinds():
    assert {"prandtl_ishlinskii", "actuator", "zhao_tan_mlp memory=last"} <= set(CANDIDATES)
    for key, c in CANDIDATES.values():
        assert {*c.options, *c.quick} <= {o.name for o in options(key)}


def test_few_rows_leave_out_large_models(only):
    u = signals.training(4, 2)[:400:2]
    data = Dataset.from_signal(u, plants.asymmetric(u))
    only("prandtl_ishlinskii", "krasnoselskii_pokrovskii")
    assert fit(data, "auto").provenance["auto_left_out"]["krasnoselskii_pokrovskii"] == "211 parameters for 160 rows"
    only("krasnoselskii_pokrovskii")
    with pytest.raises(
        InputError, match=r"Got no fit.* Discarded: krasnoselskii_pokrovskii: 211 parameters for 160 rows"
    ):
        fit(data, "auto")


@pytest.mark.turn("the choice of a kind")
@pytest.mark.some(1)
@pytest.mark.parametrize("names", [
    ("prandtl_ishlinskii", "polynomial_narx", "krasnoselskii_pokrovskii", "constraint_factor_mlp"),
    pytest.param(tuple(CANDIDATES), marks=pytest.mark.stress),
])  # fmt: skip
def test_a_staircase_of_minor_loops(only, names):
    """Its last part extrapolates: a choice on it took a kind 25 times worse than the best."""
    only(*names)
    u = signals.minor_loops(8, 0.2, 60)
    data = Dataset.from_signal(u, plants.asymmetric(u), 1e-3)
    chosen = fit(data, "auto")
    v = signals.nested_reversals(40, 9)

    def error(m):
        return np.sqrt(np.mean((m.predict(v) - plants.asymmetric(v)) ** 2))

    errors = []
    for key in {CANDIDATES[n][0] for n in names}:
        with suppress(InputError):  # a kind may refuse the data
            errors.append(error(fit(data, key)))
    assert error(chosen) <= 1.3 * min(errors)


def test_the_choice_sees_training_rows_only(only):
    only("prandtl_ishlinskii", "polynomial_narx", "krasnoselskii_pokrovskii")
    y = plants.asymmetric(U)
    wrong = np.where(np.arange(len(U)) < 2500, y, -y)
    made = [fit(Dataset.from_signal(U, v, train=slice(0, 2500)), "auto") for v in (y, wrong)]
    assert made[0].provenance["auto"] == made[1].provenance["auto"]
    assert made[0].predict(U).tobytes() == made[1].predict(U).tobytes()


def test_an_output_that_no_kind_follows_is_refused_with_the_reason(only):
    only("prandtl_ishlinskii", "polynomial_narx")
    y = plants.prandtl_ishlinskii(U) + 4 * np.sin(2 * np.pi * np.arange(len(U)) / 777)  # of another input
    with pytest.raises(
        InputError,
        match=r"to 5 % of the span. Got errors .* of polynomial_narx [0-9.]+ %\. .* Discarded: prandtl_.*: minor loops",
    ):
        fit(Dataset.from_signal(U, y), "auto")


@pytest.mark.turn("the choice of a kind")
def test_only_models_with_a_useful_inverse_compete(only):
    only("prandtl_ishlinskii", "krasnoselskii_pokrovskii")

    class Stub:
        def kind(self, model):
            return "exact"

        def fault(self, model):
            return "" if model.key == "krasnoselskii_pokrovskii" else "no use"

    y = plants.prandtl_ishlinskii(U)
    data = Dataset.from_signal(U, y)
    assert fit(data, "auto", inverses=Stub()).key == "prandtl_ishlinskii"
    assert fit(data, "auto", inverses=Stub(), only_invertible=True).key == "krasnoselskii_pokrovskii"
    only("prandtl_ishlinskii")
    with pytest.raises(InputError, match="no use"):
        fit(data, "auto", inverses=Stub(), only_invertible=True)


def test_what_inverse_a_model_has():
    u = signals.training(12, 3, 0.05)
    butterfly = fit(
        Dataset.from_signal(u, plants.prandtl_ishlinskii(u) ** 2), "actuator", bend=3, creep="no", dynamics="no"
    )
    assert Inverses().kind(butterfly) == "none: not monotone"
    assert Inverses().fault(butterfly)
    plays = fit(Dataset.from_signal(u, plants.prandtl_ishlinskii(u)), "prandtl_ishlinskii")
    assert Inverses().kind(plays) == "exact"
    assert Inverses().fault(plays) == ""


@pytest.mark.parametrize("samples", [20, 25, 30])
def test_coarse_extrema_do_not_open_loops(samples):
    """Plays have return-point memory, however coarsely a sine is sampled; a Bouc-Wen operator stays recognised."""
    c = np.arange(40 * samples) / (samples + 0.3)
    u = (0.6 + 0.4 * np.sin(2 * np.pi * c / 7.3)) * np.sin(2 * np.pi * c)
    assert examine(Dataset.from_signal(u, plants.prandtl_ishlinskii(u))).memory != "no return-point"
