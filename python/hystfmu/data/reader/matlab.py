"""MAT files of version 5 by scipy: numeric arrays only, unpacked within a limit."""

from __future__ import annotations

import io
import struct
import warnings
import zlib
from pathlib import Path
from typing import Any

import numpy as np

from hystfmu.base.errors import InputError
from hystfmu.data.reader.arrays import Named, table_of
from hystfmu.data.reader.table import Table

HEADER, TAG = 128, 8
COMPRESSED = 15  # type of a packed element
NUMERIC = ("double", "single", "int8", "uint8", "int16", "uint16", "int32", "uint32", "int64", "uint64", "logical")


def is_matlab(content: bytes) -> bool:
    """Whether the bytes are a MAT file of version 5."""
    return content[:6] == b"MATLAB" and content[126:128] in (b"IM", b"MI")


def matlab(content: bytes, path: str | Path, most: int) -> Table:
    """Read the numeric arrays of a MAT file.

    Raises
    ------
    InputError
        A damaged file, one that unpacks to more than `most` bytes, no numeric arrays.
    """
    from scipy.io import loadmat, whosmat

    plain = _unpacked(content, path, most)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            listed = whosmat(_file(plain))
    except Exception as e:  # any class: the parser is not ours, and the file is untrusted
        raise _damaged(path, e) from None
    arrays = [Named(name, shape) for name, shape, kind in listed if kind in NUMERIC]
    if not arrays and listed:
        name, _, kind = listed[0]
        raise InputError(
            f"{path}: The file must have arrays of numbers. Got {name!r} of class {kind}: save its fields as "
            "variables, e.g. save('-struct', ...)."
        )

    def read(name: str) -> np.ndarray:
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                return np.asarray(loadmat(_file(plain), variable_names=[name])[name])
        except Exception as e:  # as above
            raise _damaged(path, e) from None

    return table_of(path, "MAT", arrays, read, most)


def _unpacked(content: bytes, path: str | Path, most: int) -> bytes:
    """Replace packed elements by what they hold."""
    order = "<" if content[126:128] == b"IM" else ">"
    parts, at, size = [content[:HEADER]], HEADER, HEADER
    while at + TAG <= len(content):
        kind, length = struct.unpack_from(f"{order}II", content, at)
        if at + TAG + length > len(content):
            raise InputError(f"{path}: The file must be a whole MAT file. Got one that breaks off.")
        if kind == COMPRESSED:
            unpacker = zlib.decompressobj()
            try:
                part = unpacker.decompress(content[at + TAG : at + TAG + length], most - size + 1)
            except zlib.error as e:
                raise _damaged(path, e) from None
            at += TAG + length
        else:
            length += -length % 8
            part, at = content[at : at + TAG + length], at + TAG + length
        size += len(part)
        if size > most:
            raise InputError(f"{path}: The file must have at most {most} bytes when unpacked. Got more.")
        parts.append(part)
    return b"".join(parts)


def _file(content: bytes) -> Any:
    """Make a file of bytes; the types of scipy name paths alone."""
    return io.BytesIO(content)


def _damaged(path: str | Path, e: Exception) -> InputError:
    text = " ".join(str(e).split())[:100] or type(e).__name__
    return InputError(f"{path}: The file must be a whole MAT file. Got: {text}.")
