"""The choice between candidates by numbers: who is left out, whether a rate shows, which of equal ones is preferred."""

from __future__ import annotations

import pytest
from trials import E4, trial

from hystfmu import InputError
from hystfmu.identify import auto
from hystfmu.identify.candidate import ANY, CLOSES, LAGS, OPENS, Candidate
from hystfmu.identify.excitation.minor_loops import NONE, OPEN_LOOPS, RETURN_POINT, UNKNOWN, Excitation


def seen(**changed):
    values = {"reversals": 60, "samples_per_cycle": 150.0, "loops": 20, "gap": 0.0, "several_speeds": True}
    return Excitation(**{**values, "memory": UNKNOWN, "warnings": (), "coarse": (), **changed})


def test_a_long_record_may_take_longer():
    assert auto.budget(0) == 24.0
    assert auto.budget(4000) == pytest.approx(24.36)


@pytest.mark.parametrize(
    ("memory", "record", "reason"),
    [
        (OPENS, {"memory": NONE}, "the output is a function of the input"),
        (OPENS, {"memory": RETURN_POINT, "gap": 0.123}, "minor loops close (gap 0.12 % of the span of y)"),
        (CLOSES, {"memory": OPEN_LOOPS, "gap": 2.01}, "minor loops stay open by 2 % of the span of y"),
        (CLOSES, {"memory": OPEN_LOOPS, "gap": 2.0}, None),
        (CLOSES, {"memory": UNKNOWN, "gap": 9.0}, None),
        (LAGS, {"several_speeds": False}, "the input has one speed only and is not informative about rate dependence"),
        (LAGS, {}, None),
        (ANY, {"memory": NONE, "several_speeds": False}, None),
    ],
)
def test_who_contradicts_the_record(memory, record, reason):
    left = auto.left_out({"x": Candidate(memory, 1.0, 0.0)}, seen(**record), 1000)
    assert left == ({} if reason is None else {"x": reason})


def test_the_budget_leaves_out_the_dearest_and_trial_fits_last():
    table = {"a": Candidate(ANY, 14.0, 0.0), "b": Candidate(ANY, 10.0, 0.0), "c": Candidate(ANY, 0.1, 0.0)}
    assert auto.left_out(table, seen(), 0) == {"a": "about 14 s for 0 rows; fit it by name"}
    assert auto.left_out({k: table[k] for k in "ab"}, seen(), 0) == {}
    quick = {"a": Candidate(ANY, 15.0, 0.0), "b": Candidate(ANY, 11.0, 0.0, quick={"N": 1})}
    assert list(auto.left_out(quick, seen(), 0)) == ["b"]


@pytest.mark.parametrize(
    ("lags", "other", "speeds", "told"),
    [
        (1.0, 1.21, True, "seen"), (1.0, 1.19, True, "not seen"), (0.05, 0.099, True, "not seen"),
        (0.05, 0.101, True, "seen"), (1.0, 9.0, False, "one speed only"), (None, 9.0, True, "not seen"),
    ],
)  # fmt: skip
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


@pytest.mark.parametrize(
    ("excursions", "inverses", "only", "chosen"),
    [
        ((), None, False, "small"),
        ((), Inverses(["large"]), False, "large"),
        ((), Inverses(["worse"]), False, "small"),
        (("small",), None, False, "large"),
        (("small", "large"), None, False, "worse"),
        ((), Inverses([], ["small"]), False, "small"),
        ((), Inverses([], ["small"]), True, "large"),
        ((), Inverses([], ["small", "large", "worse"]), True, "outsider"),
        (("small", "large", "worse"), None, False, None),
        ((), Inverses([], ["small", "large", "worse", "outsider"]), True, None),
    ],
)
def test_the_preferred_of_equal_ones(race, monkeypatch, excursions, inverses, only, chosen):
    monkeypatch.setattr(auto.guards, "excursion", lambda key, graph, data: ["wild"] if graph in excursions else [])
    able = [
        trial("large", 1.0 * E4, parameters=9),
        trial("small", 1.1 * E4, parameters=2),
        trial("worse", 2 * E4, parameters=1),
    ]
    race.trials = {t.name: t for t in [*able, trial("outsider", 4.9 * E4), trial("bad", 5.1 * E4, parameters=1)]}
    if chosen is None:
        rule = "A kind of model must have a useful inverse" if only else "The data must suit a candidate"
        with pytest.raises(InputError, match=rf"here: {rule}\. Got none: .* \(.*\)(; \d have other faults)?\.$"):
            auto._preferred(race, able, inverses, only, "here")
    else:
        assert auto._preferred(race, able, inverses, only, "here").name == chosen


@pytest.mark.parametrize(
    ("memory", "of_record", "warned"),
    [
        (OPENS, RETURN_POINT, 1),
        (CLOSES, OPEN_LOOPS, 1),
        (CLOSES, RETURN_POINT, 0),
        (OPENS, OPEN_LOOPS, 0),
        (ANY, UNKNOWN, 0),
    ],
)
def test_a_choice_against_the_minor_loops_is_warned_of(memory, of_record, warned):
    found = auto._warnings(trial("t", memory=memory), seen(memory=of_record, gap=1.234))
    assert len(found) == warned
    assert all("is t, but the minor loops in the data have a gap of 1.2 % of the span" in line for line in found)


def test_progress_never_falls():
    told = []
    report = auto._rising(told.append)
    for part in (0.1, 0.3, 0.2, 0.5):
        report(part)
    assert told == [0.1, 0.3, 0.3, 0.5]
    told.clear()
    auto._share(told.append, 0.2, 0.6, 0.5)
    auto._share(told.append, 0.2, 0.6, 1.5)
    assert told == pytest.approx([0.4, 0.6])
