"""Commands for the first steps and for published results: start, demo, blocks and reproduce."""

import importlib
import sys
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Any

import click

from hystfmu.base import refuse_existing
from hystfmu.cli.identify import Columns, data_options
from hystfmu.cli.options import FILE, Command, WrittenFolder, json_option, of
from hystfmu.report.terminal import answer, answers_json, detail, echo, say, tell, verdict, wrong

if TYPE_CHECKING:
    from hystfmu.scenario import Result
    from hystfmu.start.closed_loop import Contender

_BEGUN = "finished steps are kept; to continue:"


@click.command(cls=Command)
@click.argument("name", required=False)
@of("", markdown=("", {"hidden": True}))
@json_option
def blocks(name: str | None, markdown: bool) -> None:
    """List all blocks, or describe the block NAME.

    The description of a block contains ports, parameters, units of measure, equation and literature source.

    \b
    Example: hystfmu blocks zhao_tan
    \f

    Parameters
    ----------
    markdown : bool
        Print the tables of a page.
    """
    from hystfmu.graph import listing

    if name is None and markdown:
        echo(listing.markdown())
    else:
        tell(listing.overview() if name is None else listing.details(name))
    answer(listing.as_json(name))


@click.command(cls=Command)
@click.argument("names", nargs=-1)
@of("", papers="DIR", data="DIR", full="", report="DIR")
@json_option
def reproduce(
    names: tuple[str, ...], papers: str | None, data: str | None, full: bool, report: WrittenFolder | None
) -> None:
    """Reproduce the result tables of the papers.

    Each line of a table states a quantity, its place in the paper and the value printed in the paper. Two further
    columns contain the result of a literal implementation of the paper and the result of HystFMU. The last column
    states whether the result of HystFMU meets the printed value, or by which factor it misses this value. If a paper
    does not specify its measured record, the command tries several records. The line then states for how many records
    the printed value is met. For networks, the line states the median and the range of the results over several seeds.

    Some lines of the table state a target, that is, a bound for the result of HystFMU. The exit status is 1 if a result
    misses its target. Missed printed values and missed run times do not change the exit status. If the data or the
    Python packages for a paper are missing, the command names this paper and skips it. The exit status is then 1, or 2
    if no paper can run.

    The command imports Python files that are part of the repository. An installed package does not contain these files.

    \b
    Example: hystfmu reproduce zhao_tan_2008
    \f

    Parameters
    ----------
    papers : str, optional
        Folder with the Python files of the papers. The default is scenarios/papers in a clone of the repository.
    data : str, optional
        Folder with the measured data sets of the papers.
    full : bool
        Run every variant of a paper. For example, shen_ma_2017 fits networks with 1 to 100 neurons in 12 minutes.
    report : str, optional
        Write one HTML page per paper into this folder. It contains the tables and the diagrams computed by HystFMU.
    """
    from hystfmu.base import InputError, write_text
    from hystfmu.report.terminal import progress

    of = _papers(papers)
    for name in names if data is None else ():  # without names, the list of skipped papers states the missing data
        if name in of.NEEDS_DATA:
            raise InputError(f"{name}: the measured data is not part of this package; name its folder with --data DIR")
    lacking = {name: why for name in names or of.PAPERS if (why := of.missing(name, data))}
    able = [name for name in names or of.PAPERS if name not in lacking]
    if not able:
        raise InputError("; ".join(lacking.values()))
    if report is not None:
        refuse_existing(*(Path(report) / f"{name}.html" for name in able))  # every run writes other times into them
    for name, why in lacking.items():
        echo(f"skipped {name}: {why}", err=True)
    reports = []
    for name in able:
        with progress(name) as done:
            reports.append(of.reproduce(name, data, done, full))
        say(reports[-1].text() + "\n")
        missed_rows = [row for row in reports[-1].rows if row.met is False]
        wrong([f"{name}: {row.quantity}: {row.ours:.4g} misses the target {row.target:.4g}" for row in missed_rows])
        if report is not None:
            write_text(Path(report) / f"{name}.html", reports[-1].html())
    missed = any(row.met is False and row.where != "speed" for r in reports for row in r.rows)
    answer([r.data() for r in reports], not (missed or lacking))


def _papers(folder: str | None) -> ModuleType:
    """Import the papers from `folder`, by default from the current clone or from the clone of the running program."""
    from hystfmu.base import InputError
    from hystfmu.scenario.system.spec import here_or_shipped

    home = (here_or_shipped("scenarios/papers") if folder is None else Path(folder)).resolve()
    if home.name != "papers" or not (home / "__init__.py").is_file():
        raise InputError(
            f"{home}: The papers must be in a folder scenarios/papers, which only the repository of HystFMU "
            "contains. Run the command in a clone, or name the folder with --papers DIR."
        )
    sys.path.insert(0, str(home.parent))
    return importlib.import_module("papers")


@click.command(cls=Command, interrupted=_BEGUN)
@of("", out="-o DIR")
@of("demo:demo", full="")
def demo(out: WrittenFolder = "demo", full: bool = False) -> None:
    """Run the whole workflow on built-in data.

    The command fits a model, inverts it, and exports FMUs and a Modelica package. It then simulates a closed loop for
    the identified device and for worst-case devices, and writes a report.

    \b
    Example: hystfmu demo -o demo
             hystfmu demo --full -o all
    \f

    Parameters
    ----------
    out : str
        Folder to write into.
    """
    from hystfmu.demo import demo as run_demo

    answer(None, run_demo(Path(out), full))


@click.command(cls=Command, interrupted=_BEGUN)
@click.argument("data", type=FILE, nargs=-1, required=True)
@of("", out="-o DIR")
@of("start.run:start", key="--model KEY")
@data_options(refused=["covariates"])
@of("start.run:start", options="--set", seed="")
@of(
    "start.requirements:Requirements",
    error="PERCENT",
    controller="NAME",
    bandwidth="",
    ms="",
    settling="",
    overshoot="PERCENT",
    reference=("SHAPE[:HZ]|FILE", {"multiple": True}),
    delay="STEPS",
    resonance="HZ[,ZETA]",
    amplifier="NAME=VALUE,...",
)
@of("", requirements="FILE")
@json_option
def start(
    data: tuple[str, ...],
    key: str,
    columns: Columns,
    options: dict[str, Any],
    seed: int,
    requirements: str | None,
    out: WrittenFolder = "start",
    **asked: Any,
) -> None:
    """Build a compensated loop from one record of a device.

    The command reads DATA, selects and fits a model, and inverts the model. It tunes several controllers such that the
    loop is stable for every device that agrees with the record. It simulates the loop with the best controller, and
    writes FMUs, a report and verdict.json. At the end, it prints each file and the command line that writes or uses it.
    If the record is not sufficient to design feedback, the loop has no feedback, only feed-forward and inverse. The
    file measure_next.csv then contains an input signal with which you can measure a better record.

    The exit status is 0 if the loop is approved, otherwise 1. The command writes model, FMU, report and verdict.json
    also if the loop is not approved.

    \b
    Example: hystfmu start data.csv -o mine
             hystfmu start stage.csv --time "Zeit [ms]" --error 0.5
             hystfmu start stage.csv --reference triangle:100 --bandwidth 80
    \f

    Parameters
    ----------
    requirements : str, optional
        TOML file with requirements. Its keys are the names of the options from --error to --amplifier.
    out : str
        Folder to write into.
    """
    from hystfmu.base import InputError, load_toml
    from hystfmu.report.terminal import progress, table
    from hystfmu.start.page import OF_REFERENCE, race_table, reference_table, sentence
    from hystfmu.start.requirements import Requirements
    from hystfmu.start.run import start as make

    given = load_toml(Path(requirements)) if requirements is not None else {}
    try:
        Requirements.of(given)
    except InputError as e:
        raise InputError(f"{requirements}: {e}") from None
    wanted = Requirements.of(given | {k: v for k, v in asked.items() if v not in (None, ())})
    measured = columns.read(data)
    say(measured.read_as)
    source = [*data, *columns.words()]
    made = make(measured, Path(out), wanted, key, seed, source, say, progress, **options)
    loop = None if isinstance(made.loop, str) else made.loop
    cases = [] if loop is None else [_case(r) for r in loop.results]
    if answers_json():
        told = {name: {"path": str(path), "command": command} for name, (path, command) in made.files.items()}
        limits = [] if loop is None else [vars(v) | {"within": v.within} for v in loop.margins.verdicts]
        facts: dict[str, Any] = {"model": made.model.key, "fit": made.model.fit, "verdict": made.verdict}
        facts["race"] = [] if loop is None else [_contender(c) for c in loop.contenders]
        answer(facts | {"cases": cases, "limits": limits, "files": told, "notes": made.notes}, made.approved)
    detail(f"\n{made.model}")
    if loop is not None:
        if loop.race.found:
            say("\n" + table(*race_table(loop, page=False)))
            for why in dict.fromkeys(loop.race.refused.values()):
                say(f"not usable: {', '.join(n for n, reason in loop.race.refused.items() if reason == why)}: {why}")
        say("\n" + table(*reference_table(made.verdict)))
        say(OF_REFERENCE)
        head = ["case", "RMS % of stroke", "max %", "limit, RMS %", "verdict", "difference"]
        detail("\n" + table(head, [[*c.values()] for c in cases]))
        limits_of_loop = [
            [v.limit, "unstable" if v.value is None else f"{v.value:.3g}", f"{v.bound:g}", v.word, v.where]
            for v in loop.margins.verdicts
        ]
        if limits_of_loop:
            say("\n" + table(["limit of the loop", "value", "bound", "verdict", "at"], limits_of_loop))
    notes = [*made.verdict["reasons"], *made.notes, *made.model.fit.get("warnings", ())]
    for note in notes:
        echo(note if loop is None and note == notes[0] else f"warning: {note}", err=True)
    say("\nfiles, and the commands that write or use them:")
    for what, (path, command) in made.files.items():
        say(f"{what}: {path}\n    {command}")
    verdict(sentence(made.verdict), made.approved)
    answer(None, made.approved)


def _contender(c: "Contender") -> dict[str, Any]:
    """Return the results of a compared controller structure, with the keys of the JSON output."""
    t = c.tuned
    return {
        "structure": t.structure.name,
        "Ki": t.Ki,
        "values": t.values,
        "errors_percent": c.errors,
        "bandwidth": t.bandwidth,
        "Ms_db": t.ms_db,
        "Ms_of_all_db": t.set_ms_db,
        "overshoot_percent": None if c.step is None else c.step.overshoot,
        "settling": None if c.step is None else c.step.settling,
    }


def _case(result: "Result") -> dict[str, str]:
    """Return the result of a case of the new loop as text, with the keys of the JSON output."""
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
