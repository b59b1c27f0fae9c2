"""Rows of a paper's table: verdict on the print, target, groups, nearest point of a scan, the page."""

import numpy as np
import pytest
import reasons
from click.testing import CliRunner

from hystfmu.cli import main
from hystfmu.papers.table import Report, Row, nearest


@pytest.mark.parametrize(
    ("row", "verdict", "met"),
    [
        (Row("q", 2.0, ours=1.0), "met", True),
        (Row("q", 2.0, ours=5.0), "missed by a factor 2.50", False),
        (Row("q", 2.0, ours=1.0, sense="least"), "missed by a factor 2.00", False),
        (Row("q", 2.0, ours=3.0, sense="least"), "met", True),
        (Row("q", 2.0, ours=2.01, sense="equal"), "met", True),
        (Row("q", 2.0, ours=1.0, sense="equal"), "missed by a factor 2.00", False),
        (Row("q", 0.0, ours=5.75, sense="equal"), "missed, 5.75 for 0", False),
        (Row("q", 2.0), "not computed", None),
        (Row("q", ours=2.0), "", None),
    ],
)
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
    monkeypatch.setattr("hystfmu.papers.PAPERS", {"dbo_piezo": ""})
    done = CliRunner().invoke(main, ["reproduce", "--report", str(tmp_path / "out")])
    assert done.exit_code == 0, done.output
    page = (tmp_path / "out" / "dbo_piezo.html").read_text()
    assert "What the paper prints" in page
    assert "1.68" in page
    assert "not computed" in page
    assert reasons.check(Report("x", "y", (Row("q", ours=1.0),))) is None


@pytest.mark.parametrize(("group", "status"), [("beyond", 1), ("speed", 0)])
def test_a_missed_target_on_time_does_not_change_the_exit_status(group, status, monkeypatch):
    rows = (Row("q", ours=2.0, target=1.0, group=group),)
    monkeypatch.setattr("hystfmu.papers.reproduce", lambda *given: Report("x", "y", rows))
    done = CliRunner().invoke(main, ["reproduce", "zhao_tan_2008"])
    assert done.exit_code == status
    assert "missed by a factor 2.00" in done.output
