"""Export of an FMU with a prebuilt binary, without a compiler. Equal models give bit-identical FMUs."""

import functools
import math
import re
from pathlib import Path
from typing import Literal

from hystfmu.base import PACKAGE, InputError, write_bytes
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
_MOST = 60  # maximum number of characters of a model identifier, because files have this name


@functools.cache
def _licence() -> bytes:
    path = PACKAGE / "LICENSE"
    if not path.exists():
        raise ImportError("the licence text is missing: install the package with 'pip install .'")
    return path.read_bytes()


def _identifier(text: str) -> str:
    """Return a name as a valid model identifier."""
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
    """Write an FMU for Co-Simulation and Model Exchange; return its path.

    Parameters
    ----------
    model : Model or Graph
        Content of the FMU. A model also supplies the description, the errors of the fit and the range of the data for
        the documentation. If the model contains sampled blocks, their sample time is the step of the model. The FMU
        then refuses communication steps that are not a multiple of this sample time.
    path : str or Path
        Path of the FMU, which ends in ``.fmu``. The file is written atomically.
    fmi : {2, 3}
        Version of the standard.
    name : str, optional
        Name of the model, which may be any text. By default, it consists of the name of the record and the kind of
        model, or it is the name of the only block. The model identifier consists of the first 60 characters of the
        name; the character _ replaces all characters except ASCII letters and digits.
    platforms : {"host", "all"}
        Whether the FMU contains the binary of this computer, or the binaries of all platforms.
    source : bool
        Whether the FMU also contains the source, one C file that needs the headers of the FMI standard and the C
        library.
    explorer : Explorer, optional
        Interactive part of the documentation page, which replaces the plot of the reference experiment.
    stop : float, optional
        End (s) of the default experiment; by default, 1000 steps.
    text : str, optional
        Description of the model. By default, it is a text about the model and its record, or about its only block.

    Returns
    -------
    Path
        Path of the FMU.

    Raises
    ------
    InputError
        The version, the path, the name or the stop time is invalid, FMI defines no folder for this platform, binaries
        of all platforms are requested but not installed, or the file cannot be written.
    """
    if fmi not in (2, 3):
        raise InputError(f"The FMI version must be 2 or 3. Got {fmi} instead.")
    if Path(path).suffix.lower() != ".fmu":  # FMI 2.0.4, section 2.3; importers refuse other endings
        raise InputError(f"{path}: The file of an FMU must end in .fmu. Got {Path(path).suffix!r} instead.")
    whole, graph = (model, model.graph) if isinstance(model, Model) else (None, model)
    single = graph.nodes[0] if len(graph.nodes) == 1 else None
    if name is None:
        name = name_of(whole) if whole else single.name if single else "graph"
    if not name.isprintable() or not name.strip():
        raise InputError(f"The FMU name must be printable text. Got {name!r} instead.")
    if stop is not None and not 0 < stop < math.inf:
        raise InputError(f"The stop time of the default experiment must be a float in (0, inf). Got {stop} instead.")
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
