"""The command line.  Every slow import happens inside the command that needs it: `hystfmu --help` stays fast."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import click

from hystfmu import __version__
from hystfmu.errors import InputError

if TYPE_CHECKING:
    from hystfmu.data import Dataset

FAILED, BAD_INPUT = 1, 2


class _Commands(click.Group):
    """Commands in the order of the work; bad input is one line on stderr and exit status 2."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        return list(self.commands)

    def invoke(self, ctx: click.Context) -> Any:
        try:
            return super().invoke(ctx)
        except InputError as e:
            line = " ".join(str(e).split())
            click.echo(f"hystfmu: {line}", err=True)
            ctx.exit(BAD_INPUT)


@click.group(cls=_Commands, context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(__version__, prog_name="hystfmu")
def main() -> None:
    """Identify hysteresis of smart-material actuators, invert it, hand it on as FMUs.

    \b
    Example: from a measurement (columns t, u, y) to an FMU
      hystfmu fit data.csv --model prandtl_ishlinskii -o piezo.model.toml
      hystfmu export piezo.model.toml --fmi 2 -o piezo.fmu
      hystfmu demo                       everything once, on built-in data
    """


_json_option = click.option("--json", "as_json", is_flag=True, help="Print the result as JSON.")


def _data_options(f: Callable[..., Any]) -> Callable[..., Any]:
    for option in (
        click.option(
            "--resample",
            is_flag=False,
            flag_value="median",
            metavar="[HZ]",
            help="Bring uneven steps to this rate, or to the median step; gaps are refused.",
        ),
        click.option("--rate", type=float, metavar="HZ", help="Sample rate, when the file has no time column."),
        click.option("--output", default="y", show_default=True, help="Name of the output column."),
        click.option("--input", "input_", default="u", show_default=True, help="Name of the input column."),
        click.option("--time", default="t", show_default=True, help="Name of the time column (s)."),
    ):
        f = option(f)
    return f


@main.command()
@click.argument("name", required=False)
@click.option("--markdown", is_flag=True, hidden=True, help="The table as it stands in the README.")
@_json_option
def blocks(name: str | None, markdown: bool, as_json: bool) -> None:
    """List the blocks, or show one: ports, parameters, units, equation, source.

    \b
    Example: hystfmu blocks zhao_tan
    """
    from hystfmu import listing

    if name is None:
        click.echo(listing.as_json() if as_json else listing.markdown() if markdown else listing.overview())
    else:
        click.echo(listing.as_json(name) if as_json else listing.details(name))


def _assignments(pairs: tuple[str, ...]) -> dict[str, Any]:
    values: dict[str, Any] = {}
    for pair in pairs:
        name, equals, text = pair.partition("=")
        if not equals or not name:
            raise InputError(f"--set {pair}: write it as name=value")
        try:
            values[name] = json.loads(text)
        except json.JSONDecodeError:
            values[name] = text
    return values


def _read(
    path: str,
    time: str,
    input_: str,
    output: str | None,
    rate: float | None,
    resample: str | None,
    train: str | None = None,
) -> Dataset:
    from hystfmu.data import Dataset

    try:
        to: Any = resample if resample in (None, "median") else float(resample)
    except ValueError:
        raise InputError(f"--resample {resample}: write a rate in Hz, or nothing for the median step") from None
    return Dataset.from_csv(path, time, input_, output, rate, train, to)


@main.command()
@click.argument("data")
@click.option("--model", "key", required=True, metavar="KEY", help="Kind of model; an unknown key lists them.")
@click.option("-o", "out", required=True, metavar="M.model.toml", help="The model file to write.")
@_data_options
@click.option("--train", metavar="A:B", help="Rows whose residuals count; the model always runs from row 0.")
@click.option("--set", "settings", multiple=True, metavar="NAME=VALUE", help="Option of the method (repeatable).")
@click.option("--seed", default=0, show_default=True, help="Seed of random starts.")
@_json_option
def fit(
    data: str,
    key: str,
    out: str,
    time: str,
    input_: str,
    output: str,
    rate: float | None,
    resample: str | None,
    train: str | None,
    settings: tuple[str, ...],
    seed: int,
    as_json: bool,
) -> None:
    """Identify a model from measured data.

    \b
    Example: hystfmu fit piezo.csv --model zhao_tan_mlp --train 2000:4200 -o piezo.model.toml
    """
    from hystfmu.identify import fit as fit_model
    from hystfmu.terminal import progress, table

    options = _assignments(settings)
    measured = _read(data, time, input_, output, rate, resample, train)
    with progress(f"fitting {key}") as report:
        model = fit_model(measured, key, seed=seed, progress=report, **options)
    model.save(out)
    f = model.fit
    if as_json:
        click.echo(json.dumps({"model": model.key, "file": out, **f}))
        return
    if key == "auto":
        p = model.provenance
        rated = [[k, p["auto_parameters"][k], f"{e:.4g}"] for k, e in p["auto"].items()]
        click.echo(table(["candidate", "parameters", "held-out RMS %FS"], rated))
        for name, reason in p["auto_left_out"].items():
            click.echo(f"left out: {name}: {reason}")
        click.echo(f"memory: {f['memory']} ({f['loops']} minor loops, gap {f['gap_percent']:.2g} % of the span of y)")
        click.echo(f"rate dependence: {f['rate']}\n")
    for warning in f.get("warnings", ()):
        click.echo(f"warning: {warning}", err=True)
    row = [model.key, f["parameters"], f"{f['rms_percent']:.4g}", f"{f['max_percent']:.4g}", f"{f['seconds']:.2f}"]
    head = ["model", "parameters", "RMS %FS", "max %FS", "seconds"]
    if "coverage_percent" in f:
        head, row = [*head, "coverage %"], [*row, f"{f['coverage_percent']:.0f}"]
    click.echo(table(head, [row]))
    click.echo(f"wrote {out}")


@main.command()
@click.argument("model")
@click.argument("data")
@click.option("-o", "out", required=True, metavar="OUT.csv", help="File to write: columns t, u, y.")
@_data_options
@_json_option
def predict(
    model: str,
    data: str,
    out: str,
    time: str,
    input_: str,
    output: str,
    rate: float | None,
    resample: str | None,
    as_json: bool,
) -> None:
    """Run a model free on the input column of a file.

    Row 0 is the output after initialisation with the first input; row k what an FMU gives after set u_k,
    doStep(t_{k-1}, h), get y.  Says how many rows lie outside what a network was trained on, where its limits hold.

    \b
    Example: hystfmu predict piezo.model.toml piezo.csv -o predicted.csv
    """
    from hystfmu.coverage import WARN, clamped
    from hystfmu.model import Model

    m = Model.load(model)
    measured = _read(data, time, input_, None, rate, resample)
    y = m.predict(measured.u, measured.h)
    measured.with_output(y).to_csv(out)
    outside = clamped(m.graph, measured.u, measured.h)
    share = 100 * float(outside.mean())
    if share > WARN:
        click.echo(
            f"warning: {data}: {share:.3g} % of the rows (the first: row {int(outside.argmax())}) lie outside what "
            f"{model} was trained on; it is limited there",
            err=True,
        )
    if as_json:
        click.echo(json.dumps({"file": out, "rows": len(y), "clamped_percent": share}))
        return
    click.echo(f"wrote {out}: {len(y)} rows")


@main.command()
@click.argument("model")
@click.option("-o", "out", required=True, metavar="INV.model.toml", help="The model file to write.")
@click.option("--method", type=click.Choice(["exact", "implicit", "learned"]), default="exact", show_default=True)
def inverse(model: str, out: str, method: str) -> None:
    """Invert a model: its output becomes the input that produces it.

    \b
    Example: hystfmu inverse piezo.model.toml -o inverse.model.toml
    """
    from hystfmu.inverse import inverse as invert
    from hystfmu.model import Model

    made = invert(Model.load(model), method=method)
    made.save(out)
    rms, most = (made.fit.get(f"cascade_{k}_percent") for k in ("rms", "max"))
    worth = "" if rms is None else f": inverse and model in cascade, RMS {rms:.2g} %, max {most:.2g} % of the span"
    click.echo(f"wrote {out}{worth}")


@main.command()
@click.argument("model")
@click.option("-o", "out", metavar="X.fmu", help="The FMU to write.")
@click.option("--fmi", type=click.Choice(["2", "3"]), default="2", show_default=True, help="Version of the standard.")
@click.option("--name", metavar="NAME", help="Model name in the FMU; default: the key of the model.")
@click.option(
    "--platforms", type=click.Choice(["host", "all"]), default="host", show_default=True, help="Binaries to pack."
)
@click.option("--source", is_flag=True, help="Pack the C source too: one file with the data in it.")
@click.option("--modelica", metavar="DIR", help="Write a Modelica package there: a record and a ready block.")
def export(
    model: str,
    out: str | None,
    fmi: str,
    name: str | None,
    platforms: Literal["host", "all"],
    source: bool,
    modelica: str | None,
) -> None:
    """Pack a model as an FMU for Co-Simulation and Model Exchange, or as Modelica; no compiler is needed.

    \b
    Example: hystfmu export piezo.model.toml --fmi 3 -o piezo.fmu
             hystfmu export piezo.model.toml --modelica modelica
    """
    from hystfmu.fmu.export import export_fmu
    from hystfmu.fmu.platforms import missing
    from hystfmu.model import Model

    if out is None and modelica is None:
        raise InputError("say what to write: -o X.fmu or --modelica DIR")
    if modelica is not None:
        from hystfmu.modelica import export_modelica

        file = Path(model).name
        written = export_modelica(Model.load(model), modelica, name or file.removesuffix(".model.toml"), file)
        click.echo(f"wrote {written}: Modelica package with the record Values and the block Model")
    if out is None:
        return
    version: Literal[2, 3] = 2 if fmi == "2" else 3
    path = export_fmu(Model.load(model), out, version, name, platforms, source)
    if platforms == "all" and (left_out := missing()):
        click.echo(
            f"left out: no binary is installed for {', '.join(left_out)} ('make platforms' builds them)", err=True
        )
    click.echo(f"wrote {path}: FMI {fmi}.0, {path.stat().st_size // 1024} kB")


@main.command()
@click.argument("fmu")
@click.option("--seconds", default=60.0, show_default=True, help="Time limit.")
@_json_option
def validate(fmu: str, seconds: float, as_json: bool) -> None:
    """Check anybody's FMU: the archive, static checks of fmpy and fmutool, and trial runs in a process of its own.

    Start values, equal runs, get and set without effect, reset, saved states, two instances, dependencies, directional
    derivatives, leaks, odd folders.

    \b
    Example: hystfmu validate piezo.fmu
    """
    from hystfmu.fmu.check import check_fmu

    problems = check_fmu(fmu, seconds)
    if as_json:
        click.echo(json.dumps({"file": fmu, "problems": problems}))
    else:
        for p in problems:
            click.echo(p)
        click.echo(f"{fmu}: {len(problems)} problem{'' if len(problems) == 1 else 's'}")
    sys.exit(FAILED if problems else 0)


@main.command()
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
@click.option("--step", type=float, metavar="SECONDS", help="Of an SSP that states none, or another one.")
@click.option("--stop", type=float, metavar="SECONDS", help="Of an SSP that states none, or another one.")
@click.option("-o", "--out", metavar="OUT.csv", help="Write all outputs of an SSP there.")
@click.option("--record", is_flag=True, help="Write the results as the new baseline.")
@click.option("--report", "report_dir", metavar="DIR", help="Write report.html and report.json there.")
@_json_option
def run(
    scenarios: tuple[str, ...],
    everything: bool,
    settings: tuple[str, ...],
    engine: Literal["fmpy", "python", "native"],
    coupling: Literal["gauss_seidel", "jacobi", "iterative"] | None,
    timeout: float,
    step: float | None,
    stop: float | None,
    out: str | None,
    record: bool,
    report_dir: str | None,
    as_json: bool,
) -> None:
    """Run closed-loop scenarios on real FMUs by fmpy and hold them against limits and baselines.

    An SSP archive of anybody runs too, and is held against the reference result in it.

    \b
    Example: hystfmu run scenarios/sliding_mode --report out
             hystfmu run loop.ssp -o out.csv
    """
    if len(scenarios) == 1 and scenarios[0].endswith(".ssp"):
        from hystfmu.scenario.ssp_file import run_ssp_file

        lines, passed = run_ssp_file(scenarios[0], engine, coupling, step, stop, timeout, out)
        click.echo("\n".join(lines))
        sys.exit(0 if passed else FAILED)
    from hystfmu.scenario import run_scenarios
    from hystfmu.terminal import progress, verdicts

    if everything == bool(scenarios):
        raise InputError("name scenarios, or use --all (example: hystfmu run scenarios/pid)")
    paths = sorted(p.parent for p in Path("scenarios").glob("*/scenario.toml")) if everything else scenarios
    if not paths:
        raise InputError("no scenarios/*/scenario.toml below the current directory")
    with progress("running") as report:
        results = run_scenarios(
            [Path(p) for p in paths],
            record=record,
            report_dir=Path(report_dir) if report_dir else None,
            overrides=_assignments(settings),
            progress=report,
            engine=engine,
            coupling=coupling,
            seconds=timeout,
        )
    if as_json:
        click.echo(json.dumps([r.summary() for r in results]))
    else:
        click.echo(verdicts(results))
    sys.exit(0 if all(r.passed for r in results) else FAILED)


@main.command()
@click.argument("scenario")
@click.option("-o", "--out", required=True, metavar="X.ssp")
@click.option("--case", "name", metavar="NAME", help="Case of the scenario [default: its first].")
@click.option("--ssp", "version", type=click.Choice(["1.0", "2.0"]), default="1.0", show_default=True)
@click.option("--fmi", type=click.Choice(["2", "3"]), default="2", show_default=True, help="FMI version of our units.")
@click.option("--connectors", is_flag=True, help="Outputs of the system for recorded signals; libcosim rejects them.")
def ssp(scenario: str, out: str, name: str | None, version: Literal["1.0", "2.0"], fmi: str, connectors: bool) -> None:
    """Write a scenario as an SSP archive that other simulators run; 'hystfmu run X.ssp' reads those of others.

    \b
    Example: hystfmu ssp scenarios/pid --case sine_10 -o pid.ssp
    """
    from hystfmu.scenario import Scenario
    from hystfmu.scenario.ssp import write_ssp

    cases = {c.name: c for c in Scenario(scenario).cases}
    if name is not None and name not in cases:
        raise InputError(f"{scenario}: no case {name!r}; there are {', '.join(cases)}")
    case = cases[name] if name is not None else next(iter(cases.values()))
    path = write_ssp(case, out, version, connectors, 3 if fmi == "3" else 2)
    click.echo(f"{path}: SSP {version}, case {case.name}, {len(case.units)} units, step {case.step:g} s")


@main.command()
@click.argument("study")
@click.option("-o", "--out", "folder", required=True, metavar="DIR", help="Table and report; run again to resume.")
@click.option("-j", "--jobs", type=click.IntRange(1, 1024), help="Local processes [default: one per core].")
@click.option("--on", metavar="dask://HOST:PORT", help="Run on the Dask cluster with this scheduler.")
@_json_option
def study(study: str, folder: str, jobs: int | None, on: str | None, as_json: bool) -> None:
    """Run a scenario over many variations: a table (results.parquet) and a report of what matters.

    Interrupted studies go on where they stopped.

    \b
    Example: hystfmu study scenarios/studies/mismatch.toml -o out -j 2
    """
    from hystfmu.study import run_study
    from hystfmu.terminal import counter

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


@main.command()
@click.argument("names", nargs=-1)
@click.option("--data", metavar="DIR", help="Folder with measured data, for the data sets that need it.")
@click.option("--full", is_flag=True, help="Everything a paper tried: shen_ma_2017 1..100 hidden neurons, 12 minutes.")
@_json_option
def reproduce(names: tuple[str, ...], data: str | None, full: bool, as_json: bool) -> None:
    """The result tables of the papers: the printed number, a literal replica, and ours.

    Exit status 1 if a target is missed; the line says by how much.

    \b
    Example: hystfmu reproduce zhao_tan_2008
    """
    from hystfmu.reproduce import PAPERS
    from hystfmu.reproduce import reproduce as reproduce_paper
    from hystfmu.terminal import progress

    reports = []
    for name in names or PAPERS:
        with progress(name) as report:
            reports.append(reproduce_paper(name, data, report, full))
        if not as_json:
            click.echo(reports[-1].text() + "\n")
    if as_json:
        click.echo(json.dumps([r.data() for r in reports]))
    sys.exit(FAILED if any(row.met is False for r in reports for row in r.rows) else 0)


@main.command()
@click.option("-o", "out", default="demo", show_default=True, metavar="DIR", help="Directory to write into.")
def demo(out: str) -> None:
    """Everything once on built-in data: fit, compare, export, run scenarios, report.

    \b
    Example: hystfmu demo -o demo
    """
    from hystfmu.demo import demo as run_demo

    sys.exit(0 if run_demo(Path(out)) else FAILED)


if __name__ == "__main__":
    main()
