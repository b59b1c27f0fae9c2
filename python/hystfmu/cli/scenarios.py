"""Commands for scenarios: run, margins, compare, ssp and study."""

from __future__ import annotations

import json
import sys
from typing import Literal

import click

from hystfmu.base.errors import InputError
from hystfmu.cli import places
from hystfmu.cli.options import FAILED, OUTPUT_FILE, Command, assignments, json_option, unconfined_option
from hystfmu.report.verbosity import VERBOSE, detail, level, say, wrong


@click.command(cls=Command)
@click.argument("scenarios", nargs=-1)
@click.option(
    "--all",
    "everything",
    is_flag=True,
    help="Run every scenario in ./scenarios, or without that folder those that HystFMU ships.",
)
@click.option(
    "--set",
    "settings",
    multiple=True,
    metavar="UNIT.NAME=VALUE",
    help="Override a parameter (of an FMU: NAME=VALUE), or with @FILE.json those of a file; repeatable.",
)
@click.option(
    "--engine",
    type=click.Choice(["fmpy", "native"]),
    default="fmpy",
    show_default=True,
    help="fmpy simulates FMUs (reference), native runs the whole loop in the C core; same bits.",
)
@click.option(
    "--coupling",
    type=click.Choice(["gauss_seidel", "jacobi", "iterative"]),
    help="Coupling scheme; overrides that of the scenario.",
)
@click.option(
    "--timeout",
    type=click.FloatRange(0, min_open=True),
    default=600.0,
    show_default=True,
    metavar="SECONDS",
    help="Time limit of a case with foreign FMUs, which run in a child process.",
)
@unconfined_option
@click.option("--case", "cases", multiple=True, metavar="NAME", help="Run only the cases with this name; repeatable.")
@click.option("--step", type=float, metavar="SECONDS", help="Step of an SSP or FMU: overrides the one it states.")
@click.option("--stop", type=float, metavar="SECONDS", help="Stop time of an SSP or FMU: overrides the one it states.")
@click.option(
    "--input", "given", metavar="IN.csv", help="Inputs of an FMU: a column of time, and one named like each input."
)
@click.option(
    "-o", "--out", type=OUTPUT_FILE, metavar="OUT.csv", help="CSV file for all outputs of a single case, SSP or FMU."
)
@click.option(
    "--record",
    is_flag=True,
    help="Record the results as the new baseline.  Prints the changes; asks first on a terminal.",
)
@click.option("--yes", is_flag=True, help="With --record: do not ask.")
@click.option("--junit", type=OUTPUT_FILE, metavar="FILE", help="JUnit XML file to write the verdicts to.")
@click.option("--report", "report_dir", metavar="DIR", help="Folder to write report.html and report.json into.")
@json_option
@click.pass_context
def run(
    context: click.Context,
    scenarios: tuple[str, ...],
    everything: bool,
    settings: tuple[str, ...],
    engine: Literal["fmpy", "native"],
    coupling: Literal["gauss_seidel", "jacobi", "iterative"] | None,
    timeout: float,
    unconfined: bool,
    cases: tuple[str, ...],
    step: float | None,
    stop: float | None,
    given: str | None,
    out: str | None,
    record: bool,
    yes: bool,
    junit: str | None,
    report_dir: str | None,
    as_json: bool,
) -> None:
    """Run scenarios and compare them with limits and baselines.

    A scenario is a closed loop of FMUs, simulated by fmpy.  A folder of scenarios runs them all.  Those that HystFMU
    ships run by their names, such as scenarios/pid, where the current folder has none of that name.

    SSP archives of other tools run too and are compared with the reference result that they contain.

    An FMU of any origin runs alone: FMI 1.0, 2.0 or 3.0, Co-Simulation, or Model Exchange with an adaptive integrator.
    Its inputs are held during a step. Continuous inputs are interpolated between the rows of the file.

    \b
    Example: hystfmu run scenarios/sliding_mode --report out
             hystfmu run scenarios/pid --case sine_10 -o sine_10.csv
             hystfmu run loop.ssp -o out.csv
             hystfmu run pump.fmu --input in.csv --set k=2 --step 1e-3 --stop 5 -o out.csv
    """
    from hystfmu.report.progress import progress

    if len(scenarios) == 1 and scenarios[0].endswith(".fmu"):
        from hystfmu.scenario.run_fmu import run_fmu_file

        _refuse(context, _NOT_OF_AN_FMU, f"{scenarios[0]}: an FMU runs alone")
        told = run_fmu_file(scenarios[0], given, assignments(settings), step, stop, timeout, out, not unconfined)
        if as_json:
            click.echo(json.dumps(told.summary()))
        else:
            say("\n".join(told.lines()))
        return
    _refuse(context, ("given",), "only an FMU that runs alone takes a file of inputs")
    if len(scenarios) == 1 and scenarios[0].endswith(".ssp"):
        from hystfmu.scenario.ssp.run import run_ssp_file

        _refuse(context, _NOT_OF_AN_SSP, f"{scenarios[0]}: an SSP archive runs alone and unchanged")
        with progress("running") as report:
            lines, passed = run_ssp_file(
                scenarios[0], engine, coupling, step, stop, timeout, out, not unconfined, report
            )
        say("\n".join(lines))
        sys.exit(0 if passed else FAILED)
    _refuse(context, ("step", "stop"), "step and stop of a scenario are set in its scenario.toml")
    import hystfmu as hy
    from hystfmu.scenario import Change
    from hystfmu.scenario.report.junit import write_junit
    from hystfmu.scenario.report.terminal import changes, every_metric, verdicts

    if everything == bool(scenarios):
        raise InputError("run needs scenarios or --all (example: hystfmu run scenarios/pid)")
    paths = places.everything() if everything else places.found(scenarios)
    if record:
        places.refuse_shipped(paths)

    def agreed(found: list[Change]) -> bool:
        click.echo(changes(found), err=as_json)
        agrees = yes or not sys.stdin.isatty() or not found or click.confirm("write the new baseline?", err=True)
        click.echo("the baseline is written" if agrees else "nothing is written", err=True)
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
        click.echo(json.dumps([r.summary() for r in results]))
    else:
        say(verdicts(results))
        detail(every_metric(results))
        wrong([line for r in results for line in r.failures()])
    sys.exit(0 if results.passed else FAILED)


@click.command(cls=Command)
@click.argument("scenarios", nargs=-1)
@click.option(
    "--all",
    "everything",
    is_flag=True,
    help="Every scenario in ./scenarios, or without that folder those that HystFMU ships.",
)
@click.option(
    "--case", "cases", multiple=True, metavar="NAME", help="Only these cases, without the limits; repeatable."
)
@click.option("--at", metavar="UNIT.OUTPUT", default="", help="Signal at which the loop is broken.")
@click.option("--delays", is_flag=True, help="A row for each further delay: 0, 1/2, 1 and 2 steps.")
@json_option
def margins(
    scenarios: tuple[str, ...], everything: bool, cases: tuple[str, ...], at: str, delays: bool, as_json: bool
) -> None:
    """Compute the margins of loops and check their limits.

    The loop of each case is opened at the input of its plant and linearised: controllers, observers and delays by their
    exact tangent, the plant by its dynamics, hysteresis and inverse by the sector of slopes along the path of the case.
    Margins hold for slope 1; stability is checked over the sector with 0, 1/2, 1 and 2 further steps of delay.
    Exits with 1 if a limit in [margins] of a scenario is broken.

    \b
    Example: hystfmu margins scenarios/pid scenarios/pid_observer
    """
    from hystfmu.report.progress import progress
    from hystfmu.scenario.margin_table import margin_table

    if everything == bool(scenarios):
        raise InputError("margins needs scenarios or --all (example: hystfmu margins scenarios/pid)")
    delays = delays or level() == VERBOSE
    paths = places.everything() if everything else places.found(scenarios)
    with progress("margins") as report:
        found = margin_table(paths, cases or None, report, at=at, delays=delays)
    if as_json:
        click.echo(json.dumps(found.summary()))
    else:
        say(found.text(delays))
        wrong(found.broken())
    sys.exit(0 if found.rows and not found.broken() else FAILED)


_NOT_OF_AN_FMU = ("everything", "engine", "coupling", "cases", "record", "yes", "junit", "report_dir")
_NOT_OF_AN_SSP = ("everything", "settings", "cases", "record", "yes", "junit", "report_dir", "as_json")


def _refuse(context: click.Context, names: tuple[str, ...], why: str) -> None:
    """Refuse options that would have no effect."""
    for option in context.command.params:
        given = context.get_parameter_source(option.name or "") is click.core.ParameterSource.COMMANDLINE
        if option.name in names and given:
            raise InputError(f"{why}: it takes no {option.opts[-1]}")


@click.command(cls=Command)
@click.argument("before", metavar="A")
@click.argument("after", metavar="B")
@click.option("-o", "out", required=True, type=OUTPUT_FILE, metavar="DIFF.html", help="HTML page to write.")
@json_option
def compare(before: str, after: str, out: str, as_json: bool) -> None:
    """Compare two reports of 'hystfmu run' or 'hystfmu study'.

    A and B are their folders, or the files report.json in them.  The page of two runs says what changed, lists old and
    new metrics, the largest change first, and overlays the signals.  The page of two studies has the shares inside the
    limits with their intervals, distributions on common axes, and the draws that changed their verdict.

    \b
    Example: hystfmu compare main branch -o diff.html
    """
    from hystfmu.scenario.report.compare import compare_reports
    from hystfmu.scenario.report.terminal import changes
    from hystfmu.studies.compare import compare_studies
    from hystfmu.studies.facts import is_study

    of_studies = is_study(before) or is_study(after)
    found = (compare_studies if of_studies else compare_reports)(before, after, out)
    if as_json:
        click.echo(json.dumps([vars(c) | {"relative": c.relative} for c in found]))
    else:
        say(changes(found, "the two reports are the same"))
        say(f"wrote {out}")


@click.command(cls=Command)
@click.argument("scenario")
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
@click.option("--separate", is_flag=True, help="Make every unit a component [default: neighbours are one component].")
def ssp(
    scenario: str,
    out: str,
    name: str | None,
    version: Literal["1.0", "2.0"],
    fmi: str,
    connectors: bool,
    separate: bool,
) -> None:
    """Export a scenario as an SSP archive or one FMU.

    Other simulators run the archive; 'hystfmu run X.ssp' runs archives of other tools.

    They step all components at once, each with the values of the last step.  So neighbours that can step as one graph
    become one component, in which the order of the scenario holds.  The last lines say what the coupling still costs:
    the largest difference to the scenario itself, by recorded output.

    With -o X.fmu the whole loop becomes one FMU that steps its units, ours and foreign, in the order of the scenario.

    \b
    Example: hystfmu ssp scenarios/pid --case sine_10 -o pid.ssp
    """
    from hystfmu.scenario import Scenario
    from hystfmu.scenario.ssp.write import write_loop, write_ssp

    cases = {c.name: c for c in Scenario(places.found([scenario])[0]).cases}
    if name is not None and name not in cases:
        raise InputError(f"{scenario}: no case {name!r}; there are {', '.join(cases)}")
    case = cases[name] if name is not None else next(iter(cases.values()))
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


@click.command(cls=Command, interrupted="finished rows are kept; to go on with the others:")
@click.argument("study")
@click.option(
    "-o",
    "--out",
    "folder",
    required=True,
    metavar="DIR",
    help="Folder for the table and the report; an existing study resumes.",
)
@click.option("-j", "--jobs", type=click.IntRange(1, 1024), help="Number of local processes [default: one per core].")
@click.option("--on", metavar="dask://HOST:PORT", help="Scheduler of a Dask cluster to run on.")
@click.option(
    "--retry",
    type=click.Choice(["failed"]),
    help="Run failed rows again; those that failed at a limit which was raised always run again.",
)
@unconfined_option
@json_option
def study(
    study: str,
    folder: str,
    jobs: int | None,
    on: str | None,
    retry: Literal["failed"] | None,
    unconfined: bool,
    as_json: bool,
) -> None:
    """Run a scenario with many parameter variations.

    Prints the share of the variations that are inside the limits, with its 95 % interval.  Writes a table
    (results.parquet) and a report with distributions, effects of the parameters, and commands of the worst cases.

    An interrupted study resumes where it stopped.

    \b
    Example: hystfmu study scenarios/pid/draws.study.toml -o out
             hystfmu study scenarios/pid/draws.study.toml -o out --retry failed
    """
    import hystfmu as hy
    from hystfmu.report.progress import counter
    from hystfmu.studies.report import spreads

    (file,) = places.found([study])
    with counter("running") as report:
        outcome = hy.study(file, folder, workers=jobs, on=on, retry=retry, confined=not unconfined, progress=report)
    summary = outcome.summary
    facts = {"rows": len(outcome.rows), "ran": outcome.ran, "failed": len(outcome.failed)}
    if as_json:
        answer = summary and {
            k: v for k, v in vars(summary).items() if k in ("draws", "inside", "unstable", "interval")
        }
        files = {"table": str(outcome.table), "report": str(outcome.report)}
        click.echo(json.dumps(facts | files | {"seed": outcome.seed, "summary": answer}))
    else:
        say(
            f"{facts['rows']} rows, {facts['ran']} of them computed now ({outcome.seconds:.1f} s), "
            f"{facts['failed']} failed; seed {outcome.seed}"
        )
        if summary is not None:
            say(spreads(summary, every=level() == VERBOSE))
        shown = outcome.failed if level() == VERBOSE else outcome.failed[:10]
        click.echo("".join(f"row {r['index']} ({r['case']}): {r['status']}: {r['reason']}\n" for r in shown), nl=False)
        say(f"{outcome.table}\n{outcome.report}")
