"""Write an FMU from a prebuilt binary, without a compiler.  Equal models give equal bytes."""

from __future__ import annotations

import functools
import re
from pathlib import Path
from typing import Literal

from hystfmu.base import PACKAGE
from hystfmu.base.errors import InputError
from hystfmu.base.files import write_bytes
from hystfmu.fmu.archive import Deflated, zip_file
from hystfmu.fmu.write.description import Fmi, description_of, facts_of, model_description, name_of
from hystfmu.fmu.write.documentation import documentation
from hystfmu.fmu.write.platforms import binaries
from hystfmu.fmu.write.reference import Reference, png, svg, terminals_and_icons
from hystfmu.fmu.write.sources import build_description, source_file
from hystfmu.graph import Graph
from hystfmu.model import Model
from hystfmu.report.explorer import Explorer

_IDENTIFIER = re.compile(r"[A-Za-z_][A-Za-z0-9_]*\Z")
_MOST = 60  # characters of an identifier, which is the name of files


@functools.cache
def _licence() -> bytes:
    path = PACKAGE / "LICENSE"
    if not path.exists():
        raise ImportError("the licence text is missing: install the package with 'pip install .'")
    return path.read_bytes()


def _identifier(text: str) -> str:
    """Turn a name into a model identifier."""
    cleaned = re.sub(r"[^A-Za-z0-9_]", "_", text)[:_MOST]
    return cleaned if _IDENTIFIER.match(cleaned) else f"_{cleaned}"


def export_fmu(
    model: Model | Graph,
    path: str | Path,
    fmi: Fmi = 2,
    name: str | None = None,
    platforms: Literal["host", "all"] = "host",
    source: bool = False,
    explorer: Explorer | None = None,
    stop: float | None = None,
    text: str | None = None,
) -> Path:
    """Write an FMU for Co-Simulation and Model Exchange.

    Parameters
    ----------
    model : Model or Graph
        Content of the FMU. A model also gives the description, and fit and data range for the documentation. If the
        model has sampled blocks, its step is their sample time. The FMU then refuses communication steps that are not a
        multiple of the sample time.
    path : str or Path
        FMU to write, usually ``*.fmu``; written atomically.
    fmi : {2, 3}
        Version of the standard.
    name : str, optional
        Model name, any text; by default the record and the key of the model, or the name of its only block. The model
        identifier is the first 60 characters of the name, with _ for every character that is neither an ASCII letter
        nor a digit.
    platforms : {"host", "all"}
        Pack the binary of this machine, or the binaries of all platforms.
    source : bool
        Also pack the source: one C file, which needs the headers of the FMI standard and the C library.
    explorer : Explorer, optional
        The model in the page of the documentation, instead of the picture of the reference experiment.
    stop : float, optional
        End (s) of the default experiment; by default 1000 steps.
    text : str, optional
        Description; by default a text from the model and its record, or from its only block.

    Returns
    -------
    Path
        Path of the FMU.

    Raises
    ------
    InputError
        The version or the name is invalid, FMI defines no folder for this platform, a binary for all platforms is
        requested but not installed, or the file cannot be written.
    """
    if fmi not in (2, 3):
        raise InputError(f"The FMI version must be 2 or 3. Got {fmi} instead.")
    whole, graph = (model, model.graph) if isinstance(model, Model) else (None, model)
    single = graph.nodes[0] if len(graph.nodes) == 1 else None
    if name is None:
        name = name_of(whole) if whole else single.name if single else "graph"
    if not name.isprintable() or not name.strip():
        raise InputError(f"The FMU name must be printable text. Got {name!r} instead.")
    if text is None:
        text = description_of(whole) if whole else single.block.text if single else ""
    identifier = _identifier(name)
    packed = binaries(fmi, identifier, platforms)
    reference = Reference.of(graph, whole)
    files = [f"{identifier}.c"] if source else []
    known = facts_of(whole, reference.y) if whole else {}
    described = model_description(graph, fmi, name, identifier, text, stop, files, known)
    entries: dict[str, bytes | Deflated] = {"modelDescription.xml": described}
    entries |= {f"binaries/{folder}": content for folder, content in packed.items()}
    entries["resources/block.bin"] = graph.to_bytes()
    if fmi == 2:
        entries["model.png"] = png(reference.curve)
    else:
        entries["terminalsAndIcons/terminalsAndIcons.xml"] = terminals_and_icons(graph)
        entries["terminalsAndIcons/icon.png"] = png(reference.curve)
        entries["terminalsAndIcons/icon.svg"] = svg(reference.curve)
    if source:
        entries[f"sources/{identifier}.c"] = source_file(graph, fmi, identifier)
        if fmi == 3:
            entries["sources/buildDescription.xml"] = build_description(identifier)
    entries["documentation/index.html"] = documentation(graph, fmi, name, text, reference, whole, source, explorer)
    entries["documentation/licenses/license.txt"] = _licence()
    entries |= reference.files(fmi)
    write_bytes(path, zip_file(entries, executable="binaries/"))
    return Path(path)
