"""Conversion of binary files and data frames to a `Table`. Arrays of equal length become its columns.

Optional packages parse binary files. They run in a confined process, which returns only numbers and names. Data frames
are read through methods that pandas, polars and pyarrow have in common.
"""

import importlib.util
import json
import re
import tempfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import IO, Any, Protocol, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hystfmu.base import Array, InputError, extras
from hystfmu.base.child import Child
from hystfmu.base.confine import Box
from hystfmu.data.columns import LEAST_ROWS
from hystfmu.data.reader.delimited import delimited
from hystfmu.data.reader.formats import MATLAB_BLOCK, PARQUET, START, timed
from hystfmu.data.reader.table import Column, Stamps, Table, spelling, stated_step

MOST_COLUMNS = 10_000


@dataclass(frozen=True)
class Named:
    """Description of an array in a file, whose values are not read yet.

    The name includes the group of the array if there is one, as in ``run1/u``. The name is empty if the file contains a
    single array without name. For an array of times, `first` is the first time stamp, and the values are seconds since
    this stamp.
    """

    name: str
    shape: tuple[int, ...]
    unit: str = ""
    first: str = ""


def table_of(
    path: str | Path, kind: str, arrays: Sequence[Named], read: Callable[[str], np.ndarray], most: int
) -> Table:
    """Return a table of the arrays of numbers in a file; `read` returns the values of the array with a given name.

    An array of one number may state the time step; other arrays of one number are ignored. `kind` is the name of the
    file format for the line with the assumptions, or empty. `most` is the maximum size of all columns together, in
    bytes.

    Raises
    ------
    InputError
        There is no column, or there are too many columns. The table raises the same error later, when its values are
        read, if columns are too large or have different lengths.
    """
    sized = [(a, *_columns(a.shape)) for a in arrays]
    places = [_Place(a, n, i, k) for a, n, k in sized if n > 1 for i in range(k)]
    if not places:
        raise InputError(f"{path}: The file must have arrays of numbers, a column each. Got none.")
    if len(places) > MOST_COLUMNS:
        raise InputError(f"{path}: The file must have at most {MOST_COLUMNS} columns. Got {len(places)} instead.")
    columns = tuple(p.column for p in places)
    steps: dict[str, float] = {}  # the key is the group or array to which a step belongs
    starts: dict[str, float] = {}
    left = []
    for a in (a for a, n, _ in sized if n <= 1):
        stated = 0.0
        if a.name.endswith(f"@{START}"):
            starts[a.name.removesuffix(f"@{START}")] = float(np.asarray(read(a.name)))
        if a.shape in ((), (1,), (1, 1)) and stated_step(a.name, 1.0, a.unit):
            stated = stated_step(a.name, float(np.asarray(read(a.name)).reshape(-1)[0]), a.unit)
        if stated:
            steps.setdefault(re.sub(r"[/@]?[^/@]*$", "", a.name), stated)
        elif "@" not in a.name:  # names with @ are attributes
            left.append(a.name)
    assumed = (*([kind] if kind else []), *([f"left out {', '.join(left)[:80]}"] if left else []))
    own = tuple((_own_step(steps, p.array.name), starts.get(p.array.name, 0.0)) for p in places)
    step = next(iter(steps.values()), 0.0)
    return Table(str(path), columns, "", assumed, Arrays(path, places, read, most), None, step, own)


def _own_step(steps: Mapping[str, float], name: str) -> float:
    """Return the time step of the array `name`, or of the innermost group that contains it; 0 if none is stated."""
    inside = (group for group in steps if not group or f"{name}/".startswith(f"{group}/"))
    return steps.get(max(inside, key=len, default=name), 0.0)


@dataclass(frozen=True)
class _Place:
    """Position of a table column in an array: column `i` of an array with `k` columns and `n` rows."""

    array: Named
    n: int
    i: int
    k: int

    @property
    def column(self) -> Column:
        label, unit = self.array.name, self.array.unit
        label = label if self.k == 1 or not label else f"{label}(:,{self.i + 1})"
        kind = Column.of(label, unit, "clock" if self.array.first else "number")
        return Column(label, label, unit, kind.kind) if unit else kind


class Arrays:
    """Values of the arrays in a file, as the `Source` of a table; `table_of` explains the arguments."""

    def __init__(
        self, path: str | Path, places: Sequence[_Place], read: Callable[[str], np.ndarray], most: int
    ) -> None:
        self._path, self._places, self._read, self._most = path, places, read, most

    def _values(self, j: int) -> np.ndarray:
        p = self._places[j]
        if 8 * p.n * p.k > self._most:
            raise InputError(
                f"{self._path}: The array {p.array.name!r} must have at most {self._most} bytes. "
                f"Got {8 * p.n * p.k} instead."
            )
        found = np.asarray(self._read(p.array.name))
        if found.dtype.kind not in "biuf":
            raise InputError(
                f"{self._path}: The array {p.array.name!r} must hold real numbers. Got {found.dtype} instead."
            )
        return (found if found.shape[0] == p.n else found.T).reshape(p.n, p.k)[:, p.i]

    def numbers(self, order: Sequence[int]) -> Array:
        """Return the columns with the indices `order`, shape (n, len(order))."""
        lengths = {self._places[j].n for j in order}
        if len(lengths) > 1:
            names = ", ".join(f"{self._places[j].array.name} ({self._places[j].n})" for j in order)
            raise InputError(f"{self._path}: The columns must have equal lengths. Got {names} instead.")
        return np.column_stack([self._values(j).astype(np.float64) for j in order])

    def digits(self, k: int) -> Array:
        """Return, for each value of column `k`, the distance to the next floating-point number."""
        column = self._values(k)
        kind = np.float32 if column.dtype == np.float32 else np.float64
        counts: Array = np.spacing(np.abs(column).astype(kind)).astype(np.float64)
        return counts

    def words(self, k: int) -> list[str]:
        """Return column `k` as text."""
        return [f"{v:.12g}" for v in self._values(k)]

    def since(self, k: int) -> Array:
        """Return column `k` minus its first value."""
        column = self._values(k)
        column = column.astype(np.int64) if column.dtype.kind in "biu" else column.astype(np.float64)
        since: Array = (column - column[0]).astype(np.float64)
        return since

    def stamps(self, k: int) -> Stamps:
        """Return the times of column `k` in s, relative to its first time stamp."""
        t = self._values(k).astype(np.float64)
        return Stamps(t, np.full(len(t), 1e-9), self._places[k].array.first)


def _columns(shape: tuple[int, ...]) -> tuple[int, int]:
    """Return the numbers of rows and columns of an array. An array of up to three long rows counts as transposed."""
    if len(shape) == 2 and shape[0] < LEAST_ROWS <= shape[1]:
        return shape[1], shape[0]
    if len(shape) in (1, 2):
        return shape[0], shape[1] if len(shape) == 2 else 1
    return 0, 0


NAME = "data frame"


class DataFrame(Protocol):
    """Common interface of a data frame of pandas or polars, and of a table of pyarrow."""

    @property
    def columns(self) -> Any:
        """Names of the columns, or the columns themselves for a table of pyarrow."""

    def __getitem__(self, key: Any, /) -> Any:
        """Return the column with the name `key`."""


Frame: TypeAlias = DataFrame | Mapping[str, ArrayLike] | NDArray[Any]
"""Data in columns. The columns of an array (n, 3) are time, input and output."""


Columns: TypeAlias = DataFrame | Mapping[str, ArrayLike]
"""Data with named columns."""


def is_frame(given: object) -> bool:
    """Return whether `given` is a data frame, a mapping of arrays, or an array of columns."""
    return isinstance(given, (Mapping, np.ndarray)) or hasattr(given, "column_names") or hasattr(given, "columns")


def frame(given: Any, most: int) -> Table:
    """Return a table of the columns with numbers or times. An index of pandas also becomes a column.

    An index of row numbers is ignored.

    `given` is a data frame, a mapping of str to array, or an array. `most` is the maximum size of a column in bytes.

    Raises
    ------
    InputError
        There are no columns of numbers, or two columns have the same name.
    """
    arrays: list[Named] = []
    values: dict[str, np.ndarray] = {}
    for name, column in _frame_columns(given):
        found, first = column, ""
        if times := timed(name, column):
            found, first = times[0].read(), times[0].first or "0 s"
        elif column.dtype.kind not in "biuf":
            continue
        if name in values:
            raise InputError(f"{NAME}: The column {name!r} must occur once. Got two.")
        values[name] = found
        arrays.append(Named(name, found.shape, "s" if first else "", first))
    return table_of(NAME, "", arrays, values.__getitem__, most)


def _frame_columns(given: Any) -> Iterator[tuple[str, np.ndarray]]:
    if isinstance(given, np.ndarray) and given.dtype.names is None:
        yield "", given
        return
    names = list(given) if isinstance(given, Mapping) else getattr(given, "column_names", None)
    names = names if not isinstance(given, np.ndarray) else given.dtype.names
    for name in given.columns if names is None else names:
        yield str(name), _array(given[name])
    index = getattr(given, "index", None)
    if index is not None and not callable(index) and type(index).__name__ != "RangeIndex":
        column = _array(index)
        if column.dtype.kind in "fmM" or index.name:
            yield str(index.name or "index"), column


def _array(column: Any) -> np.ndarray:
    """Return a column as an array. Times with a time zone are converted to UTC."""
    if getattr(getattr(column, "dtype", None), "tz", None) is not None:
        column = column.dt.tz_convert(None) if hasattr(column, "dt") else column.tz_convert(None)
    try:
        return np.asarray(column)
    except (TypeError, ValueError):
        return np.empty(0, dtype=object)  # rows of different lengths are not numbers


SECONDS = 120.0  # s: time limit of the parser
MOST_TOLD = 2**24  # maximum number of bytes of names, units of measure and headings in the result of the parser
_HDF5, _ZIP = b"\x89HDF\r\n\x1a\n", b"PK\x03\x04"
_OLD = b"\xd0\xcf\x11\xe0"


@dataclass(frozen=True)
class Format:
    """A file format with the function of the module `formats` that parses it and the package that it needs."""

    name: str
    parser: str
    package: str


_FORMATS = {
    _HDF5: Format("HDF5", "hdf5", "h5py"),
    b"MATLAB": Format("MAT", "matlab", "scipy"),
    b"\x93NUMPY": Format("npy", "numpy_files", "numpy"),
    PARQUET: Format("parquet", "arrow", "pyarrow"),
    b"ARROW1": Format("feather", "arrow", "pyarrow"),
    b"FEA1": Format("feather", "arrow", "pyarrow"),
    b"TDSm": Format("TDMS", "tdms", "nptdms"),
}
_XLSX, _NPZ = Format("xlsx", "xlsx", "openpyxl"), Format("npz", "numpy_files", "numpy")


class _Damaged(ValueError):
    """The parser cannot read the file. The message is from the parser, or describes how the parser ended."""


def format_of(content: bytes, path: str | Path) -> Format | None:
    """Return the format of a binary file, recognised by its first bytes; None for other files.

    Raises
    ------
    InputError
        The file is a workbook of Excel 97, or a zip archive that is neither a workbook nor a file of numpy.
    """
    if content.startswith(_ZIP):
        if b"xl/workbook" in content:
            return _XLSX
        if b".npy" in content[-2000:]:  # a zip archive has its directory at the end
            return _NPZ
        raise InputError(
            f"{path}: The file must be text, a workbook or a file of arrays. Got a zip archive: unpack it."
        )
    if content.startswith(_OLD):
        raise InputError(
            f"{path}: The workbook must be in the format xlsx. Got one of Excel 97: save it as xlsx or CSV."
        )
    if content[MATLAB_BLOCK : MATLAB_BLOCK + len(_HDF5)] == _HDF5:
        return _FORMATS[_HDF5]  # a MAT file of version 7.3 is HDF5 after a MATLAB header
    return next((f for start, f in _FORMATS.items() if content.startswith(start)), None)


def confined(content: bytes, form: Format, path: str | Path, decimal: str | None, most: int) -> Table:
    """Return the table of a binary file, which a parser reads in a confined process.

    `content` is the content of the file, and `path` its name for messages. `most` is the maximum size of a column in
    bytes. `decimal` is the decimal sign of numbers that are stored as text; with None, the reader finds the sign.

    Raises
    ------
    InputError
        The file is damaged, contains no arrays of numbers, or has columns that are too large.
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
            if name not in values:  # all arrays together exceed the limit
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
    """Return the remarks of the parser, the descriptions of all arrays, and values by name.

    The values are those of the array with the name `asked`, or those of all arrays if `asked` is empty. An array whose
    values cannot be read has a text with the reason instead of values. Raises _Damaged if the parser refuses the file,
    crashes, does not end in time, or writes an invalid result.
    """
    program = str(Path(__file__).with_name("formats.py"))
    with tempfile.TemporaryDirectory(prefix="hystfmu-read-") as folder:
        source, result = Path(folder, "source"), Path(folder, "result")
        source.write_bytes(content)
        with result.open("x+b") as out:  # the result is read through this handle, so the parser cannot replace the file
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
    """Return the content of the result file of the parser, which may be truncated or manipulated."""
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
