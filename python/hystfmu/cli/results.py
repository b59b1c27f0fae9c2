"""Commands that show results: the tables of the papers, and a demonstration on built-in data."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import click

from hystfmu.cli.options import FAILED, Command, json_option


@click.command(cls=Command)
@click.argument("names", nargs=-1)
@click.option("--data", metavar="DIR", help="Folder with the measured data sets.")
@click.option(
    "--full",
    is_flag=True,
    help="Run every variant of a paper: shen_ma_2017 takes 12 minutes (1 to 100 hidden neurons).",
)
@click.option(
    "--report", "folder", metavar="DIR", help="Write a page per paper: tables, and its figures from our data."
)
@json_option
def reproduce(names: tuple[str, ...], data: str | None, full: bool, folder: str | None, as_json: bool) -> None:
    """Reproduce the result tables of the papers.

    Each row gives its place in the paper, the printed figure, a literal replica and the result of HystFMU on the same
    quantity, and says whether the printed figure is met or by which factor it is missed.  The exit status is 1 if a
    stated target is missed; a missed figure without a target, or a target on time, which depends on the load of the
    machine, does not change it.  What lacks its data or a package is told first and skipped; the exit status is then 1
    too, or 2 if nothing is left to run.

    \b
    Example: hystfmu reproduce zhao_tan_2008
    """
    from hystfmu.base.errors import InputError
    from hystfmu.base.files import write_text
    from hystfmu.papers import NEEDS_DATA, PAPERS, missing
    from hystfmu.papers import reproduce as reproduce_paper
    from hystfmu.report.terminal import progress

    for name in names if data is None else ():  # without names, the table itself says that its data is missing
        if name in NEEDS_DATA:
            raise InputError(f"{name}: the measured data is not part of this package; name its folder with --data DIR")
    lacking = {name: why for name in names or PAPERS if (why := missing(name, data))}
    able = [name for name in names or PAPERS if name not in lacking]
    if not able:
        raise InputError("; ".join(lacking.values()))
    for name, why in lacking.items():
        click.echo(f"skipped {name}: {why}", err=True)
    reports = []
    for name in able:
        with progress(name) as report:
            reports.append(reproduce_paper(name, data, report, full))
        if not as_json:
            click.echo(reports[-1].text() + "\n")
        if folder is not None:
            write_text(Path(folder) / f"{name}.html", reports[-1].html())
    if as_json:
        click.echo(json.dumps([r.data() for r in reports]))
    missed = any(row.met is False and row.where != "speed" for r in reports for row in r.rows)
    sys.exit(FAILED if missed or lacking else 0)


@click.command(cls=Command)
@click.option("-o", "out", default="demo", show_default=True, metavar="DIR", help="Folder to write into.")
def demo(out: str) -> None:
    """Run the whole workflow on built-in data.

    Fits and compares models, exports FMUs, runs scenarios and writes a report.

    \b
    Example: hystfmu demo -o demo
    """
    from hystfmu.demo.run import demo as run_demo

    sys.exit(0 if run_demo(Path(out)) else FAILED)
