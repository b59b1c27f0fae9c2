"""Commands about scenarios: run them, hand them on as SSP, vary them in a study."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Literal

import click

from hystfmu.base.errors import InputError
from hystfmu.cli.options import FAILED, assignments, json_option


@click.command()
@click.argument("scenarios", nargs=-1)
@click.option("--all", "everything", is_flag=True, help="Every scenario below ./scenarios.")
@click.option("--set", "settings", multiple=True, metavar="UNIT.NAME=VALUE", help="Override a parameter (repeatable).")
@click.option(
    "--engine",
    type=click.Choice(["fmpy", "python", "native"]),
    default="fmpy",
    show_default=True,
    help="FMUs by fmpy (the reference), Python units, or the whole loop in the C core; all give the same bits.",
)
@click.option(
    "--coupling",
    type=click.Choice(["gauss_seidel", "jacobi", "iterative"]),
    help="How units exchange values, instead of what the scenario says.",
)
@click.option(
    "--timeout",
    type=click.FloatRange(0, min_open=True),
    default=600.0,
    show_default=True,
    metavar="SECONDS",
    help="For a case with FMUs of others, which run in a process of their own.",
)
@click.option("--case", metavar="NAME", help="Run only the cases of this name.")
@click.option("--step", type=float, metavar="SECONDS", help="Of an SSP that states none, or another one.")
@click.option("--stop", type=float, metavar="SECONDS", help="Of an SSP that states none, or another one.")
@click.option("-o", "--out", metavar="OUT.csv", help="Write all outputs of the one case, or of an SSP, there.")
@click.option(
    "--record",
    is_flag=True,
    help="Write the results as the new baseline, after a table of what changes; asks on a terminal.",
)
@click.option("--yes", is_flag=True, help="With --record: write without asking, as in a pipe.")
@click.option("--junit", metavar="FILE", help="Write the verdicts as JUnit XML.")
@click.option("--report", "report_dir", metavar="DIR", help="Write report.html and report.json there.")
@json_option
@click.pass_context
def run(
    context: click.Context,
    scenarios: tuple[str, ...],
    everything: bool,
    settings: tuple[str, ...],
    engine: Literal["fmpy", "python", "native"],
    coupling: Literal["gauss_seidel", "jacobi", "iterative"] | None,
    timeout: float,
    case: str | None,
    step: float | None,
    stop: float | None,
    out: str | None,
    record: bool,
    yes: bool,
    junit: str | None,
    report_dir: str | None,
    as_json: bool,
) -> None:
    """Run scenarios: closed loops of real FMUs.

    They run by fmpy and are held against limits and baselines.

    An SSP archive of anybody runs too, and is held against the reference result in it.

    \b
    Example: hystfmu run scenarios/sliding_mode --report out
             hystfmu run scenarios/pid --case sine_10 -o sine_10.csv
             hystfmu run loop.ssp -o out.csv
    """
    if len(scenarios) == 1 and scenarios[0].endswith(".ssp"):
        from hystfmu.scenario.ssp.run import run_ssp_file

        _refuse(context, _NOT_OF_AN_SSP, f"{scenarios[0]}: an SSP archive is run alone and as it is")
        lines, passed = run_ssp_file(scenarios[0], engine, coupling, step, stop, timeout, out)
        click.echo("\n".join(lines))
        sys.exit(0 if passed else FAILED)
    _refuse(context, ("step", "stop"), "step and stop of a scenario stand in its scenario.toml")
    from hystfmu.report.terminal import progress
    from hystfmu.scenario import Change, run_scenarios
    from hystfmu.scenario.report.junit import write_junit
    from hystfmu.scenario.report.terminal import changes, verdicts

    if everything == bool(scenarios):
        raise InputError("name scenarios, or use --all (example: hystfmu run scenarios/pid)")
    paths = sorted(p.parent for p in Path("scenarios").glob("*/scenario.toml")) if everything else scenarios
    if not paths:
        raise InputError("no scenarios/*/scenario.toml below the current directory")

    def agreed(found: list[Change]) -> bool:
        click.echo(changes(found), err=as_json)
        agrees = yes or not sys.stdin.isatty() or not found or click.confirm("write the new baseline?", err=True)
        click.echo("the baseline is written" if agrees else "nothing is written", err=True)
        return agrees

    with progress("running") as report:
        results = run_scenarios(
            [Path(p) for p in paths],
            record=record,
            report_dir=Path(report_dir) if report_dir else None,
            overrides=assignments(settings),
            progress=report,
            engine=engine,
            coupling=coupling,
            seconds=timeout,
            confirm=agreed,
            case=case,
            out=out,
        )
    if junit is not None:
        write_junit(results, junit)
    if as_json:
        click.echo(json.dumps([r.summary() for r in results]))
    else:
        click.echo(verdicts(results))
    sys.exit(0 if all(r.passed for r in results) else FAILED)


_NOT_OF_AN_SSP = ("everything", "settings", "case", "record", "yes", "junit", "report_dir", "as_json")


def _refuse(context: click.Context, names: tuple[str, ...], why: str) -> None:
    """An option that would have no effect is an error."""
    for option in context.command.params:
        given = context.get_parameter_source(option.name or "") is click.core.ParameterSource.COMMANDLINE
        if option.name in names and given:
            raise InputError(f"{why}: it takes no {option.opts[-1]}")


@click.command()
@click.argument("before", metavar="A/report.json")
@click.argument("after", metavar="B/report.json")
@click.option("-o", "out", required=True, metavar="DIFF.html", help="Page with metrics and overlaid signals.")
@json_option
def compare(before: str, after: str, out: str, as_json: bool) -> None:
    """Two reports of `hystfmu run` side by side.

    Metrics old, new and change, signals of both in one plot.

    \b
    Example: hystfmu compare main/report.json branch/report.json -o diff.html
    """
    from hystfmu.scenario.report.compare import compare_reports
    from hystfmu.scenario.report.terminal import changes

    found = compare_reports(before, after, out)
    if as_json:
        click.echo(json.dumps([vars(c) | {"relative": c.relative} for c in found]))
    else:
        click.echo(changes(found, "the two reports have the same metrics"))
        click.echo(f"wrote {out}")


@click.command()
@click.argument("scenario")
@click.option("-o", "--out", required=True, metavar="X.ssp|X.fmu")
@click.option("--case", "name", metavar="NAME", help="Case of the scenario [default: its first].")
@click.option("--ssp", "version", type=click.Choice(["1.0", "2.0"]), default="1.0", show_default=True)
@click.option("--fmi", type=click.Choice(["2", "3"]), default="2", show_default=True, help="FMI version of our units.")
@click.option("--connectors", is_flag=True, help="Outputs of the system for recorded signals; libcosim rejects them.")
def ssp(scenario: str, out: str, name: str | None, version: Literal["1.0", "2.0"], fmi: str, connectors: bool) -> None:
    """Write a scenario as an SSP archive.

    Other simulators run it; 'hystfmu run X.ssp' reads those of others.

    With -o X.fmu the whole loop becomes one FMU, stepped in the scenario's order inside.

    \b
    Example: hystfmu ssp scenarios/pid --case sine_10 -o pid.ssp
    """
    from hystfmu.scenario import Scenario
    from hystfmu.scenario.ssp.write import write_loop, write_ssp

    cases = {c.name: c for c in Scenario(scenario).cases}
    if name is not None and name not in cases:
        raise InputError(f"{scenario}: no case {name!r}; there are {', '.join(cases)}")
    case = cases[name] if name is not None else next(iter(cases.values()))
    if out.endswith(".fmu"):
        path = write_loop(case, out, 3 if fmi == "3" else 2)
        click.echo(f"{path}: FMI {fmi}.0, case {case.name}, {len(case.units)} units in one, step {case.step:g} s")
        return
    path = write_ssp(case, out, version, connectors, 3 if fmi == "3" else 2)
    click.echo(f"{path}: SSP {version}, case {case.name}, {len(case.units)} units, step {case.step:g} s")


@click.command()
@click.argument("study")
@click.option("-o", "--out", "folder", required=True, metavar="DIR", help="Table and report; run again to resume.")
@click.option("-j", "--jobs", type=click.IntRange(1, 1024), help="Local processes [default: one per core].")
@click.option("--on", metavar="dask://HOST:PORT", help="Run on the Dask cluster with this scheduler.")
@json_option
def study(study: str, folder: str, jobs: int | None, on: str | None, as_json: bool) -> None:
    """Run a scenario over many variations.

    Writes a table (results.parquet) and a report of what matters.

    Interrupted studies go on where they stopped.

    \b
    Example: hystfmu study scenarios/sliding_mode/mismatch.study.toml -o out -j 2
    """
    from hystfmu.report.terminal import counter
    from hystfmu.studies import run_study

    with counter("running") as report:
        outcome = run_study(study, folder, workers=jobs, on=on, progress=report)
    facts = {"rows": len(outcome.rows), "ran": outcome.ran, "failed": len(outcome.failed)}
    if as_json:
        click.echo(json.dumps(facts | {"table": str(outcome.table), "report": str(outcome.report)}))
    else:
        click.echo(
            f"{facts['rows']} rows, {facts['ran']} of them run now in {outcome.seconds:.1f} s, {facts['failed']} failed"
        )
        for row in outcome.failed[:10]:
            click.echo(f"row {row['index']} ({row['case']}): {row['status']}: {row['reason']}")
        click.echo(f"{outcome.table}\n{outcome.report}")
