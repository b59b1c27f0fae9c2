"""Reading of binary files with optional packages, each in a confined process that returns plain numbers."""

from __future__ import annotations

import importlib.util
import json
import tempfile
from dataclasses import dataclass, replace
from pathlib import Path
from typing import IO, Any

import numpy as np

from hystfmu.base.child import Child
from hystfmu.base.confine import Box
from hystfmu.base.errors import InputError, extras
from hystfmu.data.reader.arrays import Named, table_of
from hystfmu.data.reader.delimited import delimited
from hystfmu.data.reader.headings import spelling
from hystfmu.data.reader.table import Table

SECONDS = 120.0  # time limit of the parser
MOST_TOLD = 2**24  # bytes of names, units of measure and headings in its result
_HDF5, _ZIP = b"\x89HDF\r\n\x1a\n", b"PK\x03\x04"
_MATLAB_BLOCK = 512  # bytes before the signature in a MAT file of version 7.3
_OLD = b"\xd0\xcf\x11\xe0"


@dataclass(frozen=True)
class Format:
    """A file format: its name, the function of `formats` that parses it, and the package that it needs."""

    name: str
    parser: str
    package: str


_FORMATS = {
    _HDF5: Format("HDF5", "hdf5", "h5py"),
    b"\x93NUMPY": Format("npy", "numpy_files", "numpy"),
    b"PAR1": Format("parquet", "arrow", "pyarrow"),
    b"ARROW1": Format("feather", "arrow", "pyarrow"),
    b"FEA1": Format("feather", "arrow", "pyarrow"),
    b"TDSm": Format("TDMS", "tdms", "nptdms"),
}
_XLSX, _NPZ = Format("xlsx", "xlsx", "openpyxl"), Format("npz", "numpy_files", "numpy")


class _Damaged(ValueError):
    """Message of the parser, or a note that the parser gives no message."""


def format_of(content: bytes, path: str | Path) -> Format | None:
    """Return the format of a binary file by its first bytes; None for other files.

    Raises
    ------
    InputError
        The file is a zip archive but neither a workbook nor a numpy file, or it is a workbook of Excel 97.
    """
    if content.startswith(_ZIP):
        if b"xl/workbook" in content:
            return _XLSX
        if b".npy" in content[-2000:]:  # its directory is at the end
            return _NPZ
        raise InputError(
            f"{path}: The file must be text, a workbook or a file of arrays. Got a zip archive: unpack it."
        )
    if content.startswith(_OLD):
        raise InputError(
            f"{path}: The workbook must be in the format xlsx. Got one of Excel 97: save it as xlsx or CSV."
        )
    if content[_MATLAB_BLOCK : _MATLAB_BLOCK + len(_HDF5)] == _HDF5:
        return _FORMATS[_HDF5]
    return next((f for start, f in _FORMATS.items() if content.startswith(start)), None)


def confined(content: bytes, form: Format, path: str | Path, decimal: str | None, most: int) -> Table:
    """Read a binary file.

    Parameters
    ----------
    content : bytes
        The file.
    form : Format
    path : path
        For messages.
    decimal : str, optional
        Decimal sign of numbers in cells of text.
    most : int
        Largest size of a column in bytes.

    Raises
    ------
    InputError
        The file is damaged, has no arrays of numbers, or has columns that are too large.
    MissingExtra
        The package for the format is not installed.
    """
    with extras(f"{path}: the format {form.name}", "files"):
        if importlib.util.find_spec(form.package) is None:
            raise ModuleNotFoundError(name=form.package)
    try:
        said, arrays, values = _parsed(content, form, most)
    except _Damaged as e:
        raise _refused(path, form, e) from None

    def read(name: str) -> np.ndarray:
        try:
            if name not in values:  # all together are too large
                values.update(_parsed(content, form, most, name)[2])
            found = values[name]
            if isinstance(found, str):
                raise _Damaged(found)
        except (_Damaged, KeyError) as e:
            raise _refused(path, form, e) from None
        return found

    if form == _XLSX:
        table = delimited(read("").astype(np.uint8).tobytes(), path, decimal, [form.name, *said])
        return replace(table, assumed=tuple(a for a in table.assumed if a != "separator tabs"))
    return table_of(path, form.name, arrays, read, most)


def _parsed(
    content: bytes, form: Format, most: int, asked: str = ""
) -> tuple[list[str], list[Named], dict[str, np.ndarray | str]]:
    """Return the remark, all arrays, and the values of all arrays or of the requested array.

    In case of a failure, return a text with the reason.

    Raises
    ------
    _Damaged
        The parser refuses the file, crashes, does not end or gives an invalid result.
    """
    program = str(Path(__file__).with_name("formats.py"))
    with tempfile.TemporaryDirectory(prefix="hystfmu-read-") as folder:
        source, result = Path(folder, "source"), Path(folder, "result")
        source.write_bytes(content)
        with result.open("x+b") as out:  # read through this handle: whatever the parser puts in its place is not
            parser = Child(
                program, form.parser, *map(str, (source, result, most)), asked, box=Box.of(folder), told=False
            )
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


def _result(out: IO[bytes]) -> tuple[list[str], list[Named], dict[str, np.ndarray | str]]:
    """Read the output of the parser, which may be truncated or manipulated."""
    try:
        told = json.loads(out.readline(MOST_TOLD))
        if "error" in told:
            raise _Damaged(str(told["error"])[:100])
        arrays = [
            Named(str(name), tuple(int(k) for k in shape), spelling(str(unit)), str(first))
            for name, shape, unit, first in told["arrays"]
        ]
        shapes = {a.name: a.shape for a in arrays}
        values: dict[str, np.ndarray | str] = {}
        while line := out.readline(MOST_TOLD):
            item: dict[str, Any] = json.loads(line)
            found = str(item["error"])[:100] if "error" in item else np.load(out, allow_pickle=False)
            if isinstance(found, np.ndarray) and found.shape != shapes[item["name"]]:
                raise _Damaged("values in another shape")
            values[item["name"]] = found
        return [str(s)[:100] for s in told["said"]], arrays, values
    except _Damaged:
        raise
    except (ValueError, KeyError, TypeError, MemoryError, RecursionError, EOFError, OSError):
        raise _Damaged("one at which the parser fails") from None


def _refused(path: str | Path, form: Format, e: Exception) -> InputError:
    return InputError(f"{path}: The file must be a whole {form.name} file. Got: {e}.")
