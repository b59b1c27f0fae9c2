"""HDF5 files: libhdf5 is native code, which an untrusted file can crash. Numbers that are stored in the file itself."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np

from hystfmu.base.told_arrays import MOST_ARRAYS, Found, number, serve

MOST_DEPTH = 8
MATLAB_BLOCK = 512  # bytes before the signature in a MAT file


def arrays(source: str) -> tuple[list[Found], list[str]]:
    """Return the arrays of real numbers, and single numbers among the attributes."""
    import h5py

    file = h5py.File(source, "r")
    return _arrays(h5py, file, -1 if file.userblock_size == MATLAB_BLOCK else 1), []


def _arrays(h5py: Any, file: Any, turn: int) -> list[Found]:
    """Collect the datasets of the file; links to other files are not followed.

    MATLAB stores columns first: `turn` is -1.
    """
    found: list[Found] = []

    def collect(group: Any, prefix: str, depth: int) -> None:
        found.extend(_attributes(group, prefix))
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
                read = partial(_values, item, turn)
                found.append(Found(prefix + key, item.shape[::turn], item.nbytes, read, _unit(item)))
                found.extend(_attributes(item, prefix + key))

    collect(file, "", 0)
    return found


def _values(item: Any, turn: int) -> np.ndarray:
    values = np.asarray(item[()])
    return values.T if turn < 0 else values


def _attributes(item: Any, prefix: str) -> list[Found]:
    """Return single numbers, such as a sample step."""
    found = []
    for key in item.attrs:
        value = np.asarray(item.attrs[key])
        if value.size == 1 and value.dtype.kind in "iuf":
            found.append(number(f"{prefix}@{key}", float(value.reshape(-1)[0])))
    return found


def _unit(array: Any) -> str:
    for key in ("units", "unit", "Units", "Unit"):
        if key in array.attrs:
            value = array.attrs[key]
            return value.decode("utf-8", "replace") if isinstance(value, bytes) else str(value)
    return ""


if __name__ == "__main__":
    serve(arrays)
