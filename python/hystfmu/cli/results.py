"""Commands that show results: the tables of the papers, and a demonstration on built-in data."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from hystfmu.cli.columns import Columns, data_options
from hystfmu.cli.options import FAILED, Command, json_option
from hystfmu.report.verbosity import detail, say, wrong

if TYPE_CHECKING:
    from hystfmu.face.result import Result

_BEGUN = "finished steps are kept; to go on with the others:"


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
    from hystfmu.report.progress import progress

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
            say(reports[-1].text() + "\n")
            missed_rows = [row for row in reports[-1].rows if row.met is False]
            wrong([f"{name}: {row.quantity}: {row.ours:.4g} misses the target {row.target:.4g}" for row in missed_rows])
        if folder is not None:
            write_text(Path(folder) / f"{name}.html", reports[-1].html())
    if as_json:
        click.echo(json.dumps([r.data() for r in reports]))
    missed = any(row.met is False and row.where != "speed" for r in reports for row in r.rows)
    sys.exit(FAILED if missed or lacking else 0)


@click.command(cls=Command, interrupted=_BEGUN)
@click.option("-o", "out", default="demo", show_default=True, metavar="DIR", help="Folder to write into.")
def demo(out: str) -> None:
    """Run the whole workflow on built-in data.

    Fits and compares models, exports FMUs, runs scenarios and writes a report.

    \b
    Example: hystfmu demo -o demo
    """
    from hystfmu.demo.run import demo as run_demo

    sys.exit(0 if run_demo(Path(out)) else FAILED)


@click.command(cls=Command, interrupted=_BEGUN)
@click.argument("data", nargs=-1, required=True)
@click.option("-o", "out", default="start", show_default=True, metavar="DIR", help="Folder to write into.")
@click.option(
    "--error",
    "percent",
    type=click.FloatRange(0, 100, min_open=True),
    default=1.0,
    show_default=True,
    help="Largest RMS tracking error that is asked for, in percent of the stroke; five times that where the device "
    "differs from its model.",
)
@click.option("--model", "key", default="auto", show_default=True, metavar="KEY", help="Kind of model.")
@data_options
@click.option("--train", metavar="A:B", help="Rows to fit, first:end.")
@click.option("--seed", default=0, show_default=True, help="Seed of the fit.")
@json_option
def start(
    data: tuple[str, ...],
    out: str,
    percent: float,
    key: str,
    columns: Columns,
    train: str | None,
    seed: int,
    as_json: bool,
) -> None:
    """From one record of a device to a compensated loop.

    Reads DATA, chooses and fits a model, inverts it, tunes a controller that is stable if the device differs by 20 % in
    gain and frequency with a step of delay more, runs the loop, and writes FMUs and a report.  Each file is named with
    the command that makes it alone.  If the record is poor, an input to measure next is written too.

    The exit status is 1 if the loop misses what is asked for, or if no model of the data has an inverse; model, FMU and
    report are written all the same.

    \b
    Example: hystfmu start data.csv -o mine
             hystfmu start stage.csv --time "Zeit [ms]" --input "Spannung [V]" --output "Weg [um]" --error 0.5
    """
    from hystfmu.report.progress import progress
    from hystfmu.report.terminal import table
    from hystfmu.start.run import start as make

    measured = columns.read(data, train)
    tell = (lambda line: None) if as_json else say
    tell(measured.read_as)
    source = [*data, *columns.words(), *(["--train", train] if train else [])]
    made = make(measured, Path(out), percent, key, seed, source, tell, progress)
    loop = None if isinstance(made.loop, str) else made.loop
    cases = [] if loop is None else [_case(r) for r in loop.results]
    if as_json:
        told = {name: {"path": str(path), "command": command} for name, (path, command) in made.files.items()}
        limits = [] if loop is None else [vars(v) | {"within": v.within} for v in loop.margins.verdicts]
        facts: dict[str, Any] = {"model": made.model.key, "fit": made.model.fit, "passed": made.passed}
        facts |= {"no_loop": made.loop} if loop is None else {"gains": vars(loop.gains)}
        click.echo(json.dumps(facts | {"cases": cases, "limits": limits, "files": told, "notes": made.notes}))
        sys.exit(0 if made.passed else FAILED)
    detail(f"\n{made.model}")
    if loop is None:
        click.echo(f"no loop: {made.loop}", err=True)
    else:
        head = ["case", "RMS % of stroke", "max %", "asked RMS %", "verdict", "what"]
        say("\n" + table(head, [[*c.values()] for c in cases]))
        limits_of_loop = [
            [v.limit, "unstable" if v.value is None else f"{v.value:.3g}", f"{v.bound:g}", v.word, v.where]
            for v in loop.margins.verdicts
        ]
        say("\n" + table(["limit of the loop", "value", "bound", "verdict", "at"], limits_of_loop))
        lines = [*(line for r in loop.results for line in r.failures()), *loop.margins.broken()]
        wrong([*lines, *(f"no margins: {line}" for line in loop.margins.refused if not loop.margins.verdicts)])
    for note in (*made.notes, *made.model.fit.get("warnings", ())):
        click.echo(f"warning: {note}", err=True)
    say("\n" + table(["written", "file", "the same alone"], [[k, str(p), c] for k, (p, c) in made.files.items()]))
    sys.exit(0 if made.passed else FAILED)


def _case(result: Result) -> dict[str, str]:
    """Return a case of a started loop as a row of text."""
    found = {v.metric: v for v in result.verdicts}
    rms, most = found.get("tracking"), found.get("worst")
    return {
        "case": result.case,
        "rms_percent": "stopped" if rms is None else f"{rms.value:.3g}",
        "max_percent": "" if most is None else f"{most.value:.3g}",
        "asked_percent": "" if rms is None or rms.limit is None else f"{rms.limit:g}",
        "verdict": "FAILED" if not result.passed else "ok" if rms is not None and rms.limit is not None else "",
        "text": result.system.case.text,
    }
