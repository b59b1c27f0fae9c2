"""HDF5 files, and MAT files of version 7.3, by h5py: arrays of numbers that the file itself holds."""

from __future__ import annotations

import io
from pathlib import Path
from typing import Any

import numpy as np

from hystfmu.base.errors import InputError
from hystfmu.base.extras import extras
from hystfmu.data.reader.arrays import Named, table_of
from hystfmu.data.reader.measures import spelling
from hystfmu.data.reader.table import Table

SIGNATURE = b"\x89HDF\r\n\x1a\n"
MOST_ARRAYS, MOST_DEPTH = 1000, 8


def is_hdf5(content: bytes) -> bool:
    """Whether the bytes are an HDF5 file; one of MATLAB has 512 bytes before its signature."""
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
        import h5py

    try:
        file = h5py.File(io.BytesIO(content), "r")
        found: dict[str, Any] = {}
        _collect(h5py, file, "", found, 0)
        turn = -1 if content[512:520] == SIGNATURE else 1  # MATLAB stores columns first
        arrays = [
            Named(name, tuple(array.shape)[::turn], _unit(array))
            for name, array in found.items()
            if array.dtype.kind in "biuf" and array.attrs.get("MATLAB_class") != b"char"
        ]
    except InputError:
        raise
    except Exception as e:  # any class: the parser is not ours, and the file is untrusted
        raise _damaged(path, e) from None

    def read(name: str) -> np.ndarray:
        try:
            values = np.asarray(found[name][()])
            return values.T if turn < 0 else values
        except Exception as e:  # as above
            raise _damaged(path, e) from None

    return table_of(path, "HDF5", arrays, read, most)


def _collect(h5py: Any, group: Any, prefix: str, found: dict[str, Any], depth: int) -> None:
    """Collect arrays by name; skip arrays that lie in other files."""
    for key in group:
        if len(found) >= MOST_ARRAYS or depth > MOST_DEPTH:
            return
        if key.startswith("#") or not isinstance(group.get(key, getlink=True), h5py.HardLink):
            continue
        item = group[key]
        if isinstance(item, h5py.Group):
            _collect(h5py, item, f"{prefix}{key}/", found, depth + 1)
        elif isinstance(item, h5py.Dataset) and not item.is_virtual and not item.external:
            found[prefix + key] = item


def _unit(array: Any) -> str:
    for key in ("units", "unit", "Units", "Unit"):
        if key in array.attrs:
            value = array.attrs[key]
            return spelling(value.decode("utf-8", "replace") if isinstance(value, bytes) else str(value))
    return ""


def _damaged(path: str | Path, e: Exception) -> InputError:
    text = " ".join(str(e).split())[:100] or type(e).__name__
    return InputError(f"{path}: The file must be a whole HDF5 file. Got: {text}.")
