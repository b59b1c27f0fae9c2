"""Parsers of binary files. This file is run as a program in a confined process.

The packages for these formats are native code, and an untrusted file can crash them. The process writes one line of
JSON with the descriptions of all arrays. Then it writes, for each array, one line of JSON and the values in npy format.
The process imports only the subpackage `base` of HystFMU.
"""

import datetime
import io
import json
import math
import sys
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from typing import IO, Any, NamedTuple

import numpy as np

from hystfmu.base.child import limit_memory

GIGABYTES = 2.0
MOST_ARRAYS = 1000
_SECONDS = {"D": 86400.0, "h": 3600.0, "m": 60.0, "s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}


class Found(NamedTuple):
    """Description of an array in a file: `read` returns its values, whose size is `nbytes`.

    For an array of times, `first` is the first time stamp, and the values are seconds since this stamp.
    """

    name: str
    shape: tuple[int, ...]
    nbytes: int
    read: Callable[[], Any]
    unit: str = ""
    first: str = ""


def number(name: str, value: float, unit: str = "") -> Found:
    """Return the description of a single number in a file, e.g. of a sampling rate, as an array of shape ()."""
    return Found(name, (), 8, lambda: np.float64(value), unit)


def since_first(times: np.ndarray) -> tuple[np.ndarray, str]:
    """Return times (n,) of type datetime64 as seconds since the first time, and the first time as text."""
    name, count = np.datetime_data(times.dtype)
    per_count = count * _SECONDS[name]
    counts = times.astype(np.int64)
    return (counts - counts[0]) * per_count, str(times[0])


def timed(name: str, times: np.ndarray) -> list[Found]:
    """Return a list with the description of an array (n,) of times or durations, which is empty for other arrays."""
    if times.dtype.kind == "M" and times.ndim == 1 and len(times):
        seconds, first = since_first(times)
    elif times.dtype.kind == "m":
        seconds, first = times / np.timedelta64(1, "s"), ""
    else:
        return []
    return [Found(name, seconds.shape, seconds.nbytes, lambda: seconds, "s", first)]


def serve(arrays: Callable[[str], tuple[Sequence[Found], list[str]]], words: Sequence[str]) -> None:
    """Parse a file and write the result to another file.

    The function `arrays` returns, for the path of a file, the descriptions of its arrays, and remarks. It may raise any
    exception. `words` contains the path of the file, the path of the existing result file, the maximum number of bytes
    of all values, and the name of the requested array. An empty name requests all arrays.
    """
    source, result, most, asked = [*words, ""][:4]
    with open(result, "r+b") as out:
        try:
            limit_memory(GIGABYTES)
            found, said = arrays(source)
            _write(out, found[:MOST_ARRAYS], said, int(most), asked)
        except Exception as e:  # any class: the file is untrusted
            out.seek(0)
            out.truncate()
            _line(out, {"error": _text(e)})


def _write(out: IO[bytes], found: Sequence[Found], said: list[str], most: int, asked: str) -> None:
    """Write the descriptions of all arrays, and the values of the array `asked`, or of all arrays if it is empty.

    Arrays whose values exceed the remaining size limit `most` (bytes) are written without values.
    """
    _line(out, {"said": said, "arrays": [[a.name, list(map(int, a.shape)), a.unit, a.first] for a in found]})
    for a in found:
        if asked not in ("", a.name) or len(a.shape) > 2 or a.nbytes > most:
            continue
        most -= a.nbytes
        try:
            values = np.asarray(a.read())
        except Exception as e:  # any class: the file is untrusted, see above
            _line(out, {"name": a.name, "error": _text(e)})
        else:
            _line(out, {"name": a.name})
            np.save(out, values, allow_pickle=False)


def _line(out: IO[bytes], told: dict[str, Any]) -> None:
    out.write(json.dumps(told).encode() + b"\n")


def _text(e: Exception) -> str:
    return " ".join(str(e).split())[:100] or type(e).__name__


Told = tuple[list[Found], list[str]]
INDEX = "__index_level_0__"  # name of a pandas index that has no name
PARQUET = b"PAR1"
_NUMBERS = "biufc"  # kinds of types; the reader refuses complex numbers
MOST_DEPTH = 8
MATLAB_BLOCK = 512  # bytes before the signature in a MAT file of version 7.3
UNITS = ("unit_string", "NI_UnitDescription", "unit", "Unit")
UNSTORED = "no stored value (save in Excel): "  # in front of the text of a formula
_NUMERIC = (int, float, datetime.datetime, datetime.time)
START = "wf_start_offset"  # s: first time of a channel of LabVIEW
LEAST_ROWS = 4  # minimum number of rows with two numbers or times in a sheet


def arrow(source: str) -> Told:
    """Return the columns of numbers and times in a parquet or feather file, read with pyarrow."""
    import pyarrow as pa

    pa.set_cpu_count(1)
    pa.set_io_thread_count(1)
    with open(source, "rb") as file:
        start = file.read(len(PARQUET))
    if start == PARQUET:
        import pyarrow.parquet

        table = pyarrow.parquet.ParquetFile(source).read(use_threads=False)
    else:
        import pyarrow.feather

        table = pyarrow.feather.read_table(source, memory_map=False, use_threads=False)
    return [f for k in range(table.num_columns) for f in _arrow_column(pa, table.field(k), table.column(k))], []


def _arrow_column(pa: Any, field: Any, column: Any) -> list[Found]:
    """Return a list with the description of a column, which is empty if the column has neither numbers nor times."""
    kind, name = field.type, field.name
    told = field.metadata or {}
    unit = next((told[k].decode("utf-8", "replace") for k in (b"unit", b"units") if k in told), "")
    if name == INDEX:
        if pa.types.is_integer(kind):  # an index of integers contains row numbers
            return []
        name = "index"
    if pa.types.is_timestamp(kind) or pa.types.is_time(kind) or pa.types.is_date64(kind):
        scale = "ms" if pa.types.is_date64(kind) else kind.unit
        width = pa.int32() if pa.types.is_time32(kind) else pa.int64()
        return timed(name, column.cast(width).to_numpy().astype(np.int64).view(f"datetime64[{scale}]"))
    if pa.types.is_duration(kind):
        return timed(name, column.to_numpy())
    if pa.types.is_decimal(kind):
        column, kind = column.cast(pa.float64()), pa.float64()
    if not (pa.types.is_integer(kind) or pa.types.is_floating(kind) or pa.types.is_boolean(kind)):
        return []
    return [Found(name, (len(column),), 8 * len(column), partial(column.to_numpy), unit)]


def hdf5(source: str) -> Told:
    """Return the arrays of real numbers in an HDF5 file, and the single numbers in its attributes, without links."""
    import h5py

    file = h5py.File(source, "r")
    return _hdf5_arrays(h5py, file, -1 if file.userblock_size == MATLAB_BLOCK else 1), []


def _hdf5_arrays(h5py: Any, file: Any, turn: int) -> list[Found]:
    """Return the descriptions of all arrays in an HDF5 file. Links to other files are not followed.

    `turn` is -1 for files of MATLAB, which store matrices by columns, and otherwise 1.
    """
    found: list[Found] = []

    def collect(group: Any, prefix: str, depth: int) -> None:
        found.extend(_hdf5_attributes(group, prefix))
        for key in group:
            if len(found) >= MOST_ARRAYS or depth > MOST_DEPTH:
                return
            if key.startswith("#") or not isinstance(group.get(key, getlink=True), h5py.HardLink):
                continue
            item = group[key]
            if isinstance(item, h5py.Group):
                collect(item, f"{prefix}{key}/", depth + 1)
            elif isinstance(item, h5py.Dataset) and not item.is_virtual and not item.external:
                if item.dtype.kind not in "biuf" or item.attrs.get("MATLAB_class") == b"char":
                    continue
                read = partial(_hdf5_values, item, turn)
                found.append(Found(prefix + key, item.shape[::turn], item.nbytes, read, _hdf5_unit(item)))
                found.extend(_hdf5_attributes(item, prefix + key))

    collect(file, "", 0)
    return found


def _hdf5_values(item: Any, turn: int) -> np.ndarray:
    """Return the values of a dataset. Packed values of netCDF are unpacked, and missing ones become NaN (CF 2.5.1)."""
    values = np.asarray(item[()])
    told = {}
    for key in ("_FillValue", "missing_value", "scale_factor", "add_offset"):
        value = np.asarray(item.attrs.get(key, ""))
        if value.size == 1 and value.dtype.kind in "iuf":
            told[key] = value.reshape(-1)[0]
    if told:
        missing = np.isin(values, [told[key] for key in ("_FillValue", "missing_value") if key in told])
        unpacked = values * float(told.get("scale_factor", 1.0)) + float(told.get("add_offset", 0.0))
        values = np.where(missing, np.nan, unpacked)  # also of a single number, to which nothing can be assigned
    return values.T if turn < 0 else values


def _hdf5_attributes(item: Any, prefix: str) -> list[Found]:
    """Return the single numbers, such as a time step, in the attributes of a group or dataset of HDF5."""
    found = []
    for key in item.attrs:
        value = np.asarray(item.attrs[key])
        if value.size == 1 and value.dtype.kind in "iuf":
            found.append(number(f"{prefix}@{key}", float(value.reshape(-1)[0])))
    return found


def _hdf5_unit(array: Any) -> str:
    for key in ("units", "unit", "Units", "Unit"):
        if key in array.attrs:
            value = array.attrs[key]
            return value.decode("utf-8", "replace") if isinstance(value, bytes) else str(value)
    return ""


def matlab(source: str) -> Told:
    """Return the arrays of numbers in a MAT file of version 5, read with scipy.

    If the file has fewer than two arrays, the arrays inside its structs and cells are included. In recordings of dSPACE
    and Simulink, a struct contains a signal and its name, which becomes the name of the array.

    Raises
    ------
    ValueError
        The file contains only objects that are not arrays of numbers.
    """
    from scipy.io import loadmat, whosmat

    loaded = loadmat(source, appendmat=False)
    arrays = {n: a for n, a in loaded.items() if type(a) is np.ndarray and not n.startswith("__")}  # no objects
    found = [_matlab_array(name, a) for name, a in arrays.items() if a.dtype.kind in _NUMBERS]
    if sum(math.prod(f.shape) > 1 for f in found) < 2:
        found += [f for name, a in arrays.items() if a.dtype.kind in "OV" for f in _matlab_inside(name, a)]
    if not found:
        name, _, kind = whosmat(source, appendmat=False)[0]
        raise ValueError(f"{name!r} of class {kind}: save its values as variables, e.g. t = {name}.Time")
    names = [f.name for f in found]
    return [f if f.name not in names[:k] else f._replace(name=f"{f.name} #{k}") for k, f in enumerate(found)], []


def _matlab_array(name: str, array: np.ndarray, unit: str = "") -> Found:
    """Return the description of an array, which Simulink stores with the shape 1 x 1 x n."""
    array = array if array.ndim < 3 else np.squeeze(array)
    return Found(name, array.shape, array.nbytes, lambda: array, unit)


def _matlab_inside(name: str, array: np.ndarray, depth: int = 0) -> Iterator[Found]:
    """Yield the arrays inside a struct or a cell array, named after their fields."""
    for k, element in enumerate(array.reshape(-1, order="F")):
        base = name if array.size == 1 else f"{name}({k + 1})"
        inner = {key: element[key] for key in array.dtype.names} if array.dtype.names else {"": element}
        fields = {key: a for key, a in inner.items() if type(a) is np.ndarray and a.size}
        words = {key.lower(): str(a.flat[0]).strip() for key, a in fields.items() if a.dtype.kind == "U"}
        title, unit = words.get("name") or words.get("label", ""), words.get("unit", "")
        for key, a in fields.items():
            named = f"{base}/{key}" if key else base
            if a.dtype.kind in "OV":
                yield from _matlab_inside(named, a, depth + 1) if depth < MOST_DEPTH else ()
            elif a.dtype.kind in _NUMBERS and key.lower() in ("data", "values"):
                clock = f"{base[:-2]}/time" if base.endswith("/X") else ""  # dSPACE
                yield _matlab_array(clock or title or named, a, unit)
            elif a.dtype.kind in _NUMBERS:
                yield _matlab_array(named if a.size > 1 else f"{base}@{key}", a)


def numpy_files(source: str) -> Told:
    """Return the arrays of numbers or times in an npy or npz file. The array of an npy file has no name.

    Raises
    ------
    ValueError
        An array contains Python objects.
    """
    loaded = np.load(source, allow_pickle=False)
    if isinstance(loaded, np.ndarray):
        return _numpy_array("", loaded), []
    found, fault = [], None
    for name in loaded.files:
        try:
            found += _numpy_array(name, loaded[name])
        except ValueError as e:  # the array contains pickled objects
            fault = e
    if fault is not None and not found:
        raise fault
    return found, []


def _numpy_array(name: str, array: np.ndarray) -> list[Found]:
    if array.dtype.names:
        return [f for n in array.dtype.names for f in _numpy_array(n, array[n])]
    numbers = [Found(name, array.shape, array.nbytes, lambda: array)] if array.dtype.kind in "biuf" else []
    return timed(name, array) or numbers


def tdms(source: str) -> Told:
    """Return the channels of a TDMS file of LabVIEW, read with npTDMS.

    The name of a channel includes its group if there are several groups.
    """
    from nptdms import TdmsFile

    file = TdmsFile.open(source)
    groups = [group for group in file.groups() if group.channels()]
    found = []
    for group in groups:
        for channel in group.channels():
            name = channel.name if len(groups) == 1 else f"{group.name}/{channel.name}"
            found += _tdms_channel(name, channel)
    return found, []


def _tdms_channel(name: str, channel: Any) -> list[Found]:
    dtype = channel.dtype
    unit = next((str(channel.properties[k]) for k in UNITS if k in channel.properties), "")
    if dtype.kind == "M" and len(channel):
        return timed(name, np.asarray(channel[:]))
    if dtype.kind not in "biuf":
        return []
    found = [Found(name, (len(channel),), 8 * len(channel), partial(channel.__getitem__, slice(None)), unit)]
    told = {k: channel.properties[k] for k in ("wf_increment", START) if k in channel.properties}
    names = {"wf_increment": "dt", START: START}
    return [*found, *(number(f"{name}@{names[k]}", float(v)) for k, v in told.items() if v)]


def xlsx(source: str) -> Told:
    """Return the first sheet with rows of numbers in an Excel workbook, read with openpyxl, and the name of this sheet.

    The sheet is returned as bytes of text, with tabs between the cells.

    Raises
    ------
    ValueError
        No sheet contains rows of numbers.
    """
    from openpyxl import load_workbook

    lost = ""
    with open(source, "rb") as file:  # read here, because openpyxl refuses names without a known extension
        book = partial(load_workbook, io.BytesIO(file.read()), read_only=True)
    sheets = book(data_only=True).worksheets
    for k, sheet in enumerate(sheets):
        rows = list(sheet.iter_rows(values_only=True))
        numeric = sum(sum(isinstance(v, _NUMERIC) for v in row) > 1 for row in rows)
        if any(None in row for row in rows):
            formulas = book().worksheets[k].iter_rows(values_only=True)
            rows = [tuple(map(_stored, row, cells)) for row, cells in zip(rows, formulas, strict=True)]
        if numeric >= LEAST_ROWS:
            text = "\n".join("\t".join(map(_cell, row)) for row in rows)
            content = np.frombuffer(text.encode(), dtype=np.uint8)
            of = f" of {len(sheets)}" if len(sheets) > 1 else ""
            return [Found("", content.shape, content.nbytes, partial(np.array, content))], [
                f"sheet {sheet.title!r}{of}"
            ]
        lost = lost or next((v for row in rows for v in row if str(v).startswith(UNSTORED)), "")
    raise ValueError(f"no sheet with rows of numbers{f'; {lost}' if lost else ''}")


def _stored(value: Any, formula: Any) -> Any:
    """Return the value of a cell, or the formula of a cell that has no value."""
    return f"{UNSTORED}{formula}" if value is None and formula is not None else value


def _cell(value: Any) -> str:
    """Return the text of a cell. Times of day are written with three decimals of the second."""
    if value is None:
        return ""
    if isinstance(value, datetime.datetime):
        return value.isoformat(" ", "milliseconds")
    if isinstance(value, datetime.time):
        return value.isoformat("milliseconds")
    if isinstance(value, datetime.timedelta):
        return repr(value.total_seconds())
    if isinstance(value, float):
        return repr(value)
    return " ".join(str(value).split())


PARSERS = {parser.__name__: parser for parser in (arrow, hdf5, matlab, numpy_files, tdms, xlsx)}

if __name__ == "__main__":
    serve(PARSERS[sys.argv[1]], sys.argv[2:])
