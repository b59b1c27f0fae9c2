"""Commands for models and measured data: fit, predict, check and inverse."""

import functools
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from hystfmu.base import InputError, may_replace, refusal, together
from hystfmu.cli.options import FILE, Command, WrittenFile, WrittenFolder, json_option, of
from hystfmu.report.terminal import answer, answers_json, detail, echo, say, tell

if TYPE_CHECKING:
    import hystfmu as hy
    from hystfmu.face.interval import Part

_READ = "data.reader.reading:read"
RESAMPLE = (
    "Resample a record with uneven time steps to this sample rate. Without HZ, the rate is 1 / median step. A gap in "
    "the record is an error."
)


@dataclass(frozen=True)
class Columns:
    """Options for a data file, such as columns, sample rate and records, stored as arguments of `hystfmu.read`."""

    given: dict[str, Any]

    def words(self) -> list[str]:
        """Return the given options as arguments of a command line."""
        words = [
            w for k, v in self.given.items() if v and k not in ("resample", "covariates") for w in (f"--{k}", f"{v}")
        ]
        words += [] if self.given["resample"] is None else [f"--resample={self.given['resample']}"]
        return [*words, *(w for c in self.given.get("covariates", ()) for w in ("--covariate", c))]

    def read(self, path: str | Sequence[str], with_output: bool = True, covariates: Sequence[str] = ()) -> "hy.Dataset":
        """Read a data file, or several data files with one record each.

        Parameters
        ----------
        path : str or sequence of str
        with_output : bool
            Whether the file must have an output column. If False, the output is read only if the output column is
            unambiguous.
        covariates : sequence of str
            Covariate columns to read if the option ``--covariate`` is not given.

        Raises
        ------
        InputError
            The rate is not a number, or the file is invalid (see `hystfmu.read`).
        """
        import hystfmu as hy

        options, to = dict(self.given), self.given["resample"]
        options["covariates"] = options.get("covariates") or covariates
        try:
            options["resample"] = to if to in (None, "median") else float(to)
        except ValueError:
            raise InputError(
                f"--resample must be a rate in Hz, or empty for the median step. Got {to!r} instead."
            ) from None
        try:
            return hy.read(path, **options)
        except InputError:
            if with_output or options["output"]:
                raise
            return hy.read(path, **options | {"output": None})

    def read_for(self, model: "hy.Model", path: str, with_output: bool = True) -> "hy.Dataset":
        """Read a data file with the covariates of a model. The option ``--covariate`` may give them other headings."""
        from hystfmu.model import beside

        names = beside(model.graph)
        measured = self.read(path, with_output, names)
        return measured.with_names(names) if len(self.given["covariates"]) == len(names) else measured


def data_options(*without: str, refused: Sequence[str] = ()) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """Return a decorator that adds the options of a data file to a command. The command receives them as `columns`.

    Parameters
    ----------
    *without : str
        Arguments of `hystfmu.read` that do not become options.
    refused : sequence of str
        Arguments whose options end the command with an error. The help does not list these options.
    """
    every: dict[str, Any] = {"time": "COLUMN", "input": "COLUMN", "output": "COLUMN", "rate": "", "lag": "ROWS"}
    every |= {"record": "COLUMN", "covariates": "--covariate COLUMN", "decimal": ""}
    every |= {"resample": ("[HZ]", {"is_flag": False, "flag_value": "median", "help": RESAMPLE}), "train": "FIRST:END"}
    options = {name: spelled for name, spelled in every.items() if name not in without}
    options |= {name: (options[name], {"hidden": True}) for name in refused}

    def decorate(f: Callable[..., Any]) -> Callable[..., Any]:
        @functools.wraps(f)
        def command(**given: Any) -> Any:
            own = {name: given.pop(name) for name in options}
            return f(columns=Columns(own), **given)

        return of(_READ, **options)(command)

    return decorate


def _list_models(context: click.Context, option: click.Parameter, asked: bool) -> None:
    if not asked:
        return
    from hystfmu.base import MissingExtra
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
    help="List all kinds of model and their options, and exit.",
)
@of("face.fit:fit", key="--model KEY")
@of("", graph="G.graph.toml")
@of("face.fit:fit", purpose="--for")
@of("", out="-o M.model.toml")
@data_options()
@of("face.fit:fit", options="--set", seed="")
@of("", folder="--report DIR")
@json_option
def fit(
    data: tuple[str, ...],
    key: str,
    graph: str | None,
    out: WrittenFile | None,
    columns: Columns,
    options: dict[str, Any],
    folder: WrittenFolder | None,
    **how: Any,
) -> None:
    """Identify a model from measured data.

    DATA is a text file with columns. The file may be compressed with gzip. The extra 'files' adds
    further formats, such as xlsx and HDF5. The command detects encoding, separator, decimal sign, header lines and
    units of measure, and prints all assumptions in one line. If several files are given, each file is a separate
    record. The model starts from its initial state in each record.

    \b
    Example: hystfmu fit piezo.csv --model zhao_tan_mlp -o piezo.model.toml
             hystfmu fit stage.csv --time "Zeit [ms]" --input "Spannung [V]"
             hystfmu fit record.dat --rate 200 --input 1 --output 5
             hystfmu fit monday.csv tuesday.csv --model prandtl_ishlinskii
             hystfmu fit oven.csv --model actuator --covariate "T [degC]"
             hystfmu fit piezo.csv --graph my.graph.toml -o my.model.toml
             hystfmu fit --models
    \f

    Parameters
    ----------
    graph : str, optional
        Fit this graph of blocks instead of a kind of model. The table [free] of the file names the free parameters.
    out : str, optional
        Model file to write. The default is DATA.KIND.model.toml in the current folder.
    folder : str, optional
        Write an HTML page about the fit into this folder. Without -o, the command always writes this page, by
        default into the current folder.
    """
    import hystfmu as hy
    from hystfmu.face.interval import free_run, interval_text, known, parts, table_of, with_interval
    from hystfmu.face.page import evidence_lines, free_table
    from hystfmu.identify.catalogue import description
    from hystfmu.report.terminal import progress, table

    description(key)  # report a misspelt kind before a missing file
    if graph is not None:
        if key != "auto":
            raise InputError(f"--graph and --model exclude each other. Got {graph} and {key}.")
        key = "graph"
    measured = columns.read(data)
    say(measured.read_as)
    if out is not None or key != "auto":
        _refuse_other(out or f"{measured.stem}.{key}.model.toml", measured, key, how["seed"])
    with progress(f"fitting {key}") as report:
        kind: Any = Path(graph) if graph is not None else key
        model = hy.fit(measured, kind, progress=report, **how, **options)
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
    if answers_json():
        more = {"page": str(page)} if page else {}
        answer({"model": model.key, "file": out, **f, "errors": _told(found), **more})
    if key == "auto":
        p = model.provenance
        rated = [
            [k, f"{e:.4g}", _range(p["auto_blocks"][k]), p["auto_parameters"][k], p["auto_inverse"][k]]
            for k, e in p["auto"].items()
        ]
        first = [(n, "not tried") for n in p["auto_not_tried"]]
        for name, word in [*first, *((n, "discarded") for n in p["auto_left_out"] if n not in p["auto_not_tried"])]:
            say(f"{word}: {name}: {p['auto_left_out'][name]}")
        say(table(["candidate", "validation RMS %FS", "of single blocks", "parameters", "inverse"], rated))
        say(f"memory: {f['memory']} ({f['loops']} minor loops, gap {f['gap_percent']:.2g} % of the span of y)")
        say(f"rate dependence: {f['rate']}\n")
    if "lag" in f and not any("lags" in w for w in f.get("warnings", ())):
        say(f"lag: {f['lag']}; the model contains this lag")
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


def _told(found: "Sequence[Part]") -> list[dict[str, Any]]:
    """Return the errors on parts of the rows, with the keys of the JSON output."""
    return [{"part": p.name, "rows": [p.rows.start, p.rows.stop], **p.errors} for p in found]


def _refuse_other(path: str, data: "hy.Dataset", key: str, seed: int) -> None:
    """Raise an error if the model file exists and contains a model of other data or of another kind."""
    from hystfmu.base import load_toml

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
    """Return the smallest and the largest error of the validation blocks as text, or "" for a single block."""
    return f"{min(errors):.3g} to {max(errors):.3g}" if len(errors) > 1 else ""


@click.command(cls=Command)
@click.argument("model", type=FILE)
@click.argument("data", type=FILE)
@of("", out=("-o OUT.csv", {"required": True}))
@data_options("train")
@json_option
def predict(model: str, data: str, out: WrittenFile, columns: Columns) -> None:
    """Simulate a model on the input column of a file.

    The simulation does not use measured outputs. If the file contains a measured output, the command prints the error
    of the simulated output. Row 0 of the result is the output after initialisation with the first input. Each later row
    k is the output that an FMU of the model has if the input is set to u_k and doStep(t_{k-1}, h) is called. If the
    model contains a network, the network clips inputs that lie outside its training range. The command prints a warning
    if this concerns more than 1 % of the rows. The names of the covariate columns are stored in the model. If the
    columns in the file have other names, state these names with --covariate, in the order of the model.

    \b
    Example: hystfmu predict piezo.model.toml piezo.csv -o predicted.csv
    \f

    Parameters
    ----------
    out : str
        CSV file to write. Its columns are t, u, y and the covariates, and the record number of several records.
    """
    import hystfmu as hy
    from hystfmu.face.interval import free_run, parts, table_of
    from hystfmu.model import rows_of
    from hystfmu.model.coverage import WARN, clamped
    from hystfmu.report.terminal import table

    m = hy.Model.load(model)
    measured = columns.read_for(m, data, with_output=False)
    y = free_run(m, measured)
    measured.with_output(y).to_csv(out)
    outside = measured.along(lambda rows: clamped(m.graph, rows, measured.h), inputs=rows_of(m.graph, measured))
    share = 100 * float(outside.mean())
    if share > WARN:
        echo(
            f"warning: {measured.place(int(outside.argmax()))} and {share:.3g} % of all rows lie outside the training "
            f"range of {model}; the model clips these inputs",
            err=True,
        )
    found = parts(y, measured, False) if measured.has_output else []
    say(measured.read_as)
    if found:
        shown = table_of(found, measured.unit_y)
        say(table(shown.head, shown.rows))
    say(f"wrote {out}: {len(y)} rows")
    told = {"errors": _told(found)} if found else {}
    answer({"file": out, "rows": len(y), "clamped_percent": share, **told})


@click.command(cls=Command)
@click.argument("model", type=FILE)
@click.argument("data", type=FILE)
@data_options("train")
@of("face.model:Model.check", factor="")
@json_option
def check(model: str, data: str, columns: Columns, factor: float) -> None:
    """Test with a new record whether a device has drifted.

    The command simulates the model with the input in DATA, without the measured output. It compares the error of the
    model on DATA with the error stated in MODEL. The stated error is the error on held-out rows, or the error on
    training rows if the fit had no held-out rows. Rows with inputs outside the training range are ignored. The table
    has one line each for offset, gain, lag and loop shape. Each line states the error that remains if only this
    property is corrected. The exit status is 1 if the device has drifted. The covariate columns are found as in
    'hystfmu predict'.

    \b
    Example: hystfmu check piezo.model.toml today.csv
    """
    import hystfmu as hy
    from hystfmu.report.terminal import table

    m = hy.Model.load(model)
    measured = columns.read_for(m, data)
    found = m.check(measured, factor)
    say(measured.read_as)
    unit = f" ({measured.unit_y})" if measured.unit_y else ""
    rows = [[p.name, p.value, f"{p.left:.4g}"] for p in found.parts]
    say(table(["corrected property", "value", f"remaining RMS{unit}"], [["none", "", f"{found.rms:.4g}"], *rows]))
    say(f"{found.inside:.3g} % of the rows are in the training range; they cover {found.reached:.3g} % of this range")
    echo(str(found)) if found.drifted else say(str(found))
    answer(asdict(found), not found.drifted)


@click.command(cls=Command)
@click.argument("model", type=FILE)
@of("", out=("-o INV.model.toml", {"required": True}))
@of("face.model:Model.inverse", method="", options="--set", seed="")
def inverse(model: str, out: WrittenFile, options: dict[str, Any], **how: Any) -> None:
    """Compute the inverse of a model.

    The input of the inverse is the wanted output of the model. The output of the inverse is the input with which the
    model produces this wanted output.

    The learned inverse is trained with the response of the model to random nested reversals. For the training, input
    and output are exchanged. The wanted output drives the inverse operator of Zhao & Tan and a few play operators. The
    outputs of these operators are the inputs of a network with 12 neurons. The network corrects the wanted output. An
    exact inverse of fitted plays then computes the input from the corrected output. The learned inverse has the options
    'hidden' (number of neurons), 'N' (number of plays), 'starts' and 'iterations', among others.

    If the model has linear dynamics or a delay behind the hysteresis, the inverse also contains a feed-forward filter
    of a few samples of the wanted output. The output of the model then lags the wanted output by some steps. The
    command prints this lag.

    The adaptive inverse exists for Prandtl-Ishlinskii models. Its input v is the wanted output of the hysteresis,
    before dynamics and delay. In a loop, v is the sum of feed-forward and feedback. The other inputs are the reference
    y_d and the measured output y. If the model is static, the options f_n (Hz) and zeta state the natural frequency and
    the damping ratio of the dynamics that follow the hysteresis of the device. The option delay is the number of
    further steps of delay in the loop. The option T is the time constant of a drift in seconds. 'hystfmu blocks
    adaptive_inverse' lists further options.

    \b
    Example: hystfmu inverse piezo.model.toml -o inverse.model.toml
             hystfmu inverse piezo.model.toml --method learned -o learned.toml
             hystfmu inverse piezo.model.toml --method adaptive -o adaptive.toml
    \f

    Parameters
    ----------
    out : str
        Model file to write.
    """
    import hystfmu as hy
    from hystfmu.report.terminal import progress

    with progress("inverting") as report:
        made = hy.Model.load(model).inverse(progress=report, **how, **options)
    made.save(out)
    rms, most = (made.fit.get(f"cascade_{k}_percent") for k in ("rms", "max"))
    worth = "" if rms is None else f": error of inverse and model in cascade: RMS {rms:.2g} %, max {most:.2g} % of span"
    say(f"wrote {out}, {made.provenance['inverse']} inverse{worth}")
    if len(made.graph.outputs) > 1:
        inputs, outputs = (", ".join(p.name for p in ports) for ports in (made.graph.inputs, made.graph.outputs))
        say(f"inputs {inputs}; outputs {outputs}")
    if late := made.fit.get("lag_steps"):
        say(
            f"the output of the model lags the wanted output by {late} steps ({made.fit['lag']:.3g} s), for "
            f"frequencies up to {made.fit['band']:.3g} Hz; a reference that leads by {late} steps compensates this lag"
        )
    for warning in made.fit.get("warnings", ()):
        echo(f"warning: {warning}", err=True)
