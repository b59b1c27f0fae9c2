"""The page of the papers: complete, generated from records, and the records hold what the commands compute."""

import json
import re
import shlex
from pathlib import Path

import click
import generated
import numpy as np
import papers_table
import pytest
import reasons
from invoked import invoked

from hystfmu import InputError, signals
from hystfmu.cli import main
from papers import PAPERS, quick
from papers.statements.branches import area, crossings, least_slope

ROOT = Path(__file__).parents[2]
PAGE = ROOT / "python" / "docs" / "papers.md"
COMPLETE = {  # equations, tables and figures that each paper has
    "zhao_tan_2008": (11, 0, 13),
    "shen_ma_2017": (11, 3, 4),
    "ipmc_bfbnn": (20, 1, 7),
    "yu_alici_2005_smc": (5, 0, 11),
}
STATED = {  # lemmas, theorems, remarks and sections with a statement
    "zhao_tan_2008": {"assumption 1", "theorem 1", "theorem 2", "sec. V.A", "sec. V.B"}
    | {f"remark {n}" for n in range(1, 6)},
    "shen_ma_2017": {"sec. 3.1", "sec. 3.3"},
    "ipmc_bfbnn": {"sec. 4"},
    "yu_alici_2005_smc": {"sec. II", "sec. III", "sec. IV"},
}
COMMANDS = sorted(set(re.findall(r"`(hystfmu [^`]+)`", papers_table.markdown())))
RELATIVE = 1e-6  # of figures that are computed anew: least squares and closed forms


def parsed(command):
    """Parse a command without running it: unknown commands and options raise."""
    program, verb, *arguments = shlex.split(command)
    assert program == "hystfmu"
    context = click.Context(main)
    chosen = main.get_command(context, verb)
    assert chosen is not None, f"no command {verb}"
    return chosen.make_context(verb, list(arguments), parent=context).params


@pytest.mark.parametrize("paper", COMPLETE)
def test_every_equation_table_figure_and_statement_has_a_row(paper):
    found = papers_table.places(paper)
    for word, most in zip(("eq.", "table", "fig."), COMPLETE[paper], strict=True):
        missing = {f"{word} {n}" for n in range(1, most + 1)} - found
        assert not missing, f"{paper}: {sorted(missing)}"
    assert STATED[paper] <= found, STATED[paper] - found


@pytest.mark.parametrize("paper", COMPLETE)
def test_every_row_of_the_page_has_a_figure_and_every_miss_a_reason(paper):
    for row in reasons.recorded(paper):
        if row["group"] == "paper":
            assert {"literal", "ours"} & set(row), row["quantity"]
        if row.get("printed_met") is False:
            assert row["note"], row["quantity"]
            assert re.match(r"missed(, | by a factor )[\d.]+", row["verdict"]), row["verdict"]


@pytest.mark.parametrize("paper", COMPLETE)
def test_networks_have_five_seeds_and_a_range(paper):
    seeded = [r for r in reasons.recorded(paper) if r["seeds"] > 1]
    assert seeded
    for row in seeded:
        assert row["seeds"] >= 5, row["quantity"]
        for name in ("literal", "ours"):
            low, high = row.get(f"{name}_range", (row.get(name),) * 2)
            assert low is None or low <= row[name] <= high, row["quantity"]


@pytest.mark.turn("figures of papers")
@pytest.mark.some(1)
@pytest.mark.parametrize("paper", COMPLETE)
def test_quick_rows_are_those_that_were_recorded(paper):
    rows = quick(paper)
    assert len(rows) >= 3
    # the literal a_0 follows from normal equations of condition 2e15: threads of BLAS change its fifth digit
    sharp = [r for r in rows if not r.quantity.startswith("a_0")]
    assert not reasons.differences(sharp, reasons.recorded(paper), RELATIVE)
    assert not reasons.differences(rows, reasons.recorded(paper), 1e-2)


@pytest.mark.stress
def test_a_figure_changed_on_the_page_is_stale(monkeypatch, tmp_path, capsys):
    text = PAGE.read_text()
    assert re.search(r"\| 5\.751 \|", text)
    (tmp_path / "python" / "docs").mkdir(parents=True)
    page = tmp_path / "python" / "docs" / "papers.md"
    monkeypatch.setattr(generated, "ROOT", tmp_path)
    monkeypatch.setattr(generated, "PARTS", tuple((page, *p[1:]) for p in generated.PARTS if p[0] == PAGE))
    found = []
    for written in (text, text.replace("| 5.751 |", "| 5.809 |", 1)):
        page.write_text(written)
        generated.main(write=False)
        found.append("python/docs/papers.md: a generated table is stale" in capsys.readouterr().out)
    assert found == [False, True]


@pytest.mark.parametrize("command", COMMANDS)
def test_every_command_exists(command):
    params = parsed(command)
    for name in params.get("names", ()):
        assert name in PAPERS
    for folder in params.get("scenarios", ()):
        assert (ROOT / folder).is_dir(), folder


@pytest.mark.stress
@pytest.mark.parametrize("command", [c for c in COMMANDS if not c.startswith("hystfmu reproduce")])
def test_every_experiment_exits_with_0(command, monkeypatch):
    monkeypatch.chdir(ROOT)
    invoked(shlex.split(command)[1:])


@pytest.mark.stress
@pytest.mark.parametrize("paper", COMPLETE)
def test_a_paper_reproduces_what_was_recorded(paper, tmp_path):
    """Another machine rounds otherwise, so a trained network may end a little elsewhere; times are not compared."""
    done = invoked(["reproduce", paper, "--json", "--report", str(tmp_path)])
    assert list(tmp_path.glob("*.html"))
    (table,) = json.loads(done.stdout)
    rows = [papers_table.row_of(r) for r in table["rows"] if r["group"] == "paper"]
    assert not reasons.differences(rows, reasons.recorded(paper), 0.1)


def test_a_paper_without_quick_rows_is_one_line():
    with pytest.raises(InputError, match=r"must have rows that take seconds\. Got 'loops' instead"):
        quick("loops")


def test_shares_of_the_span_in_the_errata_are_recorded():
    errata = (PAGE.parent / "explanation" / "errata.md").read_text()
    said = re.findall(r"(\d+\.\d+) % of the span", errata)
    assert len(said) >= 4
    known = [r["ours"] for name in COMPLETE for r in reasons.recorded(name) if "ours" in r and r["group"] == "paper"]
    for text in said:
        digits = len(text.partition(".")[2])
        assert any(f"{v:.{digits}f}" == text for v in known), text


# ---- Crossings of branches on curves whose crossings are known in closed form
def test_two_branches_that_cross_once():
    """x goes 0, 1, 0, 1; h = x on the first branch, 1 on the second, x^2 + 1/4 - 1/8 on the third."""
    x = signals.ramps([0.0, 1.0, 0.0, 1.0], 1e-3)
    part = np.cumsum(np.abs(np.diff(x, prepend=0.0)))
    h = np.where(part <= 1, x, np.where(part <= 2, 1.0, x**2 + 3 / 16))
    y = np.where(part <= 1, 0.0, np.where(part <= 2, 5.0, 2 * x))
    found = crossings(x, h, y)
    assert (found.neighbours, found.others) == (1, 2)  # at x = sqrt(13)/4 with its neighbour, at 1/4 and 3/4
    assert found.difference == pytest.approx(5 - 2 * np.sqrt(13) / 4, abs=1e-3)


def test_a_closed_loop_has_no_crossing_and_its_area():
    t = 2 * np.pi * np.arange(400) / 400
    assert area(np.cos(t), np.sin(t)) == pytest.approx(np.pi / 4, rel=1e-3)
    assert area(np.cos(t), -np.sin(t)) == pytest.approx(-np.pi / 4, rel=1e-3)
    x = signals.ramps([0.0, 1.0, 0.0], 1e-2)
    assert least_slope(x, x**2, 0.1) == pytest.approx(0.01, abs=1e-9), "falling to 0: the slope of the last step"
    assert crossings(x, np.append(x[:101] ** 2, np.sqrt(x[101:])), x).neighbours == 0
