"""Write a scenario built in Python as a folder with scenario.toml and the files of its units."""

from __future__ import annotations

import copy
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from hystfmu.base.files import read_bytes, write_bytes, write_toml
from hystfmu.face.parts import files
from hystfmu.model import Model
from hystfmu.scenario.system.spec import FORMAT, ScenarioSpec


def save(spec: Mapping[str, Any], attached: Mapping[str, Model | Path], folder: Path) -> Path:
    """Write a complete scenario.

    Parameters
    ----------
    spec : mapping
        Complete content of the file.
    attached : mapping of str to Model or Path
        Models or files of the units, by their paths in the scenario.
    folder : Path

    Returns
    -------
    Path
        The folder.

    Raises
    ------
    InputError
        A file cannot be read or written.
    """
    content = copy.deepcopy(dict(spec))
    names: dict[str, str] = {}
    for unit, key in files(content):
        path = unit[key]
        if path not in names:
            names[path] = _unique(Path(path).name, set(names.values()))
        unit[key] = names[path]
    for path, name in names.items():
        what = attached[path]
        if isinstance(what, Model):
            what.save(folder / name)
        else:
            write_bytes(folder / name, read_bytes(what))
    ordered = {"format": FORMAT, **{k: content[k] for k in ScenarioSpec.model_fields if k in content}}
    write_toml(folder / "scenario.toml", ordered)
    return folder


def _unique(name: str, taken: set[str]) -> str:
    """Return the name; if it is taken, insert a number before the suffixes."""
    stem, dot, suffix = name.partition(".")
    k, free = 1, name
    while free in taken:
        k += 1
        free = f"{stem}_{k}{dot}{suffix}"
    return free
