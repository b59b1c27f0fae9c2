"""Commands that show results: the tables of the papers, and everything once on built-in data."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import click

from hystfmu.cli.options import FAILED, json_option


@click.command()
@click.argument("names", nargs=-1)
@click.option("--data", metavar="DIR", help="Folder with measured data, for the data sets that need it.")
@click.option("--full", is_flag=True, help="Everything a paper tried: shen_ma_2017 1..100 hidden neurons, 12 minutes.")
@json_option
def reproduce(names: tuple[str, ...], data: str | None, full: bool, as_json: bool) -> None:
    """The result tables of the papers.

    The printed number, a literal replica, and ours.  Exit status 1 if a target is missed; the line says by how much.

    \b
    Example: hystfmu reproduce zhao_tan_2008
    """
    from hystfmu.base.errors import InputError
    from hystfmu.papers import NEEDS_DATA, PAPERS
    from hystfmu.papers import reproduce as reproduce_paper
    from hystfmu.report.terminal import progress

    for name in names if data is None else ():  # of all tables it is one that says what it leaves out
        if name in NEEDS_DATA:
            raise InputError(f"{name}: its measured data is not part of this package; give --data DIR with it")
    reports = []
    for name in names or PAPERS:
        with progress(name) as report:
            reports.append(reproduce_paper(name, data, report, full))
        if not as_json:
            click.echo(reports[-1].text() + "\n")
    if as_json:
        click.echo(json.dumps([r.data() for r in reports]))
    sys.exit(FAILED if any(row.met is False for r in reports for row in r.rows) else 0)


@click.command()
@click.option("-o", "out", default="demo", show_default=True, metavar="DIR", help="Directory to write into.")
def demo(out: str) -> None:
    """Everything once on built-in data.

    Fit, compare, export, run scenarios, report.

    \b
    Example: hystfmu demo -o demo
    """
    from hystfmu.demo.run import demo as run_demo

    sys.exit(0 if run_demo(Path(out)) else FAILED)
