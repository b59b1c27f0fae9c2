"""The command that runs scenarios."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Literal

import click

from hystfmu.base.errors import InputError
from hystfmu.base.files import refuse_existing
from hystfmu.cli import places
from hystfmu.cli.options import (
    FAILED,
    FILE,
    OUTPUT_FILE,
    OUTPUT_FOLDER,
    Command,
    OutputFile,
    assignments,
    json_option,
    unconfined_option,
)
from hystfmu.report.terminal import detail, echo, say, wrong


@click.command(cls=Command)
@click.argument("scenarios", type=FILE, nargs=-1)
@click.option(
    "--all",
    "everything",
    is_flag=True,
    help="Run every scenario in ./scenarios; if this folder does not exist, run the scenarios of HystFMU.",
)
@click.option(
    "--set",
    "settings",
    multiple=True,
    metavar="UNIT.NAME=VALUE",
    help="Override a parameter; @FILE.json overrides all parameters in this file. Repeatable. Then only the limits are "
    "tested. A case that sets the parameter itself keeps its value, unless yours is relative ('*1.2') or --case names "
    "the case.",
)
@click.option(
    "--engine",
    type=click.Choice(["fmpy", "native"]),
    default="fmpy",
    show_default=True,
    help="fmpy simulates FMUs (reference); native runs the whole loop in the C core, with the same bits.",
)
@click.option(
    "--coupling",
    type=click.Choice(["gauss_seidel", "jacobi", "iterative"]),
    help="Coupling scheme; overrides the scheme in the scenario.",
)
@click.option(
    "--timeout",
    type=click.FloatRange(0, min_open=True),
    default=600.0,
    show_default=True,
    metavar="SECONDS",
    help="Time limit of a case with foreign FMUs.  These FMUs run in a child process.",
)
@unconfined_option
@click.option("--case", "cases", multiple=True, metavar="NAME", help="Run only the cases with this name; repeatable.")
@click.option(
    "-o", "--out", type=OUTPUT_FILE, metavar="OUT.csv", help="CSV file for all outputs of the one case that runs."
)
@click.option(
    "--record",
    is_flag=True,
    help="Record the results as the new baseline.  The command prints the changes and, on a terminal, asks "
    "before it writes.",
)
@click.option("--yes", is_flag=True, help="With --record: do not ask.")
@click.option("--junit", type=OutputFile(folder=False), metavar="FILE", help="JUnit XML file to write the verdicts to.")
@click.option(
    "--report",
    "report_dir",
    type=OUTPUT_FOLDER,
    metavar="DIR",
    help="Folder to write report.html and report.json into.",
)
@json_option
def run(
    scenarios: tuple[str, ...],
    everything: bool,
    settings: tuple[str, ...],
    engine: Literal["fmpy", "native"],
    coupling: Literal["gauss_seidel", "jacobi", "iterative"] | None,
    timeout: float,
    unconfined: bool,
    cases: tuple[str, ...],
    out: str | None,
    record: bool,
    yes: bool,
    junit: str | None,
    report_dir: str | None,
    as_json: bool,
) -> None:
    """Run scenarios and compare them with limits and baselines.

    A scenario is a closed loop of FMUs, which fmpy simulates. If SCENARIOS is a folder of scenarios, all scenarios in
    it run. A name such as scenarios/pid selects a shipped scenario if the current folder has no folder of this name.

    'hystfmu simulate' runs an FMU or an SSP archive.

    \b
    Example: hystfmu run scenarios/sliding_mode --report out
             hystfmu run scenarios/pid --case sine_10 -o sine_10.csv
    """
    if alone := next((s for s in scenarios if s.endswith((".fmu", ".ssp"))), None):
        raise InputError(
            f"{alone}: The scenario must be a folder. 'hystfmu simulate {alone}' runs an FMU or an archive."
        )
    import hystfmu as hy
    from hystfmu.report.terminal import progress
    from hystfmu.scenario import Change
    from hystfmu.scenario.report.page import write_junit
    from hystfmu.scenario.report.terminal import changes, every_metric, verdicts

    if everything == bool(scenarios):
        raise InputError("run needs scenarios or --all (example: hystfmu run scenarios/pid)")
    paths = places.everything() if everything else places.found(scenarios)
    if record:
        places.refuse_shipped(paths)
    pages = () if report_dir is None else (Path(report_dir, name) for name in ("report.html", "report.json"))
    refuse_existing(*pages, *([junit] if junit is not None else []))  # they state times

    def agreed(found: list[Change]) -> bool:
        echo(changes(found), err=as_json)
        agrees = yes or not sys.stdin.isatty() or not found or click.confirm("write the new baseline?", err=True)
        echo("the baseline is written" if agrees else "nothing is written", err=True)
        return agrees

    with progress("running") as report:
        results = hy.run(
            paths,
            record=record,
            report=report_dir,
            set=assignments(settings),
            progress=report,
            engine=engine,
            coupling=coupling,
            seconds=timeout,
            confined=not unconfined,
            confirm=agreed,
            case=cases or None,
            out=out,
        )
    if junit is not None:
        write_junit(results, junit)
    if as_json:
        echo(json.dumps([r.summary() for r in results]))
    else:
        say(verdicts(results))
        detail(every_metric(results))
        wrong([line for r in results for line in r.failures()])
    sys.exit(0 if results.passed else FAILED)
