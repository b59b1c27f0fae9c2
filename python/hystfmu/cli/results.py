"""Commands that show results: the tables of the papers, and a demonstration on built-in data."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import click

from hystfmu.cli.options import FAILED, json_option


@click.command()
@click.argument("names", nargs=-1)
@click.option("--data", metavar="DIR", help="Folder with the measured data sets.")
@click.option(
    "--full",
    is_flag=True,
    help="Run every variant of a paper: shen_ma_2017 takes 12 minutes (1 to 100 hidden neurons).",
)
@json_option
def reproduce(names: tuple[str, ...], data: str | None, full: bool, as_json: bool) -> None:
    """Reproduce the result tables of the papers.

    Each row gives the published number, a literal replica, and the result of HystFMU.  The exit status is 1 if a target
    is missed; the row says by how much.

    \b
    Example: hystfmu reproduce zhao_tan_2008
    """
    from hystfmu.base.errors import InputError
    from hystfmu.papers import NEEDS_DATA, PAPERS
    from hystfmu.papers import reproduce as reproduce_paper
    from hystfmu.report.terminal import progress

    for name in names if data is None else ():  # without names, the table itself says that its data is missing
        if name in NEEDS_DATA:
            raise InputError(f"{name}: the measured data is not part of this package; name its folder with --data DIR")
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
@click.option("-o", "out", default="demo", show_default=True, metavar="DIR", help="Folder to write into.")
def demo(out: str) -> None:
    """Run the whole workflow on built-in data.

    Fits and compares models, exports FMUs, runs scenarios and writes a report.

    \b
    Example: hystfmu demo -o demo
    """
    from hystfmu.demo.run import demo as run_demo

    sys.exit(0 if run_demo(Path(out)) else FAILED)
