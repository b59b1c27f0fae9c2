"""Commands for scenarios and their reports: margins, compare and ssp."""

from __future__ import annotations

import json
import sys
from typing import Literal

import click

from hystfmu.base.errors import InputError
from hystfmu.cli import places
from hystfmu.cli.options import FAILED, FILE, OUTPUT_FILE, Command, json_option
from hystfmu.report.terminal import VERBOSE, echo, level, say, wrong


@click.command(cls=Command)
@click.argument("scenarios", type=FILE, nargs=-1)
@click.option(
    "--all",
    "everything",
    is_flag=True,
    help="Take every scenario in ./scenarios; if this folder does not exist, the scenarios of HystFMU.",
)
@click.option(
    "--case",
    "cases",
    multiple=True,
    metavar="NAME",
    help="Compute only these cases, and do not check the limits; repeatable.",
)
@click.option("--at", metavar="UNIT.OUTPUT", default="", help="Signal at which the loop is opened.")
@click.option("--delays", is_flag=True, help="Print a row for each further delay: 0, 1/2, 1 and 2 steps.")
@json_option
def margins(
    scenarios: tuple[str, ...], everything: bool, cases: tuple[str, ...], at: str, delays: bool, as_json: bool
) -> None:
    """Compute the margins of loops and check their limits.

    The command opens the loop of each case at the input of its plant, and linearises the loop. Controllers, observers,
    delays and the dynamics of the plant are exact. Hysteresis and inverse become the sector of slopes along the path of
    the case. The margins hold for slope 1. If a loop has no inverse and the slope of its plant is never 1, the margins
    hold for the largest slope of the plant. The command checks stability over the sector with 0, 1/2, 1 and 2 further
    steps of delay.

    The exit status is 1 if a limit in [margins] of a scenario is missed. It is also 1 if a loop is unstable for a slope
    along its path, unless expected_unstable in [margins] names the case.

    \b
    Example: hystfmu margins scenarios/pid scenarios/pid_observer
    """
    from hystfmu.report.terminal import progress
    from hystfmu.scenario.loop.table import margin_table

    if everything == bool(scenarios):
        raise InputError("margins needs scenarios or --all (example: hystfmu margins scenarios/pid)")
    delays = delays or level() == VERBOSE
    paths = places.everything() if everything else places.found(scenarios)
    with progress("margins") as report:
        found = margin_table(paths, cases or None, report, at=at, delays=delays)
    if as_json:
        echo(json.dumps(found.summary()))
    else:
        say(found.text(delays))
        wrong(found.broken())
    sys.exit(0 if found.rows and not found.broken() else FAILED)


@click.command(cls=Command)
@click.argument("before", type=FILE, metavar="A")
@click.argument("after", type=FILE, metavar="B")
@click.option("-o", "out", required=True, type=OUTPUT_FILE, metavar="DIFF.html", help="HTML page to write.")
@json_option
def compare(before: str, after: str, out: str, as_json: bool) -> None:
    """Compare two reports of 'hystfmu run' or 'hystfmu study'.

    A and B are the folders of the reports, or the files report.json in these folders. For two runs, the page lists old
    and new metrics and margins, the largest change first, and overlays the signals. For two studies, the page shows the
    shares inside the limits with their intervals, and distributions on common axes. It also lists the draws whose
    verdict changed.

    \b
    Example: hystfmu compare main branch -o diff.html
    """
    from hystfmu.scenario.report.compare import compare_reports
    from hystfmu.scenario.report.terminal import changes
    from hystfmu.studies.compare import compare_studies
    from hystfmu.studies.summary import is_study

    of_studies = is_study(before) or is_study(after)
    found = (compare_studies if of_studies else compare_reports)(before, after, out)
    if as_json:
        echo(json.dumps([vars(c) | {"relative": c.relative} for c in found]))
    else:
        say(changes(found, "the two reports are the same"))
        say(f"wrote {out}")


@click.command(cls=Command)
@click.argument("scenario", type=FILE)
@click.option("-o", "--out", required=True, type=OUTPUT_FILE, metavar="X.ssp|X.fmu", help="Archive to write.")
@click.option("--case", "name", metavar="NAME", help="Case of the scenario [default: the first].")
@click.option(
    "--ssp",
    "version",
    type=click.Choice(["1.0", "2.0"]),
    default="1.0",
    show_default=True,
    help="Version of the SSP standard.",
)
@click.option(
    "--fmi",
    type=click.Choice(["2", "3"]),
    default="2",
    show_default=True,
    help="FMI version of the units exported here.",
)
@click.option("--connectors", is_flag=True, help="Add system outputs for the recorded signals; libcosim rejects them.")
@click.option("--separate", is_flag=True, help="Make every unit a component [default: neighbouring units form one].")
@click.option(
    "--tolerance",
    type=click.FloatRange(min=0),
    default=0.1,
    show_default=True,
    metavar="PERCENT",
    help="Largest accepted difference from the scenario, relative to the span of a recorded output.",
)
def ssp(
    scenario: str,
    out: str,
    name: str | None,
    version: Literal["1.0", "2.0"],
    fmi: str,
    connectors: bool,
    separate: bool,
    tolerance: float,
) -> None:
    """Export a scenario as an SSP archive or one FMU.

    Other simulators run the archive. 'hystfmu simulate X.ssp' runs archives of other tools.

    Other simulators step all components at once, and each component reads the values of the previous step. Therefore
    neighbouring units become one component, which keeps the order of the scenario. The last lines of the printed text
    state the largest difference from the scenario for each recorded output. If a difference is above --tolerance, the
    command writes the archive but its exit status is 1.

    With -o X.fmu the whole loop becomes one FMU. This FMU steps all its units in the order of the scenario.

    \b
    Example: hystfmu ssp scenarios/pid --case sine_10 -o pid.ssp
    """
    from hystfmu.scenario import Cases
    from hystfmu.scenario.ssp.write import write_loop, write_ssp

    case = Cases(places.found([scenario])[0]).named(name)
    if out.endswith(".fmu"):
        path = write_loop(case, out, 3 if fmi == "3" else 2)
        say(f"{path}: FMI {fmi}.0, case {case.name}, {len(case.units)} units in one, step {case.step:g} s")
        return
    written = write_ssp(case, out, version, connectors, 3 if fmi == "3" else 2, separate)
    made = f"{len(case.units)} units in {written.components} component{'s' if written.components > 1 else ''}"
    say(f"{out}: SSP {version}, case {case.name}, {made}, step {case.step:g} s")
    listed = ", ".join(f"{name} {value:.2g} %" for name, value in written.differences.items())
    say(f"largest difference to the scenario, of its span: {listed}")
    if max(written.differences.values()) > 1e-6:
        late = "values reach other components one step late; " if written.components > 1 else ""
        say(f"its reason: {late}readers know no events inside a step and no finer steps")
    if worse := [f"{name} differs by {x:.2g} %" for name, x in written.differences.items() if not x <= tolerance]:
        echo(
            f"{out}: does not reproduce the scenario within {tolerance:g} % of the span: {', '.join(worse)};"
            " the file is kept, for a master that couples better"
        )
        sys.exit(FAILED)
