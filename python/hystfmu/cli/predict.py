"""Commands that compare a model with data: predict and check."""

from __future__ import annotations

import json
import sys
from dataclasses import asdict, replace

import click

from hystfmu.cli.columns import Columns, data_options
from hystfmu.cli.options import FAILED, FILE, OUTPUT_FILE, Command, json_option
from hystfmu.report.terminal import echo, say


@click.command(cls=Command)
@click.argument("model", type=FILE)
@click.argument("data", type=FILE)
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

    The model runs free: it does not use measured outputs. If the file has a measured output, the command prints the
    errors. Row 0 is the output after initialisation with the first input. Row k is the output of an FMU after setting
    u_k and calling doStep(t_{k-1}, h). The command warns if rows lie outside the range that a network was trained on;
    there the network clips its inputs. The command reads covariates from the columns with the names in the model;
    --covariate names other columns, in the order of the model.

    \b
    Example: hystfmu predict piezo.model.toml piezo.csv -o predicted.csv
    """
    import hystfmu as hy
    from hystfmu.face.interval import free_run, parts, table_of
    from hystfmu.model import beside, rows_of
    from hystfmu.model.coverage import WARN, clamped
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
        echo(
            f"warning: {measured.place(int(outside.argmax()))} and {share:.3g} % of all rows lie outside the training "
            f"range of {model}, which clips its inputs there",
            err=True,
        )
    found = parts(y, measured, False) if measured.has_output else []
    if as_json:
        told = {"errors": [{"part": p.name, "rows": [p.rows.start, p.rows.stop], **p.errors} for p in found]}
        echo(json.dumps({"file": out, "rows": len(y), "clamped_percent": share, **(told if found else {})}))
        return
    say(measured.read_as)
    if found:
        shown = table_of(found, measured.unit_y)
        say(table(shown.head, shown.rows))
    say(f"wrote {out}: {len(y)} rows")


@click.command(cls=Command)
@click.argument("model", type=FILE)
@click.argument("data", type=FILE)
@data_options
@click.option(
    "--factor",
    type=float,
    default=2.0,
    show_default=True,
    help="The device has drifted if the RMS error exceeds this multiple of the error in the model file.",
)
@json_option
def check(model: str, data: str, columns: Columns, factor: float, as_json: bool) -> None:
    """Test with a new record whether a device has drifted.

    The model runs free on DATA. The command compares its error with the error that MODEL states for held-out rows or
    training rows. Rows with inputs outside the trained range are ignored. For each of offset, gain, lag and loop, the
    table shows the error that remains after a correction of this quantity alone. The exit status is 1 if the device has
    drifted.

    \b
    Example: hystfmu check piezo.model.toml today.csv
    """
    import hystfmu as hy
    from hystfmu.report.terminal import table

    measured = columns.read(data)
    found = hy.Model.load(model).check(measured, factor)
    if as_json:
        echo(json.dumps(asdict(found)))
    else:
        say(measured.read_as)
        unit = f" ({measured.unit_y})" if measured.unit_y else ""
        rows = [[p.name, p.value, f"{p.left:.4g}"] for p in found.parts]
        say(table(["change of", "value", f"RMS left{unit}"], [["nothing", "", f"{found.rms:.4g}"], *rows]))
        say(f"{found.inside:.3g} % of the rows lie in the trained range and reach {found.reached:.3g} % of it")
        echo(str(found)) if found.drifted else say(str(found))
    sys.exit(FAILED if found.drifted else 0)
