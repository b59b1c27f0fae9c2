"""Package of an identified model on disk, with record, blocks, example and networks. A failed write changes no file."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Mapping
from pathlib import Path

from hystfmu.base import __version__
from hystfmu.base.errors import InputError
from hystfmu.base.files import may_replace, own, read_bytes, refusal
from hystfmu.fmu.write.documentation import history
from hystfmu.model import Model
from hystfmu.modelica import classes, implicit
from hystfmu.modelica.actuator import ACTUATOR, actuator_files
from hystfmu.modelica.block import block, rated_ports, wiring
from hystfmu.modelica.classes import library_date, network_classes, network_names
from hystfmu.modelica.example import example
from hystfmu.modelica.literals import NAME, RESERVED, class_name, sentence, string, unique
from hystfmu.modelica.ports import ports_block
from hystfmu.modelica.realisation import CONTINUOUS, kinds, missing
from hystfmu.modelica.record import is_ours, mark, record

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
    content = {f"{c}.mo": t if is_ours(t) else f"{first}\n{t}" for c, t in files.items()}
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
    from hystfmu.base.printable import escape

    listed = "".join(f"<li>{k}: {escape(v)}</li>" for k, v in _realisations(model).items())
    info = (
        f"<html><p>A model of kind <em>{escape(model.key)}</em>: {escape(model.text)}.</p>"
        f"<p>The record Values holds its numbers, the block Model runs them, Example shows it.</p><ul>{listed}</ul>"
        f"<p>It needs the library HystFMU {__version__} on the library path.</p>{told}"
        f"<p><b>Source:</b> {escape(source)}, written by HystFMU {__version__}.</p></html>"
    )
    return f"""package {name} {sentence(model.text or model.key)}
  extends HystFMU.Icons.Package;
  annotation (
    version = "1.0.0",
    versionDate = "{library_date()}",
    preferredView = "info",
    uses(HystFMU(version = "{__version__}")),
    Documentation(info = {string(info)}));
end {name};
"""


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
        raise InputError(f"{target}: exists and is not a folder that an export wrote; move it away or use --name")
    for file in sorted(target.iterdir()):
        written = file.name == "package.order" or (
            file.suffix == ".mo" and file.is_file() and is_ours(read_bytes(file).decode("utf-8", "replace"))
        )
        if not written:
            raise InputError(f"{file}: not written by an export, and the folder would be replaced; move it away")
