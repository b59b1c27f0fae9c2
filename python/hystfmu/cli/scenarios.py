"""Commands for scenarios: run, study, margins and compare. They use scenarios of the user and shipped scenarios."""

import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from hystfmu.base import InputError, meant, meant_file, refuse_existing
from hystfmu.cli.options import FILE, OUTPUT_FILE, OUTPUT_FOLDER, Command, OutputFile, WrittenFile, json_option, of
from hystfmu.report.terminal import VERBOSE, answer, answers_json, detail, echo, level, say, wrong

if TYPE_CHECKING:
    from hystfmu.scenario import Change

RUN = "scenario.running:run"


def found(paths: Sequence[str]) -> list[Path]:
    """Return the paths of scenarios or studies. A shipped scenario is named by its path in the repository.

    If a shipped scenario or study is used, the function prints its folder to stderr.

    Raises
    ------
    InputError
        A path does not exist; the error suggests similar names.
    """
    from hystfmu.scenario.system.spec import here_or_shipped, shipped_names, shipped_scenarios

    places = [here_or_shipped(p) for p in paths]
    for p, place in zip(paths, places, strict=True):
        if not place.exists():
            raise InputError(f"{p}: No such file or directory.{meant_file(p) or meant(p, shipped_names())}")
    if any(place != Path(p) for place, p in zip(places, paths, strict=True)):
        echo(f"using the scenarios that HystFMU ships, in {shipped_scenarios()}", err=True)
    return places


def chosen(command: str, scenarios: Sequence[str], all_of_them: bool) -> list[Path]:
    """Return the paths of the named scenarios, or of all in ./scenarios, or of all shipped ones without this folder.

    Raises
    ------
    InputError
        There is no scenario, or there are both names and the option ``--all`` of the command.
    """
    if all_of_them == bool(scenarios):
        raise InputError(f"{command} needs scenarios or --all (example: hystfmu {command} scenarios/pid)")
    if scenarios:
        return found(scenarios)
    (root,) = found(["scenarios"])
    files = [f for depth in ("*", "*/*") for f in root.glob(f"{depth}/scenario.toml")]
    if not files:
        raise InputError("the current folder has no scenarios/*/scenario.toml")
    return sorted(f.parent for f in files)


def refuse_shipped(paths: Sequence[Path]) -> None:
    """Raise an error if one of the scenarios is part of the installed package, because a command must not write there.

    Raises
    ------
    InputError
        One of the paths is a scenario that was installed with the package.
    """
    from hystfmu.base import PACKAGE

    for path in paths:
        if PACKAGE in path.parents:
            raise InputError(f"--record writes beside a scenario.toml. Copy {path} to a folder of your own first.")


all_option = click.option(
    "--all",
    "all_of_them",
    is_flag=True,
    help="Use all scenarios in ./scenarios. If this folder does not exist, use all scenarios that HystFMU ships.",
)


@click.command(cls=Command)
@click.argument("scenarios", type=FILE, nargs=-1)
@all_option
@of(
    RUN,
    set="UNIT.NAME=VALUE",
    engine="",
    coupling="",
    seconds="--timeout",
    confined="",
    case="NAME",
    out=("-o --out OUT.csv", {"type": OUTPUT_FILE}),
    record="",
)
@of("", yes="", junit=("FILE", {"type": OutputFile(folder=False)}))
@of(RUN, report=("DIR", {"type": OUTPUT_FOLDER}))
@json_option
def run(
    scenarios: tuple[str, ...],
    all_of_them: bool,
    yes: bool,
    junit: str | None,
    record: bool,
    report: str | None,
    **how: Any,
) -> None:
    """Run scenarios and compare them with limits and baselines.

    A scenario is a closed loop of units, and limits for its results. SCENARIOS are folders of scenarios, or folders
    that contain such folders. If the folder scenarios/pid does not exist, the name scenarios/pid selects the scenario
    that HystFMU ships.

    To simulate an FMU or an SSP archive, use 'hystfmu simulate'.

    \b
    Example: hystfmu run scenarios/sliding_mode --report out
             hystfmu run scenarios/pid --case sine_10 -o sine_10.csv
    \f

    Parameters
    ----------
    yes : bool
        With --record, write the baseline without asking for confirmation.
    junit : str, optional
        Write the verdicts to this file in the JUnit XML format.
    """
    if alone := next((s for s in scenarios if s.endswith((".fmu", ".ssp"))), None):
        raise InputError(
            f"{alone}: The scenario must be a folder. 'hystfmu simulate {alone}' runs an FMU or an archive."
        )
    import hystfmu as hy
    from hystfmu.report.terminal import progress
    from hystfmu.scenario.report.page import write_junit
    from hystfmu.scenario.report.terminal import changes, every_metric, verdicts

    paths = chosen("run", scenarios, all_of_them)
    if record:
        refuse_shipped(paths)
    pages = () if report is None else (Path(report, name) for name in ("report.html", "report.json"))
    refuse_existing(*pages, *([junit] if junit is not None else []))  # every run writes other times into these files

    def agreed(told: "list[Change]") -> bool:
        echo(changes(told), err=answers_json())
        agrees = yes or not sys.stdin.isatty() or not told or click.confirm("write the new baseline?", err=True)
        echo("the baseline is written" if agrees else "nothing is written", err=True)
        return agrees

    with progress("running") as done:
        results = hy.run(paths, record=record, report=report, progress=done, confirm=agreed, **how)
    if junit is not None:
        write_junit(results, junit)
    say(verdicts(results))
    detail(every_metric(results))
    wrong([line for r in results for line in r.failures()])
    answer([r.summary() for r in results], results.passed)


@click.command(cls=Command, interrupted="finished runs are kept; to continue:")
@click.argument("study", type=FILE)
@of(
    "studies.run:study",
    folder=("-o --out DIR", {"type": OUTPUT_FOLDER, "required": True}),
    workers="-j --jobs",
    on="dask://HOST:PORT",
    retry="",
    confined="",
)
@json_option
def study(study: str, **how: Any) -> None:
    """Run a scenario with many parameter variations.

    The command prints the share of variations that meet all limits, with the 95 % confidence interval of this share. It
    writes the table results.parquet and a report. The report shows the distributions of the metrics, the effects of the
    parameters, and the commands that repeat the variations with the worst results.

    If a study was interrupted, the same command continues it.

    \b
    Example: hystfmu study scenarios/pid/draws.study.toml -o out
             hystfmu study scenarios/pid/draws.study.toml -o out --retry failed
    """
    import hystfmu as hy
    from hystfmu.report.terminal import counter
    from hystfmu.studies.report import spreads

    (file,) = found([study])
    with counter("running") as report:
        outcome = hy.study(file, progress=report, **how)
    summary = outcome.summary
    facts = {"rows": len(outcome.rows), "ran": outcome.ran, "failed": len(outcome.failed)}
    say(
        f"{facts['rows']} rows, {facts['ran']} of them computed now ({outcome.seconds:.1f} s), "
        f"{facts['failed']} failed; seed {outcome.seed}"
    )
    if summary is not None:
        say(spreads(summary, every=level() == VERBOSE))
    shown = outcome.failed if level() == VERBOSE else outcome.failed[:10]
    echo("".join(f"row {r['index']} ({r['case']}): {r['status']}: {r['reason']}\n" for r in shown), nl=False)
    say(f"{outcome.table}\n{outcome.report}")
    share = summary and {k: getattr(summary, k) for k in ("draws", "inside", "unstable", "interval")}
    files = {"table": str(outcome.table), "report": str(outcome.report)}
    answer(facts | files | {"seed": outcome.seed, "summary": share})


@click.command(cls=Command)
@click.argument("scenarios", type=FILE, nargs=-1)
@all_option
@of("scenario.loop.table:margin_table", case="NAME", at="UNIT.OUTPUT", delays="")
@json_option
def margins(scenarios: tuple[str, ...], all_of_them: bool, delays: bool, **how: Any) -> None:
    """Compute the margins of loops and check their limits.

    For each case, the command opens the loop at the input of the plant and linearises it. The models of controllers,
    observers, delays and plant dynamics are exact. Hysteresis and inverse in series are replaced by their incremental
    gain. The incremental gain varies during the case. Its range is called the sector. The margins are computed for an
    incremental gain of 1. If a loop has no inverse and the gain of the plant is never 1, the margins are computed for
    the largest gain. The command also checks stability for the whole sector, with 0, 1/2, 1 and 2 additional steps of
    delay.

    The exit status is 1 if a loop violates a limit in the table [margins] of the scenario. It is also 1 if a loop is
    unstable for a gain in the sector, unless the key expected_unstable in [margins] names the case.

    \b
    Example: hystfmu margins scenarios/pid scenarios/pid_observer
    """
    from hystfmu.report.terminal import progress
    from hystfmu.scenario.loop.table import margin_table

    paths = chosen("margins", scenarios, all_of_them)
    delays = delays or level() == VERBOSE
    with progress("margins") as report:
        table = margin_table(paths, progress=report, delays=delays, **how)
    say(table.text(delays))
    wrong(table.broken())
    answer(table.summary(), bool(table.rows) and not table.broken())


@click.command(cls=Command)
@click.argument("before", type=FILE, metavar="A")
@click.argument("after", type=FILE, metavar="B")
@of("", out=("-o DIFF.html", {"required": True}))
@json_option
def compare(before: str, after: str, out: WrittenFile) -> None:
    """Compare two reports of 'hystfmu run' or 'hystfmu study'.

    A is the old report and B is the new report. Each of them is a file report.json, or the folder that contains this
    file. For two reports of 'hystfmu run', the page lists old and new metrics and margins, beginning with the largest
    change, and plots old and new signals together. For two reports of 'hystfmu study', the page shows the shares of
    variations that meet all limits, with confidence intervals, and the distributions of the metrics on common axes. It
    also lists the variations whose verdict changed.

    \b
    Example: hystfmu compare main branch -o diff.html
    \f

    Parameters
    ----------
    out : str
        HTML page to write.
    """
    from hystfmu.scenario.report.compare import compare_reports
    from hystfmu.scenario.report.terminal import changes
    from hystfmu.studies.compare import compare_studies
    from hystfmu.studies.summary import is_study

    of_studies = is_study(before) or is_study(after)
    changed = (compare_studies if of_studies else compare_reports)(before, after, out)
    say(changes(changed, "the two reports are the same"))
    say(f"wrote {out}")
    answer([vars(c) | {"relative": c.relative} for c in changed])
