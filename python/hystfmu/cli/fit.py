"""The command that fits a model."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import click

from hystfmu.base.errors import InputError
from hystfmu.base.files import may_replace, refusal, together
from hystfmu.cli.columns import Columns, data_options
from hystfmu.cli.options import FILE, OUTPUT_FILE, OUTPUT_FOLDER, Command, assignments, json_option
from hystfmu.report.terminal import detail, echo, say, tell

if TYPE_CHECKING:
    from hystfmu.data import Dataset


def _list_models(context: click.Context, option: click.Parameter, asked: bool) -> None:
    if not asked:
        return
    from hystfmu.base.errors import MissingExtra
    from hystfmu.identify import METHODS, description, options
    from hystfmu.report.terminal import table

    for key in METHODS:
        try:
            tell(f"{key}: {description(key)}")
        except MissingExtra as e:
            echo(f"{key}: {e}")
            continue
        if rows := [[f"  {o.name}", o.shown_default, o.rule, o.text] for o in options(key)]:
            echo(table(["  --set", "default", "must be", "meaning"], rows))
        echo("")
    context.exit()


@click.command(cls=Command)
@click.argument("data", type=FILE, nargs=-1, required=True)
@click.option(
    "--models",
    is_flag=True,
    is_eager=True,
    expose_value=False,
    callback=_list_models,
    help="List the kinds of model with the meaning of each option.",
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
    "--graph",
    "graph",
    metavar="G.graph.toml",
    help="Fit the free parameters of this graph of blocks instead of a kind of model; its table [free] names them.",
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
    help="Model file to write; by default DATA.KIND.model.toml in the current folder.",
)
@data_options
@click.option("--train", metavar="A:B", help="Rows to fit, first:end.  The model runs from row 0 in any case.")
@click.option(
    "--set", "settings", multiple=True, metavar="NAME=VALUE", help="Option of the identification method; repeatable."
)
@click.option("--seed", default=0, show_default=True, help="Seed of the random starts.")
@click.option(
    "--report",
    "folder",
    type=OUTPUT_FOLDER,
    metavar="DIR",
    help="Write a page about the fit; without -o also into the current folder.",
)
@json_option
def fit(
    data: tuple[str, ...],
    key: str,
    graph: str | None,
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

    DATA is a text file with columns, which may be compressed by gzip. The extra 'files' adds further formats. The
    command detects encoding, separator, decimal sign, preamble and units of measure, and prints all assumptions in one
    line. Several files are several records; the model starts anew in each record.

    \b
    Example: hystfmu fit piezo.csv --model zhao_tan_mlp -o piezo.model.toml
             hystfmu fit stage.csv --time "Zeit [ms]" --input "Spannung [V]"
             hystfmu fit record.dat --rate 200 --input 1 --output 5
             hystfmu fit monday.csv tuesday.csv --model prandtl_ishlinskii
             hystfmu fit oven.csv --model actuator --covariate "T [degC]"
             hystfmu fit piezo.csv --graph my.graph.toml -o my.model.toml
             hystfmu fit --models
    """
    import hystfmu as hy
    from hystfmu.face.interval import free_run, interval_text, known, parts, table_of, with_interval
    from hystfmu.face.page import evidence_lines, free_table
    from hystfmu.identify.catalogue import method
    from hystfmu.report.terminal import progress, table

    options = assignments(settings)
    method(key)  # a misspelt kind is told before a missing file
    if graph is not None:
        if key != "auto":
            raise InputError(f"--graph and --model exclude each other. Got {graph} and {key}.")
        key = "graph"
    measured = columns.read(data, train)
    if not as_json:
        say(measured.read_as)
    if out is not None or key != "auto":
        _refuse_other(out or f"{measured.stem}.{key}.model.toml", measured, key, seed)
    with progress(f"fitting {key}") as report:
        kind: Any = Path(graph) if graph is not None else key
        model = hy.fit(measured, kind, seed=seed, progress=report, purpose=purpose, **options)
        model = with_interval(model, measured)
    name = f"{measured.stem}.{model.key}"
    if out is None:
        out, folder = f"{name}.model.toml", folder or "."
    with together():
        model.save(out)
        page = None if folder is None else model.report(measured, Path(folder) / f"{name}.html")
    f = model.fit
    y = free_run(model, measured)
    found = parts(y, measured, True)
    if as_json:
        told = [{"part": p.name, "rows": [p.rows.start, p.rows.stop], **p.errors} for p in found]
        more = {"page": str(page)} if page else {}
        echo(json.dumps({"model": model.key, "file": out, **f, "errors": told, **more}))
        return
    if key == "auto":
        p = model.provenance
        rated = [
            [k, f"{e:.4g}", _range(p["auto_blocks"][k]), p["auto_parameters"][k], p["auto_inverse"][k]]
            for k, e in p["auto"].items()
        ]
        first = [(n, "not tried") for n in p["auto_not_tried"]]
        for name, word in [*first, *((n, "left out") for n in p["auto_left_out"] if n not in p["auto_not_tried"])]:
            say(f"{word}: {name}: {p['auto_left_out'][name]}")
        say(table(["candidate", "validation RMS %FS", "of single blocks", "parameters", "inverse"], rated))
        say(f"memory: {f['memory']} ({f['loops']} minor loops, gap {f['gap_percent']:.2g} % of the span of y)")
        say(f"rate dependence: {f['rate']}\n")
    if "lag" in f and not any("lags" in w for w in f.get("warnings", ())):
        say(f"lag: {f['lag']}; the model follows it")
    for warning in f.get("warnings", ()):
        echo(f"warning: {warning}", err=True)
    if shown_free := free_table(model):
        say(table(shown_free.head, shown_free.rows) + "\n")
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
    say(interval_text(known(model, measured), measured.unit_y))
    for line in evidence_lines(model):
        say(line)
    detail(f"\n{model}\n")
    say(f"wrote {out}" + ("" if page is None else f" and {page}"))


def _refuse_other(path: str, data: Dataset, key: str, seed: int) -> None:
    """Raise an error before the fit if the file exists and contains no model of these rows and this kind."""
    from hystfmu.base.files import load_toml

    if may_replace(path):
        return
    try:
        found = load_toml(path)
    except InputError:
        raise refusal(path) from None
    stated = found.get("provenance")
    of = {"sha256": data.sha256, "train": f"{data.train.start}:{data.train.stop}", "seed": seed}
    if not (isinstance(stated, dict) and of.items() <= stated.items() and key in ("auto", found.get("key"))):
        raise refusal(path)


def _range(errors: Sequence[float]) -> str:
    """Return the smallest and the largest error of the validation blocks as text; empty for a single block."""
    return f"{min(errors):.3g} to {max(errors):.3g}" if len(errors) > 1 else ""
