"""Writes an FMU: description, prebuilt binary, block file, zipped.  No compiler, the same bytes every time."""

from __future__ import annotations

import functools
import io
import platform
import re
import sys
import zipfile
from pathlib import Path

from hystfmu.errors import InputError
from hystfmu.files import write_bytes
from hystfmu.fmu.description import Fmi, model_description
from hystfmu.graph import Graph
from hystfmu.model import Model

_IDENTIFIER = re.compile(r"[A-Za-z_][A-Za-z0-9_]*\Z")

# (system, machine): folder in FMI 2.0, folder in FMI 3.0, suffix of the binary in the FMU
_PLATFORMS = {
    ("linux", "x86_64"): ("linux64", "x86_64-linux", "so"),
    ("linux", "aarch64"): ("aarch64-linux", "aarch64-linux", "so"),
    ("darwin", "x86_64"): ("darwin64", "x86_64-darwin", "dylib"),
    ("darwin", "arm64"): ("darwin64", "aarch64-darwin", "dylib"),
    ("win32", "AMD64"): ("win64", "x86_64-windows", "dll"),
}


@functools.cache
def _binary() -> bytes:
    """The prebuilt binary of the host: the same one in every FMU."""
    for suffix in ("so", "dylib", "dll"):
        path = Path(__file__).parent.with_name(f"_fmu.{suffix}")
        if path.exists():
            return path.read_bytes()
    raise ImportError("the compiled FMU binary is missing: install the package with 'pip install .'")


def _identifier(text: str) -> str:
    """A model identifier out of a name."""
    cleaned = re.sub(r"[^A-Za-z0-9_]", "_", text)
    return cleaned if _IDENTIFIER.match(cleaned) else f"_{cleaned}"


def _add(archive: zipfile.ZipFile, name: str, content: bytes, mode: int = 0o644) -> None:
    entry = zipfile.ZipInfo(name, (1980, 1, 1, 0, 0, 0))  # no clock: the same model gives the same file
    entry.create_system = 3
    entry.external_attr = mode << 16
    entry.compress_type = zipfile.ZIP_DEFLATED
    archive.writestr(entry, content)


def export_fmu(model: Model | Graph, path: str | Path, fmi: Fmi = 2, name: str | None = None) -> Path:
    """Write an FMU for Co-Simulation.

    Parameters
    ----------
    model : Model or Graph
        What runs in it; a model also gives the step of the default experiment and the description.
    path : str or Path
        The file, usually ``*.fmu``; written as a whole or not at all.
    fmi : {2, 3}
        Version of the standard.
    name : str, optional
        Model name and identifier; by default the key of the model or the name of its only block.

    Returns
    -------
    Path
        The file.

    Raises
    ------
    InputError
        If the version, the name or the platform will not do, or the file cannot be written.
    """
    if fmi not in (2, 3):
        raise InputError(f"the FMI version must be 2 or 3; got {fmi}")
    graph = model.graph if isinstance(model, Model) else model
    if name is None:
        key = model.key if isinstance(model, Model) else graph.nodes[0].name if len(graph.nodes) == 1 else "graph"
        name = _identifier(key)
    if not _IDENTIFIER.match(name):
        raise InputError(f"the FMU name {name!r} must be a letter or _ followed by letters, digits or _")
    host = (sys.platform, platform.machine())
    if host not in _PLATFORMS:
        raise InputError(f"no FMU folder is defined for the platform {host[0]} {host[1]}")
    folders, suffix = _PLATFORMS[host][:2], _PLATFORMS[host][2]
    step = model.step if isinstance(model, Model) else None
    text = model.text if isinstance(model, Model) else graph.nodes[0].block.text if len(graph.nodes) == 1 else ""
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", compresslevel=6) as archive:
        _add(archive, "modelDescription.xml", model_description(graph, fmi, name, text, step))
        _add(archive, f"binaries/{folders[fmi - 2]}/{name}.{suffix}", _binary(), 0o755)
        _add(archive, "resources/block.bin", graph.to_bytes())
    write_bytes(path, buffer.getvalue())
    return Path(path)
