"""Package of an identified model on disk, with record, blocks, example and networks. A failed write changes no file."""

import os
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path

from hystfmu.base import InputError, __version__, escape, may_replace, own, read_bytes, refusal
from hystfmu.fmu.write.documentation import history
from hystfmu.model import Model
from hystfmu.modelica import classes, implicit
from hystfmu.modelica.actuator import ACTUATOR, actuator_files
from hystfmu.modelica.block import block, rated_ports, wiring
from hystfmu.modelica.classes import library_date, network_classes, network_names
from hystfmu.modelica.layout import line, placed
from hystfmu.modelica.literals import NAME, RESERVED, class_name, class_text, information, link, number, string, unique
from hystfmu.modelica.measures import per_second, si, to_si
from hystfmu.modelica.ports import ports_block, rate_name
from hystfmu.modelica.realisation import CONTINUOUS, kinds, missing
from hystfmu.modelica.record import is_ours, mark, record, span, step
from hystfmu.modelica.wiring import Wiring

CLASSES = ("Values", "Ports", "Model", *CONTINUOUS, "Example")  # classes of every package
HIDDEN = {*CLASSES, *ACTUATOR, "HystFMU", "Modelica"}  # a package must not hide a class that it uses


def package_name(text: str) -> str:
    """Return a package name from any text. The name does not hide a class that the package uses."""
    name = class_name(text)
    return unique([name], HIDDEN)[name]


def export_modelica(
    model: Model,
    folder: str | Path,
    name: str,
    source: str = "a model in memory",
    sheet: Mapping[str, float] | None = None,
) -> Path:
    """Write the package ``folder/name`` with the record ``Values``, the block ``Model`` and the model ``Example``.

    If the model maps a voltage or a current to a length, and the library has a class for its hysteresis, the package
    also contains ``Actuator``, a component with pins and flanges, and ``ActuatorExample``.

    Parameters
    ----------
    model : Model
    folder : str or Path
        Folder of the library path. It is created if it does not exist.
    name : str
        Name of the package; `package_name` makes a valid name from any text.
    source : str
        Origin of the model, for the documentation of the package.
    sheet : mapping of (str, float), optional
        Data sheet of the actuator, see `hystfmu.modelica.actuator.mechanics.Sheet`.

    Returns
    -------
    Path
        The folder of the package.

    Raises
    ------
    InputError
        The name is not valid in Modelica, the library has no class for a block, or the graph has a loop.
        ``folder/name`` contains files that no export wrote, or cannot be written. A data sheet is given for a model
        that cannot be exported as an actuator.
    """
    if not NAME.match(name) or name in RESERVED:
        raise InputError(f"the Modelica package name {name!r} must be a letter followed by letters, digits or _")
    if not name[0].isupper() or name in HIDDEN:
        raise InputError(f"the Modelica package name {name!r} must begin with a capital and hide no class that it uses")
    told, graph = history(model), model.graph
    w, rated = wiring(graph, set(CLASSES)), rated_ports(graph)
    files = {
        "Values": record(model, "Values", name, source, told),
        "Ports": ports_block(w, name, model.text or model.key, "Values", rated, _realisations(model)),
        "Model": block(model, "Model", name, w, told),
        **{kind: block(model, kind, name, w, told, kind) for kind in kinds(graph)},
        "Example": example(model, "Example", name, "Model", w, rated),
    }
    files |= actuator_files(model, name, told, sheet)
    networks = [n for n in model.graph.nodes if classes.is_large(n)]
    inverses = implicit.inverses(model.graph)
    made = [*files, *(c for n in networks for c in network_names(n)), *(implicit.package_of(n) for n in inverses)]
    if len(set(made)) < len(made):
        raise InputError(f"two blocks would have the Modelica class {max(made, key=made.count)!r}; rename one")
    hidden = implicit.hidden(model.graph)
    for node in networks:
        function, own_block = network_names(node)
        written = network_classes(node, name)
        files[function] = written[function]
        if node.name not in hidden:
            files[own_block] = written[own_block]
    for node in inverses:
        files[implicit.package_of(node)] = implicit.tried(model.graph, node, name).text
    files["package"] = _package(model, name, source, told)
    listed = "".join(f"{c}\n" for c in files if c != "package")
    first = mark(source)
    content = {f"{c}.mo": f"{first}\n{t}" for c, t in files.items()}
    return _write(Path(folder), name, {**content, "package.order": listed})


def _realisations(model: Model) -> dict[str, str]:
    """Return the blocks of the package with descriptions, and the missing realisations with reasons."""
    graph = model.graph
    sampled = any(classes.is_sampled(n) for n in graph.nodes)
    found = {
        "Model": "steps at the start and then every Ts, with the results of hystfmu predict"
        if sampled
        else "gives the results of hystfmu predict"
    }
    for kind, text in CONTINUOUS.items() if sampled else ():
        why = missing(graph, kind)
        found[kind] = f"none, because {why}" if why else text
    return found


def _package(model: Model, name: str, source: str, told: str) -> str:
    listed = "".join(f"<li>{k}: {escape(v)}</li>" for k, v in _realisations(model).items())
    info = (
        f"<html><p>A model of kind <em>{escape(model.key)}</em>: {escape(model.text)}.</p>"
        f"<p>The record Values holds its numbers, the block Model runs them, Example shows it.</p><ul>{listed}</ul>"
        f"<p>It needs the library HystFMU {__version__} on the library path.</p>{told}"
        f"<p><b>Source:</b> {escape(source)}, written by HystFMU {__version__}.</p></html>"
    )
    dated = f'version = "1.0.0",\n    versionDate = "{library_date()}"'
    before = f'\n    {dated},\n    preferredView = "info",\n    uses(HystFMU(version = "{__version__}")),\n    '
    extended = ["  extends HystFMU.Icons.Package;"]
    return class_text(f"package {name}", model.text or model.key, extended, string(info), before=before)


def _write(folder: Path, name: str, files: dict[str, str]) -> Path:
    """Write the files to a new folder next to the old folder, then exchange the two folders by renaming."""
    target = folder / name
    try:
        _refuse_foreign(target)
        if not may_replace(target):
            if {file.name: read_bytes(file) for file in target.iterdir()} != {f: t.encode() for f, t in files.items()}:
                raise refusal(target)
            return target
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(prefix=f".{name}.", dir=folder) as temporary:
            new, old = Path(temporary) / "new", Path(temporary) / "old"
            new.mkdir()
            for file, text in files.items():
                (new / file).write_text(text, "utf-8", newline="\n")
            if target.exists():
                os.rename(target, old)
            try:
                os.rename(new, target)
            except OSError:
                if old.exists():
                    os.rename(old, target)
                raise
    except OSError as e:
        raise InputError(f"{target}: cannot be written: {e.strerror or e}") from None
    own(target)
    return target


def _refuse_foreign(target: Path) -> None:
    """Raise an error if the folder to replace contains a file that no export wrote."""
    if not target.exists() and not target.is_symlink():
        return
    if target.is_symlink() or not target.is_dir():
        raise InputError(f"{target}: exists, but no export wrote this folder; move it or use --name")
    for file in sorted(target.iterdir()):
        written = file.name == "package.order" or (
            file.suffix == ".mo" and file.is_file() and is_ours(read_bytes(file).decode("utf-8", "replace"))
        )
        if not written:
            raise InputError(f"{file}: an export replaces the folder, but did not write this file; move the file")


PERIODS, ROWS = 4, 100  # periods of the sine, and rows of one period


def example(model: Model, name: str, within: str, block_name: str, w: Wiring, rated: Sequence[str]) -> str:
    """Return the text of the Modelica file of the example, without its first line (the mark of an exported file).

    Parameters
    ----------
    model : Model
    name, within, block_name : str
        Names of the example, of its package, and of the block in this package.
    w : Wiring
        Wiring of the graph of the model.
    rated : sequence of str
        Names of the inputs of the graph whose rates other realisations need.
    """
    h = step(model)
    driven, held = _inputs(model, w)
    low, high = (_at_port(model, driven, x) for x in span(model) or (-1.0, 1.0))
    frequency = 1 / (ROWS * h)
    signal = ", ".join(
        f"{k} = {number(v)}"
        for k, v in {
            "amplitude": (high - low) / 2,
            "offset": (high + low) / 2,
            "frequency": frequency,
            "decay": frequency / 2,
        }.items()
    )
    lines = ["  extends HystFMU.Icons.Example;"]
    if model.graph.inputs:
        lines.append(f"  HystFMU.Sources.DecayingSine signal({signal}) annotation ({placed(-50, 0)});")
    if rated:
        lines.append(
            f'  replaceable {block_name} tested constrainedby Ports "Any realisation by redeclare" '
            f"annotation (choicesAllMatching = true, {placed(10, 0)});"
        )
    else:
        lines.append(f"  {block_name} tested annotation ({placed(10, 0)});")
    declared, stated = _rates(model, w, rated)
    lines += [*declared, "equation", *stated]
    drawn = line((-39, 0), (-1, 0))  # from the right edge of the source to the left one of the block
    lines += [f"  connect(signal.r, tested.{end}) {drawn};" for end in driven]
    lines += [f"  tested.{end} = {number(value)};" for end, value in held.items()]
    time = f"StopTime = {number((PERIODS * ROWS + 0.5) * h)}, Interval = {number(h)}, Tolerance = 1e-10"
    told = "The loops become smaller, so that the memory of the identified hysteresis is visible."
    info = information(told, f"<b>See also:</b> {link(f'{within}.{block_name}', block_name)}.")
    text = "The model on a decaying sine over the range of its data"
    return class_text(f"model {name}", text, lines, info, within, f"experiment({time}), ")


def _inputs(model: Model, w: Wiring) -> tuple[list[str], dict[str, float]]:
    """Return the names of the inputs that the signal drives, and the covariates with their start values."""
    graph = model.graph
    sizes = {p.name: p.size for p in graph.ports if p.kind == "input"}
    driven: list[str] = []
    held: dict[str, float] = {}
    for i in graph.inputs:
        n, port = sizes[i.name], w.ports[i.name]
        if i.name in model.provenance.get("span_covariates", {}):
            held[port] = to_si(i.start, i.unit)
        else:
            driven += [port] if n == 1 else [f"{port}[{k + 1}]" for k in range(n)]
    return driven, held


def _at_port(model: Model, driven: list[str], value: float) -> float:
    """Convert a value from the unit of measure of the data to the unit of the ports."""
    return to_si(value, model.graph.inputs[0].unit) if driven else value


def _rates(model: Model, w: Wiring, rated: Sequence[str]) -> tuple[list[str], list[str]]:
    """Return declarations and equations that connect the time derivative of the signal to the inputs `rated`."""
    declared: list[str] = []
    stated: list[str] = []
    for k, port in enumerate(rated):
        unit = si(next(p.unit for p in model.graph.inputs if p.name == port))[0]
        to = f"tested.{rate_name(w.ports[port])}"
        if port in model.provenance.get("span_covariates", {}):
            stated.append(f"  {to} = 0;")
            continue
        if not unit:
            stated.append(f"  connect(signal.dr_lead, {to}) {line((-39, -4), (-1, -9))};")
            continue
        one, rate = (f"{n}{k + 1}" if k else n for n in ("one", "rate"))
        declared += [
            f'  constant Real {one}(unit = "{unit}") = 1 "Unit of measure of the signal";',
            f'  HystFMU.Interfaces.RealOutput {rate}(unit = "{per_second(unit)}") "Rate of the signal" '
            f"annotation ({placed(-20, -40 - 30 * k)});",
        ]
        drawn = line((-20, -40 - 30 * k), (-1, -9))
        stated += [f"  {rate} = {one}*signal.dr_lead;", f"  connect({rate}, {to}) {drawn};"]
    return ["protected", *declared] if declared else [], stated
