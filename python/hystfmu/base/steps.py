"""Log of the finished steps of a long command, so that a repeated command resumes after an interruption.

A step is identified by a hash of its inputs, its options and the files of this package. The output files of a step are
identified by hashes of their content. The log is a file in the output folder of the command. If a hash differs, or if
the log is damaged, the step runs again.
"""

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
_FOLDER = "folder"  # key of the log for the whole folder, in addition to one key per step


class Steps:
    """The finished steps of a command, with their results in a folder that need not exist yet.

    `kept` contains the names of the steps that did not run again because their earlier results are valid.
    """

    def __init__(self, folder: Path) -> None:
        self._folder, self._known = folder, _read(folder / RECORD)
        self._lock = threading.Lock()
        self.kept: list[str] = []

    def claim(self, *of: Any, removed: Sequence[Path] = ()) -> None:
        """Reserve the folder for the results of the inputs that the values `of` identify.

        JSON must support the values `of`.

        Afterwards, the command may replace the results that it wrote earlier for the same inputs. The command will
        remove the files and folders `removed` and write them again.

        Raises
        ------
        InputError
            The command has no option --force, and one of these is true: the folder contains results of other inputs, a
            result in the folder was changed, or the command would remove a file that it did not write.
        """
        record, found = self._folder / RECORD, self._known.get(_FOLDER)
        key = hashlib.sha256(json.dumps(of).encode()).hexdigest()
        mine = found if isinstance(found, dict) and found.get("of") == key else None
        if mine is None and not may_replace(record):
            raise InputError(
                f"{self._folder}: The folder contains results of another record or of other options. Name another "
                "folder, or replace the results with --force."
            )
        made = {} if mine is None else mine.get("made")
        if isinstance(made, dict):
            own(record, *(f for f, at in ((self._folder / n, v) for n, v in made.items()) if _hashes([f]) == [at]))
            refuse_existing(*(self._folder / n for n in made), *_files(removed))
        else:  # an interrupted command did not call `made`
            own(self._folder)
        self._known[_FOLDER] = {"of": key}
        if record.exists():  # otherwise the first finished step writes the log
            write_text(record, json.dumps(self._known, indent=1))

    def made(self, paths: Sequence[Path]) -> None:
        """Write to the log that these files, and all files in these folders, are results of the inputs of `claim`."""
        names = [file.relative_to(self._folder).as_posix() for file in _files(paths)]
        self._known[_FOLDER]["made"] = dict(zip(names, _hashes(_files(paths)), strict=True))
        write_text(self._folder / RECORD, json.dumps(self._known, indent=1))

    def run(self, name: str, inputs: Sequence[Any], files: Sequence[Path], make: Callable[[], Any]) -> Any:
        """Return the value of a step. Run the step only if it is not finished or if its files were changed.

        The name is unique in the folder. The values `inputs` identify all inputs of the step. The step writes `files`.
        The function `make` runs the step and returns its value. JSON must reproduce inputs and value exactly. Several
        threads may call this method.
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
    """Return those paths that are files, and all files in those paths that are folders."""
    inside = (sorted(p.rglob("*")) if p.is_dir() else [p] for p in paths)
    return [file for files in inside for file in files if file.is_file()]


def _hashes(files: Sequence[Path]) -> list[str]:
    return [hashlib.sha256(p.read_bytes()).hexdigest() if p.is_file() else "" for p in files]


@cache
def _package() -> str:
    """Return a hash of the names, sizes and modification times of all files of this package.

    The version number is not sufficient, because a developer may edit the files.
    """
    found = hashlib.sha256()
    for at, folders, names in os.walk(PACKAGE):
        folders[:] = sorted(f for f in folders if f != "__pycache__")
        for name in sorted(names):
            state = os.stat(os.path.join(at, name))
            found.update(f"{at}/{name} {state.st_size} {state.st_mtime_ns}\n".encode())
    return found.hexdigest()
