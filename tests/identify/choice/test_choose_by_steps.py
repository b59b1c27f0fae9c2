"""The choice step by step: who enters in which order, what each costs, when the race ends, what is told of it."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from hystfmu import Dataset, Graph, InputError, Node
from hystfmu.identify import auto, race
from hystfmu.identify.catalogue import ANY, Candidate
from hystfmu.identify.excitation.minor_loops import NONE, UNKNOWN, Excitation
from hystfmu.model import Model, guards

N = 4000
U = np.interp(np.arange(N), 20 * np.arange(201), np.random.default_rng(3).uniform(-1, 1, 201))
DATA = Dataset.from_signal(U, 10 * U, 1e-3, "record")
SPAN = float(np.ptp(DATA.y))
SEEN = Excitation(60, 150.0, 20, 0.25, True, UNKNOWN, (), ())


def fit_one(data, key, seed, progress, options):
    """Stand in for the fit to all rows."""
    return Model(key, Graph.single(Node("a", "scaling")), fit={"rms": 0.0}, provenance={"options": options})


@pytest.fixture
def chosen(monkeypatch):
    """Choose between candidates with given errors (% of the span, by fold) and parameters."""

    def make(table, seen=SEEN, data=DATA, outputs=None, fit=fit_one, bounded=(), **more):
        asked, told = [], []
        found = {name: (f"key {name}", c) for name, (c, *_) in table.items()}
        by_key = {f"key {name}": rest for name, (_, *rest) in table.items()}

        def fitted(self, fold, key, options, progress, share=1.0):
            progress(1.0)
            asked.append((key.removeprefix("key "), fold))
            errors, parameters = by_key[key]
            size = errors[race.FOLDS.index(fold)]
            level = (outputs or {}).get(key.removeprefix("key "), 0.0)
            graph = SimpleNamespace(name=key, inputs=[0], run=lambda u, h: np.full(len(u), level))
            warned = [f"n = 1 {guards.STOPPED}"] * (key.removeprefix("key ") in bounded)
            model = SimpleNamespace(fit={"parameters": parameters, "warnings": warned}, graph=graph)
            return model, np.full(50, size / 100 * SPAN), [size / 100 * SPAN], size / 100 * SPAN

        monkeypatch.setattr(race.Race, "fitted", fitted)
        monkeypatch.setattr(race, "noise", lambda y: 0.0)
        monkeypatch.setattr(race, "unseen", lambda data: 0.0)
        monkeypatch.setattr(auto, "candidates", lambda: found)
        monkeypatch.setattr(auto, "examine", lambda data: seen)
        monkeypatch.setattr(auto, "several_speeds", lambda *rows: seen.several_speeds)
        monkeypatch.setattr(auto, "too_large", lambda rows, key, given: "")
        monkeypatch.setattr(auto, "method", lambda key: SimpleNamespace(covariates=key == "key takes"))
        monkeypatch.setattr(race.guards, "leaves", lambda graph, y, measured, span: False)
        monkeypatch.setattr(auto, "fit_one", fit)
        return auto.choose(data, 0, told.append, **more), asked, told

    return make


def flat(seconds, error, parameters=3, **more):
    return Candidate(more.pop("memory", ANY), seconds, 0.0, **more), [error] * 3, parameters


def test_the_cheapest_first_and_all_that_are_no_losers_on_every_fold(chosen):
    table = {"costly": flat(3.0, 1.0, 9), "cheap": flat(1.0, 1.3, 2), "middle": flat(2.0, 1.6, 1)}
    choice, asked, told = chosen(table)
    assert asked[:3] == [("cheap", 1), ("middle", 1), ("costly", 1)]
    assert asked[3:] == [("cheap", 3), ("costly", 3), ("cheap", 2), ("costly", 2)]  # middle has lost
    # twice the cost of all: 12; each first fit, then the later folds of two
    assert told == pytest.approx([1 / 12, 3 / 12, 6 / 12, 10 / 12, 1.0])
    assert (choice.key, choice.provenance["options"]) == ("key costly", {})
    assert 0 <= choice.fit.pop("seconds") < 60
    told = {"memory": UNKNOWN, "loops": 20, "gap_percent": 0.25, "rate": "not seen", "warnings": []}
    assert choice.fit == {"rms": 0.0, **told}
    why = choice.provenance
    assert why["auto"] == pytest.approx({"costly": 1.0, "cheap": 1.3, "middle": 1.6})
    assert list(why["auto"]) == ["costly", "cheap", "middle"]
    assert why["auto_blocks"] == {
        "costly": pytest.approx([1.0] * 3), "cheap": pytest.approx([1.3] * 3), "middle": pytest.approx([1.6])
    }  # fmt: skip
    assert why["auto_parameters"] == {"costly": 9, "cheap": 2, "middle": 1}
    assert (why["auto_choice"], why["auto_left_out"]) == ("costly", {})
    assert "auto_inverse" not in why


def test_equal_ones_and_the_inverses_that_are_told(chosen):
    class Inverses:
        def kind(self, model):
            return "exact" if model.graph.name == "key b" else "none"

        def fault(self, model):
            return ""

    table = {"a": flat(1.0, 1.0, 2, options={"N": 3}), "b": flat(2.0, 1.1, 5)}
    assert chosen(table)[0].provenance["auto_choice"] == "a"
    assert chosen(table)[0].provenance["options"] == {"N": 3}
    choice, _, _ = chosen(table, inverses=Inverses())
    assert choice.provenance["auto_choice"] == "b"
    assert choice.provenance["auto_inverse"] == {"a": "none", "b": "exact"}


@pytest.mark.parametrize(("bounded", "best"), [((), "a"), (("a",), "b"), (("a", "b"), "a")])
def test_a_fit_at_a_bound_comes_behind_equal_ones(chosen, bounded, best):
    table = {"a": flat(1.0, 1.0, 2), "b": flat(2.0, 1.1, 5), "worse": flat(2.0, 1.4, 1)}
    assert chosen(table, bounded=bounded)[0].provenance["auto_choice"] == best


def test_a_candidate_that_leaves_nothing_ends_the_race(chosen):
    choice, asked, _ = chosen({"a": flat(1.0, 0.001), "b": flat(2.0, 0.5)})
    assert asked == [("a", 1)]
    assert choice.provenance["auto_left_out"] == {"b": "a has no error"}


def test_a_short_trial_fit_costs_a_fifth(chosen):
    quick = {"quick": {"starts": 1}}
    table = {"a": flat(1.0, 1.0), "b": flat(10.0, 9.0, **quick), "c": flat(12.0, 1.0)}
    choice, asked, told = chosen(table)
    assert asked[:3] == [("a", 1), ("b", 1), ("c", 1)]
    assert choice.provenance["auto_left_out"]["b"] == "9 % of the span after a short trial fit"
    # 1 + a fifth of 10 + 12 = 15 of the budget of 24; a second fold of both would need 28
    assert asked[3:] == [("c", 1)]  # expensive ones are tried on a part of the rows
    assert told == pytest.approx([1 / 46, (3 + 12) / 46])


def test_later_folds_must_fit_into_the_budget(chosen):
    assert len(chosen({"a": flat(11.9, 1.0)})[1]) == 2  # 11.9 + 11.9 of 24
    assert len(chosen({"a": flat(12.1, 1.0)})[1]) == 1
    assert len(chosen({"a": flat(3.9, 1.0), "b": flat(4.0, 1.0)})[1]) == 7  # and a short one
    assert len(chosen({"a": flat(4.0, 1.0), "b": flat(4.1, 1.0)})[1]) == 5


def test_the_only_one_left_runs_until_its_spread_is_known(chosen):
    assert chosen({"a": flat(1.0, 1.0), "b": flat(1.1, 2.0)})[1] == [("a", 1), ("b", 1), ("a", 3)]


def test_who_is_left_out_before_the_race(chosen):
    table = {"takes": flat(1.0, 1.0), "not": flat(0.5, 1.0)}
    beside = Dataset(DATA.t, DATA.u, DATA.y, covariates={"T": np.arange(float(N))})
    choice, asked, _ = chosen(table, data=beside)
    assert {name for name, _ in asked} == {"takes"}
    left = choice.provenance["auto_left_out"]
    assert left == {"not": "it takes no covariates"}
    assert list(left) == choice.provenance["auto_not_tried"], "none of them was fitted"
    records = Dataset.joined([DATA, DATA])
    assert {name for name, _ in chosen(table, data=records)[1]} == {"takes", "not"}, "each takes several records"


def test_no_kind_is_left_out_for_its_price(chosen):
    """All race on fewer rows, and the expensive one wins."""
    table = {"cheap": (Candidate(ANY, 1.0, 1.0), [2.0] * 3, 3), "expensive": (Candidate(ANY, 2.0, 60.0), [1.0] * 3, 3)}
    choice, asked, _ = chosen(table)
    assert asked[:3] == [("cheap", 1), ("expensive", 1), ("expensive", 1)]  # the first of these is short
    assert choice.provenance["auto_choice"] == "expensive"
    assert choice.provenance["auto_left_out"] == {}
    assert choice.provenance["auto_rows"] == auto.LEAST_ROWS
    assert "auto_rows" not in chosen({"cheap": table["cheap"]})[0].provenance


def test_a_part_that_does_not_represent_the_record_is_replaced_by_all_rows(chosen):
    """The model misses 5 % of the span on all rows and 1 % on the compared ones."""

    def missed(*args):
        return replace(fit_one(*args), fit={"rms": 1.0})

    best, near, far = [1.0] * 3, [3.0] * 3, [9.0] * 3
    table = {
        "near": (Candidate(ANY, 1.0, 0.5), near, 3),
        "best": (Candidate(ANY, 0.5, 5.0), best, 3),
        "far": (Candidate(ANY, 0.1, 0.1), far, 3),
        "costly": (Candidate(ANY, 9.0, 20.0), near, 3),
    }
    choice, asked, _ = chosen(table, fit=missed)
    why = choice.provenance
    assert (why["auto_choice"], "auto_rows" in why, list(why["auto"])) == ("best", False, ["best", "near"])
    assert set(why["auto_left_out"]) == {"far", "costly"}
    assert why["auto_left_out"]["far"] == "9 % of the span on 3600 rows"
    assert why["auto_not_tried"] == []
    assert [name for name, _ in asked].count("far") == 1


def test_the_fit_to_all_rows_that_chose_the_components_is_not_repeated(chosen, monkeypatch):
    def complete(data, key, seed, progress, options):
        made = fit_one(data, key, seed, progress, options)
        return replace(made, fit={"rms": 0.5, "structure": {"bend": 3}})

    monkeypatch.setattr(race, "fit_one", complete)
    table = {"a": flat(1.0, 1.0, structured=True), "b": flat(1.0, 2.0)}
    assert chosen(table)[0].fit["rms"] == 0.5
    table |= {"c": flat(130.0, 3.0)}  # compared on a part of the rows
    assert chosen(table)[0].fit["rms"] == 0.0


@pytest.mark.parametrize(("errors", "refused"), [((5.1,) * 3, True), ((4.9,) * 3, False), ((4.0, 9.0, 9.0), False)])
def test_an_error_beyond_five_percent_is_no_model(chosen, errors, refused):
    table = {"a": (Candidate(ANY, 1.0, 0.0), list(errors), 3)}
    if not refused:
        assert chosen(table)[0].key == "key a"
        return
    for others, named in (({}, ""), ({"worse": flat(2.0, 5.4)}, ", worse 5.4 %")):
        with pytest.raises(
            InputError, match=rf"record: A kind .* to 5 % of the span\. Got errors on .* of a 5\.1 %{named}\. The out"
        ):
            chosen(table | others)
    poor = Excitation(60, 150.0, 20, 0.25, True, UNKNOWN, ("few", "slow"), ())
    with pytest.raises(InputError, match=r"a 5\.1 %\. The record is poor: few; slow\. The output"):
        chosen(table, seen=poor)


@pytest.mark.parametrize(("memory", "chosen_one"), [(UNKNOWN, "b"), (NONE, "a")])
def test_on_a_poor_record_the_candidate_next_to_the_others_is_chosen(chosen, memory, chosen_one):
    """A function of the input has no memory that another record would show."""
    poor = Excitation(60, 150.0, 20, 0.25, True, memory, ("few",), ())
    table = {"a": flat(1.0, 1.0, 1), "b": flat(2.0, 1.0, 5), "c": flat(3.0, 1.0, 7)}
    outputs = {"a": 0.2 * SPAN, "b": 0.1 * SPAN, "c": 0.0}
    assert chosen(table, seen=poor, outputs=outputs)[0].provenance["auto_choice"] == chosen_one


def test_nothing_that_fits_is_one_line(chosen):
    with pytest.raises(
        InputError,
        match=r"record: A kind .* span\. Got no fit\. Measure a .* Discarded: a: 1000000 parameters for [0-9]+ rows\.$",
    ):
        chosen({"a": flat(1.0, 1.0, 10**6)})
    with pytest.raises(InputError, match=r"Got no fit\. Measure a longer record, or name a kind"):
        chosen({})
