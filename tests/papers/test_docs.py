"""The table of the papers in python/docs: complete, its commands exist, the quick ones exit as stated."""

import re
import shlex
from pathlib import Path

import click
import paper_items
import pytest
from click.testing import CliRunner

from hystfmu.cli import main
from hystfmu.papers import PAPERS, reproduce, yu_alici_2005_smc

ROOT = Path(__file__).parents[2]
COMPLETE = {  # equations, tables and figures that each paper has
    "zhao_tan_2008": (11, 0, 13),
    "shen_ma_2017": (11, 3, 4),
    "ipmc_bfbnn": (20, 1, 7),
    "yu_alici_2005_smc": (5, 0, 11),
}
ITEMS = paper_items.read()
SLOW = ("hystfmu reproduce", "hystfmu run scenarios/papers")  # run under the stress marker; the latter in scenarios too
COMMANDS = sorted({(i.command, i.status) for items in ITEMS.values() for i in items})


def parsed(command):
    """Parse a command without running it: unknown commands and options raise."""
    program, verb, *arguments = shlex.split(command)
    assert program == "hystfmu"
    context = click.Context(main)
    chosen = main.get_command(context, verb)
    assert chosen is not None, f"no command {verb}"
    try:
        return verb, chosen.make_context(verb, list(arguments), parent=context).params
    except click.exceptions.Exit:  # eager options such as --models are run by the quick tests
        return verb, {}


@pytest.mark.parametrize("paper", COMPLETE)
def test_every_equation_table_and_figure_has_a_row(paper):
    found = {place for item in ITEMS[paper] for place in item.places}
    for word, most in zip(("eq.", "table", "fig."), COMPLETE[paper], strict=True):
        missing = {f"{word} {n}" for n in range(1, most + 1)} - found
        assert not missing, f"{paper}: {sorted(missing)}"
    assert all(item.verdict and item.command for item in ITEMS[paper])


@pytest.mark.parametrize(("command", "status"), COMMANDS)
def test_every_command_exists(command, status):
    _verb, params = parsed(command)
    assert status in (0, 1)
    for name in params.get("names", ()):
        assert name in PAPERS
    for folder in params.get("scenarios", ()):
        assert (ROOT / folder).is_dir(), folder


@pytest.mark.parametrize(("command", "status"), [c for c in COMMANDS if not c[0].startswith(SLOW)])
def test_quick_commands_exit_as_stated(command, status, monkeypatch):
    monkeypatch.chdir(ROOT)
    done = CliRunner().invoke(main, shlex.split(command)[1:])
    assert done.exit_code == status, done.output


@pytest.mark.stress
@pytest.mark.parametrize(("command", "status"), [c for c in COMMANDS if c[0].startswith(SLOW)])
def test_slow_commands_exit_as_stated(command, status, monkeypatch, tmp_path):
    monkeypatch.chdir(ROOT)
    words = [str(tmp_path) if word == "out" else word for word in shlex.split(command)[1:]]
    done = CliRunner().invoke(main, words)
    assert done.exit_code == status, done.output
    assert "out" not in shlex.split(command) or list(tmp_path.glob("*.html"))


def test_a_miss_says_by_how_much():
    for items in ITEMS.values():
        for item in items:
            for said in re.findall(r"missed[^.;:]*", item.verdict):
                assert re.search(r"missed by a factor \d|missed$", said), item.verdict
            assert not item.verdict.endswith("missed"), item.verdict


def test_the_verdict_on_the_only_formula_of_yu_and_alici():
    (item,) = (i for i in ITEMS["yu_alici_2005_smc"] if "sec. IV" in i.places)
    (row,) = (r for r in yu_alici_2005_smc._bound() if r.printed is not None)
    assert row.place == "sec. IV"
    assert row.printed_verdict() in item.verdict


def test_the_papers_of_the_table_are_those_that_are_reproduced():
    assert set(ITEMS) == set(COMPLETE)
    assert set(ITEMS) < set(PAPERS)
    assert callable(reproduce)
