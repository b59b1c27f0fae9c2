"""Rows of a paper's table: verdict on the print, target, groups, nearest point of a scan, the page."""

import re

import numpy as np
import pytest
import reasons
from invoked import invoked

from hystfmu.report.diagrams import Ratio, Ratios
from papers.table import Report, Row, bounded, nearest


@pytest.mark.parametrize(("row", "verdict", "met"), [
    (Row("q", 2.0, ours=1.0), "met", True),
    (Row("q", 2.0, ours=5.0), "missed by a factor 2.50", False),
    (Row("q", 2.0, ours=1.0, sense="least"), "missed by a factor 2.00", False),
    (Row("q", 2.0, ours=3.0, sense="least"), "met", True),
    (Row("q", 2.0, ours=2.01, sense="equal"), "met", True),
    (Row("q", 2.0, ours=1.0, sense="equal"), "missed by a factor 2.00", False),
    (Row("q", 0.0, ours=5.75, sense="equal"), "missed, 5.75 for 0", False),
    (Row("q", 2.0), "not computed", None),
    (Row("q", 2.0, ours=1.0, scanned=(3, 9)), "met; met on 3 of 9 scanned records", True),
    (Row("q", 9.0, ours=9.0, ours_range=(6.0, 9.0), sense="equal"), "missed by a factor 1.50", False),
    (Row("q", ours=2.0), "", None),
])  # fmt: skip
def test_every_printed_figure_has_a_verdict(row, verdict, met):
    assert (row.printed_verdict(), row.printed_met) == (verdict, met)
    assert row.met is None, "the exit status follows targets only"


def test_a_miss_of_a_numpy_number_is_a_miss():
    row = Row("q", 1.0, ours=np.float64(2.0), target=1.0)
    assert row.met is False
    assert row.printed_met is False


def test_a_target_is_apart_from_the_print():
    row = Row("q", 1.0, 2.0, 1.5, 2.0, place="fig. 1")
    assert (row.printed_verdict(), row.verdict(), row.met) == ("missed by a factor 1.50", "met", True)
    assert Row("q", ours=1.0, target=4.0, at_least=True).verdict() == "missed by a factor 4.00"


def test_figures_of_seeds_are_medians_with_the_range():
    row = Row.over_seeds("q", 3.0, [[5.0, 1.0, 2.0], [0.5]], place="p")
    assert (row.literal, row.literal_range, row.ours, row.ours_range, row.seeds) == (2.0, (1.0, 5.0), 0.5, None, 3)
    alone = Row.over_seeds("q", None, [[], [1.0, np.inf]], place="p")
    assert (alone.literal, alone.ours_range) == (None, (1.0, np.inf))
    table = Report("x", "y", (row, alone))
    assert table.tables()[0][2][0][2:] == ["3", "2 (1 .. 5)", "0.6667", "0.5", "3", "met"]
    assert table.data()["rows"][1]["ours"] is None, "JSON has no infinity"


def test_an_answer_counts_the_scanned_records():
    rows = (Row("a", 1.0, ours=0.5, place="p", scanned=(2, 9)), Row("b", 1.0, ours=2.0, place="p", scanned=(0, 3)))
    assert Report("x", "y", rows).answer() == (
        "1 of 2 printed figures and statements are met. On the scanned records, 2 of 12 printed figures are met."
    )


def test_groups_have_tables_of_their_own_without_empty_columns():
    rows = (
        Row("error", 0.5, 0.6, 0.4, place="fig. 1"),
        Row("error of a package", reported=0.3, group="reported"),
        Row("time", ours=0.1, target=1.0, group="speed"),
    )
    tables = Report("x", "y", rows).tables()
    assert [head for _, head, _ in tables] == [
        ["place", "quantity", "printed", "literal", "literal / printed", "ours", "against print"],
        ["quantity", "reported"],
        ["quantity", "ours", "target", "against target"],
    ]
    assert tables[0][2] == [["fig. 1", "error", "0.5", "0.6", "1.2", "0.4", "met"]]


def test_nearest_takes_the_least_of_the_largest_factors():
    scanned = [("a", (1.0, 4.0)), ("b", (0.5, 1.6)), ("c", (0.9, 3.0))]
    assert nearest(scanned, (1.0, 1.0)) == "b"


def test_report_writes_a_page_for_each_paper(tmp_path, monkeypatch):
    monkeypatch.setattr("papers.PAPERS", {"dbo_piezo": ""})
    invoked(["reproduce", "--report", str(tmp_path / "out")])
    page = (tmp_path / "out" / "dbo_piezo.html").read_text()
    assert "What the paper prints" in page
    assert "1.68" in page
    assert "not computed" in page
    assert reasons.check(Report("x", "y", (Row("q", ours=1.0),))) is None


@pytest.mark.parametrize(("group", "status"), [("beyond", 1), ("speed", 0)])
def test_a_missed_target_on_time_does_not_change_the_exit_status(group, status, monkeypatch):
    rows = (Row("q", ours=2.0, target=1.0, group=group),)
    monkeypatch.setattr("papers.reproduce", lambda *given: Report("x", "y", rows))
    done = invoked(["reproduce", "zhao_tan_2008"], status=status)
    assert "missed by a factor 2.00" in done.output


def test_the_first_figure_shows_ratios_to_what_is_printed_the_missed_ones_first():
    rows = [
        Row("met", 2.0, 4.0, 1.0, place="p"), Row("least", 90.0, ours=95.0, sense="least", place="p"),
        Row("equal", 50.0, ours=40.0, sense="equal", place="p"), Row("over", 1.0, ours=1.5, place="p"),
        Row("none", 0.0, ours=1.0, place="p"), Row("scan", 1.0, ours=3.0, group="scan"), Row("alone", ours=1.0),
    ]  # fmt: skip
    (drawn,) = bounded(rows)
    expected = {"over": (1.5, False), "equal": (1.25, False), "least": (90 / 95, True), "met": (0.5, True)}
    assert {r.name: (pytest.approx(r.value), r.good) for r in drawn.ratios} == expected
    assert [r.name for r in drawn.ratios] == list(expected)
    assert [r.other for r in drawn.ratios] == [None, None, None, 2.0]
    assert drawn.ratios[0].text == "1.5 for 1"
    (targets,) = bounded([Row("a", ours=4.0, target=2.0, at_least=True), Row("b", ours=1.0, target=2.0)])
    assert [(r.name, r.value, r.good) for r in targets.ratios] == [("a", 0.5, True), ("b", 0.5, True)]
    assert bounded([Row("alone", ours=1.0)]) == []


def test_ratios_stand_on_a_logarithmic_axis_within_its_ends():
    some = [Ratio("a" * 60, 10.0, "x", False), Ratio("b", 1.0, "x", True, 0.1), Ratio("c", 1e9, "x", False)]
    svg = Ratios("title", "label", some, ("ours", "theirs")).svg()
    at = [float(v) for v in re.findall(r'dots c\d big" d="M([\d.]+) \d+z', svg)][2:]  # behind the legend
    one = float(re.search(r"H470M([\d.]+) ", svg)[1])
    (other,) = re.findall(r'whisker" d="M([\d.]+) \d+v10', svg)[1:]
    assert at[1] == one
    assert at[0] - one == pytest.approx(one - float(other), abs=0.2)
    assert at[0] < at[2] <= 470
    assert ">" + "a" * 22 + "..." + "a" * 22 + "<" in svg


def test_a_page_says_how_many_figures_are_met():
    report = Report(
        "p",
        "s",
        (
            Row("a", 1.0, ours=0.5, place="p"),
            Row("b", 1.0, ours=2.0, place="p"),
            Row("c", 1.0, ours=1.0, target=2.0, group="scan"),
        ),
    )
    assert report.answer() == "1 of 2 printed figures and statements are met. 1 of 1 targets are met."
    assert Report("p", "s", (Row("a", ours=1.0),)).answer() == "Nothing is printed, and no target is stated."
    assert "<figure>" not in Report("p", "s", (Row("a", ours=1.0),)).html()
