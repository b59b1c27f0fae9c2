"""The page of the choice benchmark: its ratios, its misses, and what it says of seeds and commits."""

import math
from pathlib import Path

import pytest

BENCHMARKS = Path(__file__).parents[2] / "benchmarks"
LUGRE, BATTERY, PLAYS = ("LuGre", "chirp"), ("battery, one state", "chirp"), ("plays", "offset")


@pytest.fixture
def bench(monkeypatch):
    monkeypatch.syspath_prepend(BENCHMARKS)
    import choice_page

    return choice_page


def chosen(error, key="duhem", code="1234abcd"):
    return {"error": error, "key": key, "choice": key, "seconds": 2.0, "code": code}


def cells():
    refused = {"refused": "no kind", "seconds": 2.0, "code": "5678abcd"}
    return {
        (*PLAYS, 7): {"auto": chosen(0.001), "bouc_wen": {"left out": "far", "seconds": 0.0}},
        (*BATTERY, 7): {"auto": chosen(0.06), "bouc_wen": {"error": 0.02}, "truth": {"error": 0.002}},
        (*LUGRE, 7): {"auto": chosen(5.0), "bouc_wen": {"error": 2.0}, "truth": {"error": 0.2}},
        (*LUGRE, 8): {"auto": refused, "bouc_wen": {"error": 2.0}, "truth": {"error": 0.2}},
    }


def test_ratios_count_what_is_equal_and_what_is_refused(bench):
    found = cells()
    of = {at: (bench.ratio(at, known), bench.to_truth(at, known)) for at, known in found.items() if "truth" in known}
    assert of == {(*BATTERY, 7): (1.0, 1.0), (*LUGRE, 7): (2.5, 25.0), (*LUGRE, 8): (float("inf"), float("inf"))}
    found[*LUGRE, 8]["bouc_wen"]["error"] = 4.0
    assert math.isnan(bench.ratio((*LUGRE, 8), found[(*LUGRE, 8)])), "the refusal is right"
    assert bench.errors(found[*PLAYS, 7]) == {"duhem": 0.001}, "options of the choice stand for their kind"


def test_the_page_lists_what_it_misses_and_how_many_seeds_a_row_has(bench):
    text = bench.page(cells())
    flat = " ".join(text.split())
    assert "2 of 3 rows meet both goals; missed: LuGre (chirp)." in flat
    assert "The median ratio to the truth over 2 rows is inf; the goal is at most 3." in flat
    assert "1 of 2 rows are at most 3; above it: LuGre (chirp inf)." in flat
    assert "seed 7 has 3 rows (3 at commit 1234abcd); seed 8 has 1 rows (1 at commit 5678abcd)" in flat
    assert "| LuGre | chirp | 2 | inf | inf | 0 |" in text
    assert "| plays | offset | 1 | 1.00 | 1.00 | 0 | duhem | duhem | 0.001 | - | - |" in text


def test_the_page_says_that_a_truth_does_not_know_the_next_row(bench):
    damper = {("Spencer's MR damper", "chirp", 7): {"auto": chosen(0.8), "truth": {"error": 0.7}}}
    for known, said in ((cells(), False), (cells() | damper, True)):
        assert ("takes the velocity at a row from the next row" in " ".join(bench.page(known).split())) == said
