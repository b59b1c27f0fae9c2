"""The choice between candidates by numbers: who is left out, whether a rate shows, which of equal ones is preferred."""

from __future__ import annotations

import pytest
from trials import E4, trial

from hystfmu.identify import auto
from hystfmu.identify.auto import refusal
from hystfmu.identify.catalogue import ANY, CLOSES, LAGS, LATE, OPENS, Candidate
from hystfmu.identify.excitation.minor_loops import NONE, OPEN_LOOPS, RETURN_POINT, UNKNOWN, Excitation


def seen(**changed):
    values = {"reversals": 60, "samples_per_cycle": 150.0, "loops": 20, "gap": 0.0, "several_speeds": True}
    return Excitation(**{**values, "memory": UNKNOWN, "warnings": (), "coarse": (), **changed})


def test_how_many_rows_all_can_be_tried_on():
    cheap = [Candidate(ANY, 1.0, 0.1)] * 12  # 12 s, and 1.2 s per 1000 rows
    assert auto.affordable(cheap, 10_000) == 10_000  # 24 s
    assert auto.affordable(cheap, 10_001) == 9000
    quick = [Candidate(ANY, 2.0, 4.0, quick={"N": 1})] * 2  # 0.3 of 4 s and 8 s per 1000
    assert auto.affordable(quick, 9500) == 9500
    assert auto.affordable([*quick, Candidate(ANY, 0.3, 0.0)], 9500) == 8550
    expensive = [Candidate(ANY, 2.0, 4.0)] * 2  # tried on a part of the rows
    assert auto.affordable(expensive, 9500) == 9500
    assert auto.affordable([Candidate(ANY, 2.9, 0.0)] * 12, 30_000) == auto.LEAST_ROWS
    assert auto.affordable([Candidate(ANY, 2.9, 0.0)] * 12, 500) == 500


@pytest.mark.parametrize(
    ("memory", "record", "reason"),
    [
        (OPENS, {"memory": NONE}, "the output is a function of the input"),
        (OPENS, {"memory": RETURN_POINT, "gap": 0.043}, "minor loops close (gap 0.043 % of the span of y)"),
        (OPENS, {"memory": RETURN_POINT, "gap": 0.053}, None),
        (CLOSES, {"memory": OPEN_LOOPS, "gap": 2.01}, "minor loops stay open by 2 % of the span of y"),
        (CLOSES, {"memory": OPEN_LOOPS, "gap": 2.0}, None),
        (CLOSES, {"memory": UNKNOWN, "gap": 9.0}, None),
        (LAGS, {"several_speeds": False}, "the input has one speed only and is not informative about rate dependence"),
        (LAGS, {}, None),
        (LATE, {"several_speeds": False}, None),
        (LATE, {"memory": RETURN_POINT, "gap": 0.043}, "minor loops close (gap 0.043 % of the span of y)"),
        (LATE, {"memory": NONE}, "the output is a function of the input"),
        (ANY, {"memory": NONE, "several_speeds": False}, None),
    ],
)
def test_who_contradicts_the_record(memory, record, reason):
    left = auto.left_out({"x": Candidate(memory, 1.0, 0.0)}, seen(**record))
    assert left == ({} if reason is None else {"x": reason})


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
        (("small", "large"), None, False, "small"),  # nothing as good stays inside: a worse kind is no remedy
        ((), Inverses([], ["small"]), False, "small"),
        ((), Inverses([], ["small"]), True, "large"),
        ((), Inverses([], ["small", "large", "worse"]), True, "outsider"),
        (("small", "large", "worse"), None, False, "small"),
        ((), Inverses([], ["small", "large", "worse", "outsider"]), True, None),
    ],
)
def test_the_preferred_of_equal_ones(race, monkeypatch, excursions, inverses, only, chosen):
    monkeypatch.setattr(race, "leaves", lambda t: t.name in excursions)
    able = [
        trial("large", 1.0 * E4, parameters=9),
        trial("small", 1.1 * E4, parameters=2),
        trial("worse", 2 * E4, parameters=1),
    ]
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


def test_a_static_kind_is_no_refuge_where_none_follows(race, monkeypatch):
    """A rate that is not seen leaves static kinds, but only those that follow the data."""
    monkeypatch.setattr(race, "leaves", lambda t: False)
    race.trials = {t.name: t for t in (trial("lags", 4.5 * E4, memory=LAGS), trial("static", 5.2 * E4))}
    assert auto._preferred(race, False, None, False, {}).name == "lags"
    race.trials["static"] = trial("static", 4.9 * E4)
    assert auto._preferred(race, False, None, False, {}).name == "static"
    race.trials = {"a": trial("a", 5.2 * E4)}
    assert auto._preferred(race, True, None, False, {}) == {}


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
    report = auto._Report(told.append)
    for part in (0.1, 0.3, 0.2, 0.5):
        report(part)
    report(0.5, 0.9, 0.5)
    report(0.5, 0.9, 1.5)
    assert told == pytest.approx([0.1, 0.3, 0.3, 0.5, 0.7, 0.9])
