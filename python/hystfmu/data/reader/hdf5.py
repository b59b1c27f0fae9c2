"""HDF5 files, and MAT files of version 7.3: arrays of numbers in the file itself, parsed in a confined process."""

from __future__ import annotations

import importlib.util
import json
import tempfile
from pathlib import Path
from typing import IO, Any

import numpy as np

from hystfmu.base.child import Child
from hystfmu.base.confine import Box
from hystfmu.base.errors import InputError
from hystfmu.base.extras import extras
from hystfmu.data.reader.arrays import Named, table_of
from hystfmu.data.reader.measures import spelling
from hystfmu.data.reader.table import Table

SIGNATURE = b"\x89HDF\r\n\x1a\n"
PARSER = Path(__file__).with_name("hdf5_parser.py")
SECONDS = 120.0  # time limit of the parser
MOST_TOLD = 2**24  # bytes of names, units of measure and headings in its result


class _Damaged(ValueError):
    """Message of the parser, or the note that it gave none."""


def is_hdf5(content: bytes) -> bool:
    """Return whether the bytes are an HDF5 file; one of MATLAB has 512 bytes before its signature."""
    return content.startswith(SIGNATURE) or content[512:520] == SIGNATURE


def hdf5(content: bytes, path: str | Path, most: int) -> Table:
    """Read the arrays of an HDF5 file.  Links to other files and objects are not followed.

    Raises
    ------
    InputError
        A damaged file, no arrays of numbers, columns of more than `most` bytes.
    MissingExtra
        h5py is not installed.
    """
    with extras(f"{path}: an HDF5 file"):
        if importlib.util.find_spec("h5py") is None:
            raise ModuleNotFoundError(name="h5py")
    try:
        arrays, values = _parsed(content, most)
    except _Damaged as e:
        raise _refused(path, e) from None

    def read(name: str) -> np.ndarray:
        try:
            if name not in values:  # all together are too large
                values.update(_parsed(content, most, name)[1])
            found = values[name]
            if isinstance(found, str):
                raise _Damaged(found)
        except (_Damaged, KeyError) as e:
            raise _refused(path, e) from None
        return found

    return table_of(path, "HDF5", arrays, read, most)


def _parsed(content: bytes, most: int, asked: str = "") -> tuple[list[Named], dict[str, np.ndarray | str]]:
    """Return all arrays, and the values of all or of the one that is asked for; a text says why there are none.

    Raises
    ------
    _Damaged
        The parser refuses the file, crashes or does not end, or its result is none.
    """
    with tempfile.TemporaryDirectory(prefix="hystfmu-read-") as folder:
        source, result = Path(folder, "source"), Path(folder, "result")
        source.write_bytes(content)
        with result.open("x+b") as out:  # read through this handle: whatever the parser puts in its place is not
            parser = Child(str(PARSER), str(source), str(result), str(most), asked, box=Box.of(folder), told=False)
            lines, in_time = parser.finish(SECONDS)
            if not in_time:
                raise _Damaged(f"one that the parser does not finish within {SECONDS:g} s")
            if parser.status < 0:
                raise _Damaged(f"one at which the parser {parser.ending}")
            if parser.status:
                raise _Damaged(f"{lines[-1][:100] if lines else parser.ending}")
            if out.seek(0, 2) > most + MOST_TOLD:
                raise _Damaged("more values than the limit")
            out.seek(0)
            return _result(out)


def _result(out: IO[bytes]) -> tuple[list[Named], dict[str, np.ndarray | str]]:
    """Read what the parser wrote; a crash may have cut it, and a file may have taken it over."""
    try:
        told = json.loads(out.readline(MOST_TOLD))
        if "error" in told:
            raise _Damaged(str(told["error"])[:100])
        arrays = [Named(str(n), tuple(int(k) for k in shape), spelling(str(u))) for n, shape, u in told["arrays"]]
        shapes = {a.name: a.shape for a in arrays}
        values: dict[str, np.ndarray | str] = {}
        while line := out.readline(MOST_TOLD):
            item: dict[str, Any] = json.loads(line)
            found = str(item["error"])[:100] if "error" in item else np.load(out, allow_pickle=False)
            if isinstance(found, np.ndarray) and found.shape != shapes[item["name"]]:
                raise _Damaged("values in another shape")
            values[item["name"]] = found
        return arrays, values
    except _Damaged:
        raise
    except (ValueError, KeyError, TypeError, MemoryError, RecursionError, EOFError, OSError):
        raise _Damaged("one at which the parser fails") from None


def _refused(path: str | Path, e: Exception) -> InputError:
    return InputError(f"{path}: The file must be a whole HDF5 file. Got: {e}.")
