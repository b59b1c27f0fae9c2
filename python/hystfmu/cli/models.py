"""Commands for blocks and models: blocks, fit, predict, check, inverse and migrate."""

from __future__ import annotations

import json
import sys
from collections.abc import Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any, Literal

import click

from hystfmu.cli.options import FAILED, OUTPUT_FILE, Columns, Command, assignments, data_options, json_option
from hystfmu.report.verbosity import detail, say


@click.command(cls=Command)
@click.argument("name", required=False)
@click.option("--markdown", is_flag=True, hidden=True, help="Print the tables of a page.")
@json_option
def blocks(name: str | None, markdown: bool, as_json: bool) -> None:
    """List all blocks, or describe one.

    The description gives ports, parameters, units of measure, equation and source.

    \b
    Example: hystfmu blocks zhao_tan
    """
    from hystfmu.graph import listing

    if name is None:
        click.echo(listing.as_json() if as_json else listing.markdown() if markdown else listing.overview())
    else:
        click.echo(listing.as_json(name) if as_json else listing.details(name))


def _list_models(context: click.Context, option: click.Parameter, asked: bool) -> None:
    if not asked:
        return
    from hystfmu.base.extras import MissingExtra
    from hystfmu.identify import METHODS, description, options
    from hystfmu.report.terminal import table

    for key in METHODS:
        try:
            click.echo(f"{key}: {description(key)}")
        except MissingExtra as e:
            click.echo(f"{key}: {e}")
            continue
        if rows := [[f"  {o.name}", o.shown_default, o.rule, o.text] for o in options(key)]:
            click.echo(table(["  --set", "default", "must be", "meaning"], rows))
        click.echo()
    context.exit()


@click.command(cls=Command)
@click.argument("data", nargs=-1, required=True)
@click.option(
    "--models",
    is_flag=True,
    is_eager=True,
    expose_value=False,
    callback=_list_models,
    help="List the kinds of model, and what each option means.",
)
@click.option(
    "--model",
    "key",
    default="auto",
    show_default=True,
    metavar="KEY",
    help="Kind of model; 'auto' selects one from the data.",
)
@click.option(
    "--for",
    "purpose",
    type=click.Choice(["model", "inverse"]),
    default="model",
    show_default=True,
    help="inverse: only models with a useful inverse compete.",
)
@click.option(
    "-o",
    "out",
    type=OUTPUT_FILE,
    metavar="M.model.toml",
    help="Model file to write; by default named after DATA, in the current folder.",
)
@data_options
@click.option("--train", metavar="A:B", help="Rows to fit, first:end.  The model runs from row 0 in any case.")
@click.option(
    "--set", "settings", multiple=True, metavar="NAME=VALUE", help="Option of the identification method; repeatable."
)
@click.option("--seed", default=0, show_default=True, help="Seed of the random starts.")
@click.option(
    "--report", "folder", metavar="DIR", help="Write a page about the fit; without -o also into the current folder."
)
@json_option
def fit(
    data: tuple[str, ...],
    key: str,
    purpose: Literal["model", "inverse"],
    out: str | None,
    columns: Columns,
    train: str | None,
    settings: tuple[str, ...],
    seed: int,
    folder: str | None,
    as_json: bool,
) -> None:
    """Identify a model from measured data.

    DATA is a text file of columns, as it is or packed by gzip, a MAT or an HDF5 file.  Encoding, separator, decimal
    sign, preamble and units of measure are found; one line says what was assumed.  Several files are several records,
    each with a memory of its own.

    \b
    Example: hystfmu fit piezo.csv --model zhao_tan_mlp --train 2000:4200 -o piezo.model.toml
             hystfmu fit stage.csv --time "Zeit [ms]" --input "Spannung [V]" --output 3 -o stage.model.toml
             hystfmu fit record.dat --rate 200 --input 1 --output 5
             hystfmu fit monday.csv tuesday.csv --model prandtl_ishlinskii
             hystfmu fit oven.csv --model actuator --covariate "T [degC]" --covariate load
             hystfmu fit --models
    """
    import hystfmu as hy
    from hystfmu.face.fit_page import interval_of, interval_text
    from hystfmu.face.rows import free_run, parts, table_of
    from hystfmu.report.progress import progress
    from hystfmu.report.terminal import table

    options = assignments(settings)
    measured = columns.read(data, train)
    if not as_json:
        say(measured.read_as)
    with progress(f"fitting {key}") as report:
        model = hy.fit(measured, key, seed=seed, progress=report, purpose=purpose, **options)
    name = measured.name.partition(" ")[0]
    if out is None:
        out, folder = f"{name}.model.toml", folder or "."
    model.save(out)
    page = None if folder is None else model.report(measured, Path(folder) / f"{name}.html")
    f = model.fit
    y = free_run(model, measured)
    found, (new, which) = parts(y, measured, True), interval_of(model, y, measured, False)
    if as_json:
        told = [{"part": p.name, "rows": [p.rows.start, p.rows.stop], **p.errors} for p in found]
        more: dict[str, Any] = {"interval": vars(new)} if new else {}
        more |= {"page": str(page)} if page else {}
        click.echo(json.dumps({"model": model.key, "file": out, **f, "errors": told, **more}))
        return
    if key == "auto":
        p = model.provenance
        rated = [
            [k, f"{e:.4g}", _range(p["auto_blocks"][k]), p["auto_parameters"][k], p["auto_inverse"][k]]
            for k, e in p["auto"].items()
        ]
        say(table(["candidate", "validation RMS %FS", "of single blocks", "parameters", "inverse"], rated))
        for name, reason in p["auto_left_out"].items():
            say(f"left out: {name}: {reason}")
        say(f"memory: {f['memory']} ({f['loops']} minor loops, gap {f['gap_percent']:.2g} % of the span of y)")
        say(f"rate dependence: {f['rate']}\n")
    if "lag" in f and not any("lags" in w for w in f.get("warnings", ())):
        say(f"lag: {f['lag']}; the model follows it")
    for warning in f.get("warnings", ()):
        click.echo(f"warning: {warning}", err=True)
    row = [model.key, f["parameters"], f"{f['rms_percent']:.4g}", f"{f['max_percent']:.4g}", f"{f['seconds']:.2f}"]
    head = ["model", "parameters", "RMS %FS", "max %FS", "seconds"]
    if "held_out_rms_percent" in f:
        held = (f"{f[f'held_out_{k}_percent']:.4g}" for k in ("rms", "max"))
        head, row = [*head, "held-out RMS %FS", "held-out max %FS"], [*row, *held]
    if "coverage_percent" in f:
        head, row = [*head, "coverage %"], [*row, f"{f['coverage_percent']:.0f}"]
    say(table(head, [row]))
    if len(found) > 1:
        shown = table_of(found, measured.unit_y)
        say("\n" + table(shown.head, shown.rows))
    if new is not None:
        say(interval_text(new, which, measured.unit_y))
    detail(f"\n{model}\n")
    say(f"wrote {out}" + ("" if page is None else f" and {page}"))


def _range(errors: Sequence[float]) -> str:
    """Return the least and the largest error of the validation blocks; empty if there is one only."""
    return f"{min(errors):.3g} to {max(errors):.3g}" if len(errors) > 1 else ""


@click.command(cls=Command)
@click.argument("model")
@click.argument("data")
@click.option(
    "-o",
    "out",
    required=True,
    type=OUTPUT_FILE,
    metavar="OUT.csv",
    help="CSV file to write, with columns t, u, y and covariates.",
)
@data_options
@json_option
def predict(
    model: str,
    data: str,
    out: str,
    columns: Columns,
    as_json: bool,
) -> None:
    """Simulate a model on the input column of a file.

    Measured outputs are not used (free run); where there are any, the errors against them are printed.  Row 0 is the
    output after initialisation with the first input.  Row k is the output of an FMU after setting u_k and calling
    doStep(t_{k-1}, h).  Warns if rows lie outside the range that a network was trained on; the network clips its inputs
    there.  Covariates are the columns that have their names in the model; --covariate names others, in its order.

    \b
    Example: hystfmu predict piezo.model.toml piezo.csv -o predicted.csv
    """
    import hystfmu as hy
    from hystfmu.face.rows import free_run, parts, table_of
    from hystfmu.model.coverage import WARN, clamped
    from hystfmu.model.inputs import beside, rows_of
    from hystfmu.report.terminal import table

    m = hy.Model.load(model)
    names = beside(m.graph)
    measured = replace(columns, covariates=columns.covariates or names).read(data, with_output=False)
    if len(columns.covariates) == len(names):
        measured = measured.with_names(names)
    y = free_run(m, measured)
    measured.with_output(y).to_csv(out)
    outside = measured.along(lambda rows: clamped(m.graph, rows, measured.h), inputs=rows_of(m.graph, measured))
    share = 100 * float(outside.mean())
    if share > WARN:
        click.echo(
            f"warning: {measured.place(int(outside.argmax()))} and {share:.3g} % of all rows lie outside the training "
            f"range of {model}, which clips its inputs there",
            err=True,
        )
    found = parts(y, measured, False) if measured.has_output else []
    if as_json:
        told = {"errors": [{"part": p.name, "rows": [p.rows.start, p.rows.stop], **p.errors} for p in found]}
        click.echo(json.dumps({"file": out, "rows": len(y), "clamped_percent": share, **(told if found else {})}))
        return
    say(measured.read_as)
    if found:
        shown = table_of(found, measured.unit_y)
        say(table(shown.head, shown.rows))
    say(f"wrote {out}: {len(y)} rows")


@click.command(cls=Command)
@click.argument("model")
@click.argument("data")
@data_options
@click.option(
    "--factor",
    type=float,
    default=2.0,
    show_default=True,
    help="Growth of the RMS error that counts as drift, relative to the error that the model file states.",
)
@json_option
def check(model: str, data: str, columns: Columns, factor: float, as_json: bool) -> None:
    """Tell from a new record whether a device has drifted.

    The model runs free on DATA.  Its error is compared with the one on held-out rows that MODEL states, or on training
    rows; rows whose input lies outside the trained range do not count.  The table shows the error that would be left if
    only the offset, the gain, the lag or the loop of the device had changed.  The exit status is 1 if it has drifted.

    \b
    Example: hystfmu check piezo.model.toml today.csv
    """
    import hystfmu as hy
    from hystfmu.report.terminal import table

    measured = columns.read(data)
    found = hy.Model.load(model).check(measured, factor)
    if as_json:
        click.echo(json.dumps(asdict(found)))
    else:
        say(measured.read_as)
        unit = f" ({measured.unit_y})" if measured.unit_y else ""
        rows = [[p.name, p.value, f"{p.left:.4g}"] for p in found.parts]
        say(table(["change of", "value", f"RMS left{unit}"], [["nothing", "", f"{found.rms:.4g}"], *rows]))
        say(f"{found.inside:.3g} % of the rows lie in the trained range and reach {found.reached:.3g} % of it")
        click.echo(str(found)) if found.drifted else say(str(found))
    sys.exit(FAILED if found.drifted else 0)


@click.command(cls=Command)
@click.argument("model")
@click.option("-o", "out", required=True, type=OUTPUT_FILE, metavar="INV.model.toml", help="Model file to write.")
@click.option(
    "--method",
    type=click.Choice(["auto", "exact", "implicit", "learned", "adaptive"]),
    default="auto",
    show_default=True,
    help="Closed-form inverse, one root of the model per step, a network by the recipe of the papers, or a closed form "
    "that learns its weights while it runs; auto: the first of the other three that the model admits.",
)
@click.option("--set", "settings", multiple=True, metavar="NAME=VALUE", help="Option of the method; repeatable.")
@click.option("--seed", default=0, show_default=True, help="Seed of the learned inverse.")
def inverse(
    model: str,
    out: str,
    method: Literal["auto", "exact", "implicit", "learned", "adaptive"],
    settings: tuple[str, ...],
    seed: int,
) -> None:
    """Compute the inverse of a model.

    The input of the inverse is the wanted output of the model; its output is the model input that produces it.

    Recipe of the learned inverse: the model answers random nested reversals; input and output are exchanged; the
    inverse operator of Zhao & Tan and a few plays of the wanted output feed a network of 12 neurons, which corrects the
    wanted output in front of the exact inverse of fitted plays.  Options: hidden, N (plays), starts, iterations, ...
    Options of the implicit inverse: lo, hi.

    Linear dynamics and a delay behind the hysteresis are inverted by a feed-forward from a few samples of the wanted
    output.  The output of the model is then the wanted one of some steps ago; the command prints how many.

    The adaptive inverse is that of a Prandtl-Ishlinskii model.  Its inputs are v, the wanted output before dynamics and
    delay (a feed-forward, plus what a feedback adds), the reference y_d, and the measured output y.  Options: f_n, zeta
    and delay of what stands behind a static model, T (s) of a drift, and others of the block (hystfmu blocks
    adaptive_inverse).

    \b
    Example: hystfmu inverse piezo.model.toml -o inverse.model.toml
             hystfmu inverse piezo.model.toml --method learned --set hidden=16 -o inverse.model.toml
             hystfmu inverse piezo.model.toml --method adaptive --set delay=1 -o inverse.model.toml
    """
    import hystfmu as hy
    from hystfmu.report.progress import progress

    with progress("inverting") as report:
        made = hy.Model.load(model).inverse(method, seed, report, **assignments(settings))
    made.save(out)
    rms, most = (made.fit.get(f"cascade_{k}_percent") for k in ("rms", "max"))
    worth = "" if rms is None else f": error of inverse and model in cascade: RMS {rms:.2g} %, max {most:.2g} % of span"
    say(f"wrote {out}, {made.provenance['inverse']} inverse{worth}")
    if len(made.graph.outputs) > 1:
        inputs, outputs = (", ".join(p.name for p in ports) for ports in (made.graph.inputs, made.graph.outputs))
        say(f"inputs {inputs}; outputs {outputs}")
    if late := made.fit.get("lag_steps"):
        say(
            f"the output of the model is the wanted one of {late} steps ({made.fit['lag']:.3g} s) ago, accurate up to "
            f"{made.fit['band']:.3g} Hz: give the reference that much earlier"
        )
    for warning in made.fit.get("warnings", ()):
        click.echo(f"warning: {warning}", err=True)


@click.command(cls=Command)
@click.argument("files", nargs=-1, required=True, metavar="FILE...")
@json_option
def migrate(files: tuple[str, ...], as_json: bool) -> None:
    """Bring files of an older version to the present format.

    Model files, scenario.toml and baseline.toml are changed in place and as a whole; comments stay.  What changed is
    printed.  A file of a newer version is refused.

    \b
    Example: hystfmu migrate mine.model.toml scenarios/mine/scenario.toml scenarios/mine/baseline.toml
    """
    from hystfmu.face.migrate import migrate as migrate_file

    told = {}
    for file in files:
        told[file] = migrate_file(file)
        if not as_json:
            say(f"{file}: {', '.join(told[file]) or 'has the present format'}")
    if as_json:
        click.echo(json.dumps(told))
