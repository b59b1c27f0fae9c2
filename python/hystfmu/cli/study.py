"""The command that runs a scenario over many variations."""

from __future__ import annotations

import json
from typing import Literal

import click

from hystfmu.cli import places
from hystfmu.cli.options import FILE, OUTPUT_FOLDER, Command, json_option, unconfined_option
from hystfmu.report.terminal import VERBOSE, echo, level, say


@click.command(cls=Command, interrupted="finished rows are kept; to go on with the others:")
@click.argument("study", type=FILE)
@click.option(
    "-o",
    "--out",
    "folder",
    required=True,
    type=OUTPUT_FOLDER,
    metavar="DIR",
    help="Folder for the table and the report.  A study that exists in it resumes.",
)
@click.option("-j", "--jobs", type=click.IntRange(1, 1024), help="Number of local processes [default: one per core].")
@click.option("--on", metavar="dask://HOST:PORT", help="Scheduler of a Dask cluster to run on.")
@click.option(
    "--retry",
    type=click.Choice(["failed"]),
    help="Run failed rows again. A row that failed at a limit of time or memory always runs again if this limit is "
    "now higher.",
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

    The command prints the share of the variations inside the limits, with the 95 % interval of this share. It writes a
    table (results.parquet) and a report. The report shows distributions, effects of the parameters, and the commands
    that repeat the worst cases.

    An interrupted study resumes where it stopped.

    \b
    Example: hystfmu study scenarios/pid/draws.study.toml -o out
             hystfmu study scenarios/pid/draws.study.toml -o out --retry failed
    """
    import hystfmu as hy
    from hystfmu.report.terminal import counter
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
        echo(json.dumps(facts | files | {"seed": outcome.seed, "summary": answer}))
    else:
        say(
            f"{facts['rows']} rows, {facts['ran']} of them computed now ({outcome.seconds:.1f} s), "
            f"{facts['failed']} failed; seed {outcome.seed}"
        )
        if summary is not None:
            say(spreads(summary, every=level() == VERBOSE))
        shown = outcome.failed if level() == VERBOSE else outcome.failed[:10]
        echo("".join(f"row {r['index']} ({r['case']}): {r['status']}: {r['reason']}\n" for r in shown), nl=False)
        say(f"{outcome.table}\n{outcome.report}")
