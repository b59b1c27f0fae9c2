"""The race and the choice by numbers: errors beside the noise, losers, equals, who is left out, which is preferred."""

from types import SimpleNamespace

import numpy as np
import pytest
from trials import DATA, E4, SPAN, U, trial

from hystfmu import Dataset, InputError
from hystfmu.data.reversals import noise
from hystfmu.identify import auto
from hystfmu.identify import race as module
from hystfmu.identify.auto import refusal
from hystfmu.identify.catalogue import ANY, CLOSES, LAGS, LATE, OPENS, Candidate
from hystfmu.identify.excitation.minor_loops import NONE, OPEN_LOOPS, RETURN_POINT, UNKNOWN, Excitation
from hystfmu.identify.features import other_memory
from hystfmu.identify.race import Race


# ---- choice ----------------------------------------------------------------------------------------------------------
def seen(**changed):
    values = {"reversals": 60, "samples_per_cycle": 150.0, "loops": 20, "gap": 0.0, "several_speeds": True}
    return Excitation(**{**values, "memory": UNKNOWN, "warnings": (), "coarse": (), **changed})


def test_how_many_rows_all_can_be_tried_on():
    cheap = [Candidate(ANY, 1.0, 0.1)] * 12  # 12 s, and 1.2 s per 1000 rows
    assert auto.affordable(cheap, 10_000) == 10_000  # 24 s
    assert auto.affordable(cheap, 10_001) == 9000
    quick = [Candidate(ANY, 2.0, 4.0, quick={"N": 1})] * 3  # 0.2 of 6 s and 12 s per 1000
    assert auto.affordable(quick, 9500) == 9500
    assert auto.affordable([*quick, Candidate(ANY, 0.3, 0.0)], 9500) == 8550
    expensive = [Candidate(ANY, 2.0, 4.0)] * 3  # tried on a part of the rows
    assert auto.affordable(expensive, 9500) == 9500
    assert auto.affordable([Candidate(ANY, 2.9, 0.0)] * 12, 30_000) == auto.LEAST_ROWS
    assert auto.affordable([Candidate(ANY, 2.9, 0.0)] * 12, 500) == 500


@pytest.mark.parametrize(("memory", "record", "reason"), [
    (OPENS, {"memory": NONE}, "the output is a function of the input"),
    (OPENS, {"memory": RETURN_POINT, "gap": 0.043}, "minor loops close (gap 0.043 % of the span of y)"),
    (OPENS, {"memory": RETURN_POINT, "gap": 0.053}, None),
    (OPENS, {"memory": RETURN_POINT, "gap": 0.043, "loops": 4}, None),
    (LATE, {"memory": RETURN_POINT, "gap": 0.043, "loops": 5}, "minor loops close (gap 0.043 % of the span of y)"),
    (CLOSES, {"memory": OPEN_LOOPS, "gap": 2.01}, "minor loops stay open by 2 % of the span of y"),
    (CLOSES, {"memory": OPEN_LOOPS, "gap": 2.0}, None),
    (CLOSES, {"memory": UNKNOWN, "gap": 9.0}, None),
    (LAGS, {"several_speeds": False}, "the input has one speed only and is not informative about rate dependence"),
    (LAGS, {}, None),
    (LATE, {"several_speeds": False}, None),
    (LATE, {"memory": RETURN_POINT, "gap": 0.043}, "minor loops close (gap 0.043 % of the span of y)"),
    (LATE, {"memory": NONE}, "the output is a function of the input"),
    (ANY, {"memory": NONE, "several_speeds": False}, None),
])  # fmt: skip
def test_who_contradicts_the_record(memory, record, reason):
    left = auto.left_out({"x": Candidate(memory, 1.0, 0.0)}, seen(**record))
    assert left == ({} if reason is None else {"x": reason})


@pytest.mark.parametrize(("lags", "other", "speeds", "told"), [
    (1.0, 1.21, True, "seen"), (1.0, 1.19, True, "not seen"), (0.05, 0.099, True, "not seen"),
    (0.05, 0.101, True, "seen"), (1.0, 9.0, False, "one speed only"), (None, 9.0, True, "not seen"),
])  # fmt: skip
def test_rate_dependence_is_seen_in_a_clearly_smaller_error(race, lags, other, speeds, told):
    race.trials = {"o": trial("o", other * E4)}
    if lags is not None:
        race.trials["l"] = trial("l", lags * E4, memory=LAGS)
    assert auto._rate(race, seen(several_speeds=speeds)) == told
    race.trials.pop("o")
    if lags is not None and speeds:
        assert auto._rate(race, seen()) == "seen"  # no static kind is left


class Inverses:
    def __init__(self, exact=(), faulty=()):
        self.exact, self.faulty = exact, faulty

    def kind(self, model):
        return "exact" if model.graph in self.exact else "iterated"

    def fault(self, model):
        return "no use" if model.graph in self.faulty else ""


@pytest.mark.parametrize(("excursions", "inverses", "only", "chosen"), [
    ((), None, False, "small"),
    ((), Inverses(["large"]), False, "large"),
    ((), Inverses(["worse"]), False, "small"),
    (("small",), None, False, "large"),
    (("small", "large"), None, False, "small"),  # nothing as good stays inside: a worse kind is no remedy
    ((), Inverses([], ["small"]), False, "small"),
    ((), Inverses([], ["small"]), True, "large"),
    ((), Inverses([], ["small", "large", "worse"]), True, "outsider"),
    (("small", "large", "worse"), None, False, "small"),
    ((), Inverses([], ["small", "large", "worse", "outsider"]), True, None),
])  # fmt: skip
def test_the_preferred_of_equal_ones(race, excursions, inverses, only, chosen):
    able = [
        trial("large", 1.0 * E4, parameters=9),
        trial("small", 1.1 * E4, parameters=2),
        trial("worse", 2 * E4, parameters=1),
    ]
    for t in able:
        t.leaves = t.name in excursions
    race.trials = {t.name: t for t in [*able, trial("outsider", 4.9 * E4), trial("bad", 5.1 * E4, parameters=1)]}
    found = auto._preferred(race, True, inverses, only, {})
    if chosen is None:
        assert found == dict.fromkeys(("small", "large", "worse", "outsider"), "no use")
        also = " and have a useful inverse" if only else ""
        told = str(refusal("here", only, race, seen(warnings=("few loops",)), found))
        assert told.startswith(
            f"here: A kind of model must follow the data to 5 % of the span{also}. Got errors on validation blocks of "
            "large 1 % (no use), small 1.1 % (no use), worse 2 % (no use), outsider 4.9 % (no use), bad 5.1 %. The "
            "record is poor: few loops. "
        )
    else:
        assert found.name == chosen


@pytest.mark.parametrize(("poor", "chosen"), [(True, "middle"), (False, "follows")])
def test_on_one_oscillation_the_candidate_next_to_the_median_is_preferred(race, poor, chosen):
    """All follow the record about equally, and only their outputs for another memory tell them apart."""
    race.poor = poor
    outputs = {"follows": (0.9, 1.0), "middle": (1.0, 0.4), "other": (1.1, -0.4), "loser": (9.0, -3.0)}
    race.trials = {
        name: trial(name, error * E4, others=[np.full(4, y * SPAN)], parameters=k)
        for k, (name, (error, y)) in enumerate(outputs.items())
    }
    assert auto._preferred(race, True, None, False, {}).name == chosen


def test_the_distance_from_the_median_of_all_that_stay_in_the_range(race):
    """The weights are inverse to the errors; a candidate with more than four times the least error has none."""
    race.poor = True
    outputs = {"a": (1.0, 0.0), "b": (1.5, 0.5), "c": (1.6, 0.5), "far": (1.2, 9.0), "bad": (4.1, 9.0)}
    race.trials = {n: trial(n, e * E4, others=[np.full(4, y * E4)], leaves=n == "far") for n, (e, y) in outputs.items()}

    def distances():
        return {n: race.uncertainty(t) / E4 for n, t in race.trials.items()}

    assert distances() == pytest.approx(
        {"a": 0.5, "b": 0.0, "c": 0.0, "far": 8.5, "bad": 8.5}
    )  # 1 of 1 + 1/1.5 + 1/1.6
    assert race.risk(race.trials["a"]) == pytest.approx(np.hypot(1.0, 0.5))
    race.trials["bad"].others[0][:] = np.inf
    assert distances()["bad"] == np.inf
    race.trials["b"].errors[:] = 3.5 * E4  # a later fold changes its error: 1 of 1 + 1/3.5 + 1/1.6
    assert set(distances().values()) == {0.0}, "the median is a itself, thus the standard error of one fit"
    race.trials["b"].errors[:] = 2.5 * E4  # 1 of 1 + 1/2.5 + 1/1.6
    assert distances()["a"] == pytest.approx(0.5)
    race.trials["b"].leaves = True
    assert set(distances().values()) == {0.0}, "the median of two is the better one"
    for t in race.trials.values():
        t.leaves = True
    assert set(distances().values()) == {0.0}


def test_rounding_errors_have_equal_weights(race):
    race.poor = True
    outputs = {"a": (0.0, 0.0), "b": (1e-5 * SPAN, 1.0), "c": (1.9e-5 * SPAN, 5.0)}
    race.trials = {n: trial(n, e, others=[np.full(4, y)]) for n, (e, y) in outputs.items()}
    assert [race.uncertainty(t) for t in race.trials.values()] == [1.0, 0.0, 4.0]


def test_the_weighted_median_of_each_column():
    rng = np.random.default_rng(4)
    values, weights = rng.normal(size=(7, 50)), rng.uniform(0.1, 1, 7)
    found = module._weighted_median(values, weights)
    loss = (weights[:, None, None] * np.abs(values[:, None] - values[None])).sum(axis=0)  # of each value as the middle
    assert found == pytest.approx(values[np.argmin(loss, axis=0), np.arange(50)])
    assert module._weighted_median(values, np.ones(7)) == pytest.approx(np.median(values, axis=0))


def test_a_static_kind_is_no_refuge_where_none_follows(race):
    """A rate that is not seen leaves static kinds, but only those that follow the data."""
    race.trials = {t.name: t for t in (trial("lags", 4.5 * E4, memory=LAGS), trial("static", 5.2 * E4))}
    assert auto._preferred(race, False, None, False, {}).name == "lags"
    race.trials["static"] = trial("static", 4.9 * E4)
    assert auto._preferred(race, False, None, False, {}).name == "static"
    race.trials = {"a": trial("a", 5.2 * E4)}
    assert auto._preferred(race, True, None, False, {}) == {}


@pytest.mark.parametrize(("memory", "of_record", "warned"), [
    (OPENS, RETURN_POINT, 1), (CLOSES, OPEN_LOOPS, 1), (CLOSES, RETURN_POINT, 0), (OPENS, OPEN_LOOPS, 0),
    (ANY, UNKNOWN, 0),
])  # fmt: skip
def test_a_choice_against_the_minor_loops_is_warned_of(memory, of_record, warned):
    found = auto._warnings(trial("t", memory=memory), seen(memory=of_record, gap=1.234))
    assert len(found) == warned
    assert auto._warnings(trial("t", memory=OPENS), seen(memory=RETURN_POINT, loops=4)) == []
    assert all("is t, but the minor loops in the data have a gap of 1.2 % of the span" in line for line in found)


def test_progress_never_falls():
    told = []
    report = auto._Report(told.append)
    for part in (0.1, 0.3, 0.2, 0.5):
        report(part)
    report(0.5, 0.9, 0.5)
    report(0.5, 0.9, 1.5)
    assert told == pytest.approx([0.1, 0.3, 0.3, 0.5, 0.7, 0.9])


# ---- race ------------------------------------------------------------------------------------------------------------
def test_a_race_begins_with_the_noise_and_an_input_of_other_memory(monkeypatch):
    monkeypatch.setattr(module, "unseen", lambda data: 0.25)
    rng = np.random.default_rng(1)
    noisy = DATA.with_output(DATA.y + rng.normal(size=400)).with_train((20, 380))
    made = Race(noisy, 7)
    assert made.sigma == noise(noisy.y[20:380]) > 0.5
    assert made.unseen == 0.25
    assert made.other[0] == U[0]
    assert made.poor is False
    assert (made.trials, made.reasons) == ({}, {})


def test_what_a_kind_of_local_parameters_has_not_seen(monkeypatch):
    asked = []
    monkeypatch.setattr(other_memory, "covered", lambda *given: (asked.append(given), 40.0)[1])
    data = DATA.with_train((50, 300))
    assert other_memory.unseen(data) == pytest.approx(0.6)
    states, found, width, first, u, beside = asked[0]
    r = np.ptp(U[50:300]) / 2 * np.array([1, 2]) / 3
    z, seen = np.full(2, U[0]), []
    for x in U:
        z = np.clip(z, x - r, x + r)
        seen.append([x, *z])
    assert found == pytest.approx(np.array(seen)[50:300])
    assert states(U) == pytest.approx(np.array(seen))
    assert width == pytest.approx(np.ptp(found, axis=0))
    assert (first, u.tolist(), beside.shape) == (U[0], U[50:300].tolist(), (250, 0))
    assert other_memory.unseen(Dataset(DATA.t, DATA.u, DATA.y, covariates={"T": U})) == 0.0


# ---- errors ---------------------------------------------------------------------------------------------------------
def test_the_error_beside_the_noise_and_outside_the_record(race):
    t = trial(error=0.03 * SPAN)
    assert race.excess(t) == pytest.approx(3.0)
    assert race.excess(trial(error=0.0, outside=0.5)) == pytest.approx(1.5)  # 3 % for each state not seen
    assert race.excess(trial(error=0.02 * SPAN, outside=0.5)) == pytest.approx(2.5)
    spread = [np.zeros(4), np.full(4, 0.02 * SPAN)]  # n - 1 = 1 times the RMS from the mean
    assert race.risk(trial(error=0.0, others=spread)) == pytest.approx(1.0)
    assert race.risk(trial(error=0.0, outside=0.25, others=spread)) == pytest.approx(1.25)
    race.sigma = 0.03 * SPAN
    race.trials = {"a": trial(error=0.05 * SPAN)}
    assert race.excess(trial(error=0.05 * SPAN)) == pytest.approx(4.0)
    assert race.excess(trial(error=0.02 * SPAN)) == 0.0


@pytest.mark.parametrize(("rows", "doubted"), [(400, 0.2), (16, 1.0)])
def test_the_noise_is_the_least_square_unless_one_refutes_it(race, rows, doubted):
    assert module.doubt(rows) == pytest.approx(doubted)  # 2 sqrt(4 / n)
    race.sigma = 1.0
    assert race.floor() == 1.0
    race.trials = {"a": trial(error=2.0, n=rows)}
    assert race.floor() == 1.0
    if rows == 400:
        race.trials["b"] = trial(error=np.sqrt(0.81), n=rows)
        assert race.floor() == pytest.approx(0.81)
        race.trials["c"] = trial(error=np.sqrt(0.79), n=rows)
        assert race.floor() == 0.0


def test_least_best_and_explained(race):
    assert race.least() == np.inf
    race.trials = {
        "a": trial("a", 0.03 * SPAN),
        "b": trial("b", 0.02 * SPAN, others=[np.zeros(3), np.full(3, SPAN / 5)]),
    }
    assert race.least() == pytest.approx(3.0)
    assert race.best().name == "a"
    assert [race.follows(t, 2.001) for t in race.trials.values()] == [False, True]
    race.trials["a"].first = (0.02 * SPAN) ** 2  # after the first fold
    assert race.follows(race.trials["a"], 2.001)
    assert race.explained() is False
    race.trials["c"] = trial("c", 1.99e-5 * SPAN)
    assert race.explained() is True
    assert race.least() == 0.002
    race.trials["c"] = trial("c", 2.01e-5 * SPAN)
    assert race.explained() is False


def test_losers_and_who_runs_next(race):
    race.trials = {n: trial(n, e * E4, folds=f) for n, e, f in (("a", 1.0, 2), ("b", 1.499, 1), ("c", 1.501, 1))}
    assert [t.name for t in race.contenders()] == ["a", "b"]
    assert [t.name for t in race.late()] == ["b"]
    race.trials["b"].folds = 3
    assert [t.name for t in race.late()] == ["a"]
    race.trials["a"].folds = 3
    assert race.late() == []


def test_as_good_within_a_fifth(race):
    best = trial("best")
    for factor, good in ((1.19, True), (1.21, False)):
        assert race.as_good(trial(error=factor * E4), best) is good, factor
    exact = trial("exact", 0.0)
    assert race.as_good(trial(error=0.0019e-2 * SPAN), exact)
    assert race.as_good(trial(error=0.0031e-2 * SPAN), exact) is False


@pytest.mark.parametrize(("factor", "good"), [(1.49, True), (1.51, False)])
def test_a_clearly_larger_error_on_a_poor_record_is_not_as_good(race, factor, good):
    unsure = [np.zeros(4), np.full(4, 0.1 * SPAN)]  # about 5 % of the span, beside which both errors are small
    best, other = trial("best", others=unsure), trial("other", factor * E4, others=unsure)
    race.trials = {"best": best}
    assert race.as_good(other, best) is True
    race.poor = True
    assert race.as_good(other, best) is good


def test_as_good_if_the_noise_explains_the_difference(race):
    race.sigma = 1.0
    rng = np.random.default_rng(3)
    best, other = trial("best", n=200), trial("other", n=200)
    best.errors = rng.normal(size=200)
    race.trials = {"best": best}
    d = 0.5 * rng.normal(size=200)
    for k in np.linspace(0.01, 3, 150):
        other.errors = best.errors + k * d
        worse = np.mean(other.errors**2) - np.mean(best.errors**2)
        limit = 2 * 2 * np.sqrt(np.mean((k * d) ** 2) / 200)
        close = race.risk(other) <= 1.2 * max(race.risk(best), 0.002)
        assert race.as_good(other, best) is bool(close or worse <= limit)
    other.errors = best.errors + 0.05 * np.sign(best.errors)
    other.outside, best.outside = 1.0, 0.0
    assert race.as_good(other, best) is False  # knows less of other states
    other.outside, other.errors = 0.0, np.append(other.errors, 0.3)
    assert race.as_good(other, best) is False  # other rows
    race.sigma, other.errors = 1e-9, best.errors.copy()
    other.others = [np.zeros(4), np.full(4, 20.0)]
    assert race.as_good(other, best) is False  # its folds disagree
    best.others = [np.zeros(4), np.full(4, 20.0)]
    assert race.as_good(other, best) is True


# ---- who enters -----------------------------------------------------------------------------------------------------
def entering(race, monkeypatch, errors, parameters=3):
    asked, left = [], iter(errors)

    def fit(name, key, candidate, options, progress, share=1.0):
        asked.append(dict(options))
        value = next(left)
        if isinstance(value, Exception):
            raise value
        return trial(name, value, parameters=parameters)

    monkeypatch.setattr(race, "trial", fit)
    return asked


@pytest.mark.parametrize(("short", "enters"), [(3.99, True), (4.01, False)])
def test_a_short_fit_up_to_four_times_the_least_gives_hope(race, monkeypatch, short, enters):
    candidate = Candidate(ANY, 1.0, 0.1, {"N": 5}, {"N": 2, "starts": 1})
    asked = entering(race, monkeypatch, [E4, short * E4, E4])
    race.first("a", "k", candidate, lambda f: None)
    assert asked == [{"N": 5}]  # the first of all needs no short fit
    race.first("b", "k", candidate, lambda f: None)
    assert asked[1:] == [{"N": 2, "starts": 1}, {"N": 5}][: 1 + enters]
    assert ("b" in race.trials) is enters
    assert race.reasons == ({} if enters else {"b": "4 % of the span after a short trial fit"})


def test_who_does_not_enter(race, monkeypatch):
    rows = len(race.data.y[race.held(1)[0].counted])
    candidate = Candidate(ANY, 1.0, 0.1)
    entering(race, monkeypatch, [InputError("no"), np.nan, E4, E4], parameters=rows)
    race.first("a", "k", candidate, lambda f: None)
    race.first("b", "k", candidate, lambda f: None)
    race.first("c", "k", candidate, lambda f: None)
    assert race.reasons == {"a": "no", "b": "unstable in a free run"}
    assert list(race.trials) == ["c"]
    entering(race, monkeypatch, [E4], parameters=rows + 1)
    race.first("d", "k", candidate, lambda f: None)
    assert race.reasons["d"] == f"{rows + 1} parameters for {rows} rows"


def test_a_candidate_that_chooses_components_keeps_those_of_the_fit_to_all_rows(race, monkeypatch):
    """Few rows can lead to other components, and their errors are not those of the model that is chosen."""
    asked, told = entering(race, monkeypatch, [E4]), []

    def fit_one(data, key, seed, progress, given):
        progress(0.5)
        assert (data, key, seed, given) == (race.data, "k", 7, {"N": 5})
        return SimpleNamespace(fit={"structure": {"bend": 3, "creep": "no"}})

    monkeypatch.setattr(module, "fit_one", fit_one)
    race.first("a", "k", Candidate(ANY, 1.0, 0.1, {"N": 5}, structured=True), told.append)
    kept = {"N": 5, "bend": 3, "creep": "no"}
    assert (asked, told) == ([kept], [0.5])
    t = trial("a", options={"N": 5})
    assert t.options == {"N": 5}
    t.complete = race.trials["a"].complete
    monkeypatch.setattr(race, "fitted", lambda fold, key, options, progress: asked.append(dict(options)) or ([],) * 4)
    monkeypatch.setattr(race, "_other", lambda model: np.zeros(len(race.other)))
    race.again([t])
    assert asked[1:] == [kept]

    def repeats(key, **options):
        return race.repeated(key, Candidate(ANY, 1.0, 0.1, options, structured=True))

    assert (repeats("key of a", creep="yes"), repeats("other")) == ("a has the components that the data support", "")
    race.poor = True
    assert (repeats("key of a", creep="yes"), repeats("key of a", creep="no")) == ("", "a has the same components")


def test_folds_hold_blocks_inside_the_range_of_the_others(race):
    part, rows, block = race.held(1)
    held = np.zeros(400, dtype=bool)
    held[:] = module.without_outermost(U, module.validation_rows(U, 1, 8))
    kept = U[~held]
    want = [k for k in range(400) if held[k] and kept.min() <= U[k] <= kept.max()]
    assert rows.tolist() == want
    assert part.counted.tolist() == np.flatnonzero(~held).tolist()
    assert len(np.unique(block)) == np.count_nonzero(np.diff(held.astype(int)) == 1) + held[0]


def test_rows_at_the_ends_of_the_range_count(monkeypatch):
    monkeypatch.setattr(module, "unseen", lambda data: 0.0)
    u = np.interp(np.arange(801), 10 * np.arange(81), np.tile([0.0, 1.0], 41)[:81])  # all reach both ends
    part, rows, _ = Race(Dataset.from_signal(u, u, 1e-3), 0).held(1)
    assert len(rows) == 801 - len(part.counted)


def test_the_next_fold_adds_its_errors_and_outputs(race, monkeypatch):
    asked = []

    def fitted(fold, key, options, progress):
        asked.append((fold, key, dict(options)))
        if key == "key of broken":
            raise InputError("no")
        return SimpleNamespace(name=f"fold {fold}"), np.full(5, 2.0), [0.5], 0.0

    monkeypatch.setattr(race, "fitted", fitted)
    monkeypatch.setattr(race, "_other", lambda model: np.zeros(len(race.other)))
    a, b = trial("a", options={"N": 4}), trial("broken")
    race.again([a, b])
    assert asked == [(3, "key of a", {"N": 4}), (3, "key of broken", {})]
    assert (a.folds, len(a.others), len(a.errors), a.by_block) == (2, 1, 105, [0.5])
    assert b.errors[-1] == np.inf
    assert b.folds == 2
    race.again([a])
    assert asked[2][0] == 2
    assert (a.folds, len(a.others), len(a.errors)) == (3, 2, 110)


def test_what_is_missed_outside_the_blocks_counts(race):
    """No block of the first fold holds the sweep at the end of a record: a static kind misses it all the same."""
    good, flattered = trial("good", 0.4), trial("flattered", 0.3)
    race.trials = {t.name: t for t in (good, flattered)}
    assert race.best() is flattered
    flattered.whole = 1.5
    assert race.best() is good
    assert race.excess(flattered) == pytest.approx(150.0 / race.data.span, rel=0.01)
    assert not race.as_good(flattered, good)
