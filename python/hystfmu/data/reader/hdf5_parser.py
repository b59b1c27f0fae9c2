"""Parse an untrusted HDF5 file in a process of its own: libhdf5 is native code, which such a file can crash.

Run by its path, so that no more of the package is loaded than it needs.  Its result is a line of JSON with all arrays,
then for each one a line and its values in the format npy.
"""

from __future__ import annotations

import json
import sys
from typing import IO, Any

import numpy as np

from hystfmu.base.child import limit_memory

MOST_ARRAYS, MOST_DEPTH = 1000, 8
MATLAB_BLOCK = 512  # bytes before the signature in a MAT file
GIGABYTES = 2.0


def main(source: str, result: str, most: int, asked: str = "") -> None:
    """Write names, shapes and units of measure of the arrays in `source`, and values of at most `most` bytes.

    Parameters
    ----------
    source, result : str
        Files; the second exists.
    most : int
        Bytes of all values together; an array that does not fit is left out.
    asked : str
        Name of the one array whose values are wanted; empty for all.
    """
    import h5py

    limit_memory(GIGABYTES)
    with open(result, "r+b") as out:
        try:
            with h5py.File(source, "r") as file:
                _write(out, _arrays(h5py, file), -1 if file.userblock_size == MATLAB_BLOCK else 1, most, asked)
        except Exception as e:  # any class: the file is untrusted
            out.seek(0)
            out.truncate()
            _line(out, {"error": _text(e)})


def _write(out: IO[bytes], found: dict[str, Any], turn: int, most: int, asked: str) -> None:
    """Write the list of all arrays and the values of those that fit; MATLAB stores columns first: `turn` is -1."""
    shapes = {name: [int(n) for n in array.shape[::turn]] for name, array in found.items()}
    _line(out, {"arrays": [[name, shapes[name], _unit(array)] for name, array in found.items()]})
    for name, array in found.items():
        if asked not in ("", name) or len(shapes[name]) not in (1, 2) or array.nbytes > most:
            continue
        most -= array.nbytes
        try:
            values = np.asarray(array[()])
        except Exception as e:  # as above
            _line(out, {"name": name, "error": _text(e)})
        else:
            _line(out, {"name": name})
            np.save(out, values.T if turn < 0 else values, allow_pickle=False)


def _line(out: IO[bytes], told: dict[str, Any]) -> None:
    out.write(json.dumps(told).encode() + b"\n")


def _text(e: Exception) -> str:
    return " ".join(str(e).split())[:100] or type(e).__name__


def _arrays(h5py: Any, file: Any) -> dict[str, Any]:
    """Return the arrays of real numbers that lie in the file itself; links to other files are not followed."""
    found: dict[str, Any] = {}

    def collect(group: Any, prefix: str, depth: int) -> None:
        for key in group:
            if len(found) >= MOST_ARRAYS or depth > MOST_DEPTH:
                return
            if key.startswith("#") or not isinstance(group.get(key, getlink=True), h5py.HardLink):
                continue
            item = group[key]
            if isinstance(item, h5py.Group):
                collect(item, f"{prefix}{key}/", depth + 1)
            elif isinstance(item, h5py.Dataset) and not item.is_virtual and not item.external:
                found[prefix + key] = item

    collect(file, "", 0)
    return {name: a for name, a in found.items() if a.dtype.kind in "biuf" and a.attrs.get("MATLAB_class") != b"char"}


def _unit(array: Any) -> str:
    for key in ("units", "unit", "Units", "Unit"):
        if key in array.attrs:
            value = array.attrs[key]
            return value.decode("utf-8", "replace") if isinstance(value, bytes) else str(value)
    return ""


if __name__ == "__main__":
    main(sys.argv[1], sys.argv[2], int(sys.argv[3]), *sys.argv[4:])
