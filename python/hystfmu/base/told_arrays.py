"""Arrays of an untrusted file in the form in which a confined process returns them.

The form is one line of JSON for all arrays, then a line and npy data for each array.

The processes that parse the file import this module, and load no other part of the package.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from typing import IO, Any, NamedTuple

import numpy as np

from hystfmu.base.child import limit_memory

GIGABYTES = 2.0
MOST_ARRAYS = 1000
_SECONDS = {"D": 86400.0, "h": 3600.0, "m": 60.0, "s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}


class Found(NamedTuple):
    """An array in a file, not read yet.

    Parameters
    ----------
    name : str
    shape : tuple of int
    nbytes : int
        Size of the values (bytes).
    read : function
        Function that returns the values.
    unit : str
        Unit of measure that the file states.
    first : str
        First stamp of an array of dates and clocks, whose values are seconds since this stamp.
    """

    name: str
    shape: tuple[int, ...]
    nbytes: int
    read: Callable[[], Any]
    unit: str = ""
    first: str = ""


def number(name: str, value: float, unit: str = "") -> Found:
    """Return a single number of a file, e.g. its sample rate, as an array of shape ()."""
    return Found(name, (), 8, lambda: np.float64(value), unit)


def since_first(times: np.ndarray) -> tuple[np.ndarray, str]:
    """Return times (n,) of type datetime64 as seconds since the first time, and the first time as text."""
    name, count = np.datetime_data(times.dtype)
    per_count = count * _SECONDS[name]
    counts = times.astype(np.int64)
    return (counts - counts[0]) * per_count, str(times[0])


def serve(arrays: Callable[[str], tuple[Sequence[Found], list[str]]], words: Sequence[str]) -> None:
    """Parse a file and write its result.

    Parameters
    ----------
    arrays : function
        Function that returns the arrays of a file from its path, and a remark. It may raise any exception.
    words : sequence of str
        Source, result (an existing file), maximum number of bytes of all values, and the name of one array, or none for
        all arrays.
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
    """Write the list of all arrays, and the values within the size limit."""
    _line(out, {"said": said, "arrays": [[a.name, list(map(int, a.shape)), a.unit, a.first] for a in found]})
    for a in found:
        if asked not in ("", a.name) or len(a.shape) > 2 or a.nbytes > most:
            continue
        most -= a.nbytes
        try:
            values = np.asarray(a.read())
        except Exception as e:  # as above
            _line(out, {"name": a.name, "error": _text(e)})
        else:
            _line(out, {"name": a.name})
            np.save(out, values, allow_pickle=False)


def _line(out: IO[bytes], told: dict[str, Any]) -> None:
    out.write(json.dumps(told).encode() + b"\n")


def _text(e: Exception) -> str:
    return " ".join(str(e).split())[:100] or type(e).__name__
