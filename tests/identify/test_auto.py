"""`--model auto` on one numpy plant of each memory class: the choice, the discarded candidates, the reasons."""

import functools
from itertools import pairwise

import numpy as np
import plants
import pytest

from hystfmu import Dataset, InputError
from hystfmu.data import signals
from hystfmu.data.reversals import turning_points
from hystfmu.identify import METHODS, auto, fit, options
from hystfmu.identify.excitation.minor_loops import Excitation, examine, gaps

U = signals.training(60, 1)


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


def static(u):
    return np.tanh(2 * u) + 0.3 * u**2


@functools.cache
def automatic(plant):
    """Return the model chosen for a plant and the reported progress; fit once."""
    fractions = []
    return fit(Dataset.from_signal(U, plant(U), 1e-3), "auto", progress=fractions.append), fractions


@pytest.mark.parametrize(
    ("plant", "memory", "chosen", "limit"),
    [
        pytest.param(
            plants.prandtl_ishlinskii,
            "return-point",
            {"prandtl_ishlinskii", "actuator", "fitted_operator_mlp"},
            0.1,
            marks=pytest.mark.stress,
        ),
        (plants.bouc_wen, "no return-point", {"bouc_wen"}, 0.01),
        pytest.param(last_extremum, "no return-point", {"zhao_tan_mlp"}, 5.0, marks=pytest.mark.stress),
        pytest.param(
            static,
            "none",
            {"constraint_factor_mlp", "fitted_operator_mlp", "zhao_tan_mlp", "play_bank_mlp"},
            0.1,
            marks=pytest.mark.stress,
        ),
    ],
)
def test_each_class_of_memory(plant, memory, chosen, limit):
    """`limit`: %FS on nested reversals; that of the last extremum is unbounded, and the network is limited."""
    m, fractions = automatic(plant)
    assert m.fit["memory"] == memory
    assert m.key in chosen
    v = signals.nested_reversals(60, 9)
    e = m.predict(v) - plant(v)
    assert np.sqrt(np.mean(e**2)) < limit / 100 * np.ptp(plant(U))
    scores, parameters, left = (m.provenance[k] for k in ("auto", "auto_parameters", "auto_left_out"))
    assert set(scores) == set(parameters)
    assert set(scores) | set(left) == set(auto.CANDIDATES)
    assert set(scores) & set(left) == set()
    assert fractions == sorted(fractions)
    assert fractions[-1] <= 1
    if plant is last_extremum:
        assert m.provenance["options"]["memory"] == "last"
    if memory == "none":
        assert any("function of the input" in w for w in m.fit["warnings"])
    # the fewest parameters among those that are as good as the best
    best = max(min(scores.values()), auto.EXACT)
    assert m.fit["parameters"] == min(parameters[n] for n in scores if scores[n] <= 1.05 * best)


@pytest.mark.parametrize(
    ("plant", "expected", "other"),
    [
        (plants.bouc_wen, "bouc_wen", "prandtl_ishlinskii"),
        pytest.param(plants.prandtl_ishlinskii, "prandtl_ishlinskii", "bouc_wen", marks=pytest.mark.stress),
    ],
)
def test_s3_the_class_is_picked_automatically(plant, expected, other):
    m, _ = automatic(plant)
    assert m.key == expected
    scores = m.provenance["auto"]
    assert scores[expected] == min(scores.values())
    assert "minor loops" in m.provenance["auto_left_out"][other]
    if expected == "bouc_wen":
        assert scores["prandtl_ishlinskii_asym"] > 10 * scores[expected]


@pytest.mark.stress
def test_rate_dependence_needs_several_speeds():
    """A first-order lag behind the plays; constant speed hides it, half cosines of one duration do not."""
    assert not examine(Dataset.from_signal(U, plants.prandtl_ishlinskii(U))).several_speeds
    turns = signals.nested_reversals(50, 3, step=2.0)[::2]
    blend = 0.5 - 0.5 * np.cos(np.pi * np.arange(1, 61) / 60)
    u = np.concatenate([turns[:1], *[a + (b - a) * blend for a, b in pairwise(turns)]])
    y, out = plants.prandtl_ishlinskii(u), np.zeros(len(u))
    for k in range(1, len(u)):
        out[k] = out[k - 1] + 0.3 * (y[k] - out[k - 1])
    quick = ("prandtl_ishlinskii", "prandtl_ishlinskii_rate", "g0_prandtl_ishlinskii")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(auto, "CANDIDATES", {k: auto.CANDIDATES[k] for k in quick})
        lagged = fit(Dataset.from_signal(u, out, 1e-3), "auto")
        at_once = fit(Dataset.from_signal(u, y, 1e-3), "auto")
    assert lagged.fit["rate"] == "seen"
    assert lagged.key == "g0_prandtl_ishlinskii"
    assert at_once.fit["rate"] == "not seen"
    assert at_once.key == "prandtl_ishlinskii"


def seen(**changed):
    values = {"reversals": 60, "samples_per_cycle": 150.0, "loops": 20, "gap": 0.0, "several_speeds": True}
    return Excitation(**{**values, "memory": "return-point", "warnings": (), **changed})


def test_what_cannot_fit_is_left_out_with_its_reason():
    closed, opened = auto.left_out(seen(), 3000), auto.left_out(seen(memory="no return-point", gap=4.0), 3000)
    assert "minor loops close" in closed["bouc_wen"]
    assert "minor loops close" in closed["duhem"]
    assert "prandtl_ishlinskii" not in closed
    assert "open by 4 %" in opened["preisach"]
    assert "bouc_wen" not in opened
    little = auto.left_out(seen(memory="no return-point", gap=1.0), 3000)
    assert "preisach" not in little, "creep may open loops by as much"
    assert "one speed" in auto.left_out(seen(several_speeds=False), 3000)["rate_mlp"]


def test_the_time_is_bounded_by_count_not_by_clock():
    for rows in (3000, 30_000, 1_000_000):
        left = auto.left_out(seen(memory="unknown"), rows)
        kept = [c.cost(rows) for name, c in auto.CANDIDATES.items() if name not in left]
        assert sum(kept) <= auto.BUDGET
        assert len(kept) >= 2
    assert "fit it by name" in left["bouc_wen"]
    assert not auto.left_out(seen(memory="unknown"), 4000)


def test_candidates_are_methods_with_such_options():
    for c in auto.CANDIDATES.values():
        assert c.method in METHODS
        assert set(c.options) <= {o.name for o in options(c.method)}


def test_few_rows_leave_out_large_models():
    u = signals.training(4, 2)[:400:2]
    quick = ("prandtl_ishlinskii", "preisach", "duhem")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(auto, "CANDIDATES", {k: auto.CANDIDATES[k] for k in quick})
        m = fit(Dataset.from_signal(u, plants.prandtl_ishlinskii(u)), "auto")
        assert m.provenance["auto_left_out"]["preisach"] == "268 parameters for 140 rows"
        patch.setattr(auto, "CANDIDATES", {"preisach": auto.CANDIDATES["preisach"]})
        with pytest.raises(InputError, match="must suit a candidate"):
            fit(Dataset.from_signal(u, plants.prandtl_ishlinskii(u)), "auto")


def test_a_loop_within_a_loop_closes_too():
    """-0.5 -> 1 -> 0.2 -> 0.6 -> 0.4 -> 1.2 comes back to 0.6 and to 1; the last extremum forgets only the second."""
    u = signals.ramps([0.0, -0.5, 1.0, 0.2, 0.6, 0.4, 1.2], 0.01)
    turns = turning_points(u, 1e-3)
    assert np.abs(gaps(u, plants.prandtl_ishlinskii(u), turns)).max() < 1e-12
    outer, inner = gaps(u, last_extremum(u), turns)
    g = lambda d: (1 - np.exp(-d)) * d  # noqa: E731
    assert abs(inner) < 1e-12
    assert abs(outer - (-g(0.8) + g(0.4) - g(0.2) + g(0.6))) < 1e-12
