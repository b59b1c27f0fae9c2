"""Finished steps of a long command: a repeated call resumes after an interrupt.

A hash of its inputs, its options and this package identifies a step. Hashes of their content identify the files of a
step. The record of finished steps is a file in the output folder of the command. If a hash differs or the record is
damaged, the step runs again.
"""

from __future__ import annotations

import hashlib
import json
import os
import threading
from collections.abc import Callable, Sequence
from functools import cache
from pathlib import Path
from typing import Any

from hystfmu.base import PACKAGE
from hystfmu.base.errors import InputError
from hystfmu.base.files import may_replace, own, read_bytes, refuse_existing, write_text

RECORD = "steps.json"
_FOLDER = "folder"  # in the record, beside the steps


class Steps:
    """The finished steps in a folder that need not exist yet; `kept` names those whose earlier results were used."""

    def __init__(self, folder: Path) -> None:
        self._folder, self._known = folder, _read(folder / RECORD)
        self._lock = threading.Lock()
        self.kept: list[str] = []

    def claim(self, *of: Any, removed: Sequence[Path] = ()) -> None:
        """Reserve the folder for results of these inputs, values of JSON.

        The command may then replace its earlier results of the same inputs. The files and folders `removed` are removed
        before the command writes them again.

        Raises
        ------
        InputError
            In a command without --force, the folder contains results of other inputs, a file of the folder was
            changed, or a file that the command did not write would be removed.
        """
        record, known = self._folder / RECORD, self._known.get(_FOLDER)
        key = hashlib.sha256(json.dumps(of).encode()).hexdigest()
        mine = isinstance(known, dict) and known.get("of") == key
        if not mine and not may_replace(record):
            raise InputError(
                f"{self._folder}: holds what was made of another record or by other options. Name another folder, or "
                "replace it with --force."
            )
        made = known.get("made") if mine and isinstance(known, dict) else {}
        if isinstance(made, dict):
            own(record, *(f for f, at in ((self._folder / n, v) for n, v in made.items()) if _hashes([f]) == [at]))
            refuse_existing(*(self._folder / n for n in made), *_files(removed))
        else:  # interrupted: it did not come to `made`
            own(self._folder)
        self._known[_FOLDER] = {"of": key}
        if record.exists():  # else the first step writes it: a command that ends before has made nothing
            write_text(record, json.dumps(self._known, indent=1))

    def made(self, paths: Sequence[Path]) -> None:
        """Record that these files, and all files in these folders, are results of the inputs of `claim`."""
        names = [file.relative_to(self._folder).as_posix() for file in _files(paths)]
        self._known[_FOLDER]["made"] = dict(zip(names, _hashes(_files(paths)), strict=True))
        write_text(self._folder / RECORD, json.dumps(self._known, indent=1))

    def run(self, name: str, inputs: Sequence[Any], files: Sequence[Path], make: Callable[[], Any]) -> Any:
        """Return the value of a step; run the step unless it is finished and its files are unchanged.

        Its name is unique in the folder. `inputs` are all its inputs, as values of JSON; it writes the `files`. `make`
        runs it, and JSON must reproduce its value exactly. Steps may run in several threads.
        """
        key = hashlib.sha256(json.dumps([_package(), name, list(inputs)]).encode()).hexdigest()
        known = self._known.get(name)
        if isinstance(known, dict) and known.get("key") == key and known.get("files") == _hashes(files):
            self.kept.append(name)
            return known.get("value")
        value = make()
        with self._lock:
            self._known[name] = {"key": key, "files": _hashes(files), "value": value}
            write_text(self._folder / RECORD, json.dumps(self._known, indent=1))
        return value


def _read(path: Path) -> dict[str, Any]:
    try:
        found = json.loads(read_bytes(path))
    except (InputError, ValueError, RecursionError):
        return {}
    return found if isinstance(found, dict) else {}


def _files(paths: Sequence[Path]) -> list[Path]:
    """Return the files among the paths, and all files in the folders among the paths."""
    inside = (sorted(p.rglob("*")) if p.is_dir() else [p] for p in paths)
    return [file for files in inside for file in files if file.is_file()]


def _hashes(files: Sequence[Path]) -> list[str]:
    return [hashlib.sha256(p.read_bytes()).hexdigest() if p.is_file() else "" for p in files]


@cache
def _package() -> str:
    """Return a hash of names, sizes and times of the files of the package.

    The version alone is not sufficient, because files may be edited.
    """
    found = hashlib.sha256()
    for at, folders, names in os.walk(PACKAGE):
        folders[:] = sorted(f for f in folders if f != "__pycache__")
        for name in sorted(names):
            state = os.stat(os.path.join(at, name))
            found.update(f"{at}/{name} {state.st_size} {state.st_mtime_ns}\n".encode())
    return found.hexdigest()
