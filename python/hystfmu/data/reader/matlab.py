"""MAT files of version 5: numeric arrays only, unpacked within a limit.

The parser is written here: that of scipy is native code which an untrusted file can crash, and takes long to load.
Format: MathWorks, MAT-File Format, level 5.
"""

from __future__ import annotations

import math
import struct
import zlib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from hystfmu.base.errors import InputError
from hystfmu.data.reader.arrays import Named, table_of
from hystfmu.data.reader.table import Table

HEADER, TAG = 128, 8
MATRIX, COMPRESSED = 14, 15  # types of elements
STORED = {1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 9: "f8", 12: "i8", 13: "u8"}
NUMERIC = {6: "f8", 7: "f4", 8: "i1", 9: "u1", 10: "i2", 11: "u2", 12: "i4", 13: "u4", 14: "i8", 15: "u8"}  # classes
OTHERS = {1: "cell", 2: "struct", 3: "object", 4: "char", 5: "sparse", 16: "function", 17: "opaque"}


class _Damaged(ValueError):
    """Bytes that are no MAT file."""


@dataclass(frozen=True)
class _Array:
    """An array in a file: its class, and the elements of its values as they are stored."""

    name: str
    kind: int
    shape: tuple[int, ...]
    parts: list[tuple[int, memoryview]]  # real and imaginary
    order: str

    def values(self) -> np.ndarray:
        """Return the real values in the shape of the array.

        Raises
        ------
        _Damaged
            They are not as many as the shape says, or no numbers.
        """
        stored, content = self.parts[0] if self.parts else (0, b"")
        if stored not in STORED:
            raise _Damaged(f"values of type {stored} in {self.name!r}")
        count, given = math.prod(self.shape), len(content) // int(STORED[stored][1])
        if count != given:
            raise _Damaged(f"{given} values for {count} in {self.name!r}")
        values = np.frombuffer(content, self.order + STORED[stored], count).reshape(self.shape, order="F")
        with np.errstate(invalid="ignore"):  # MATLAB stores whole numbers small, never the other way round
            return values.astype(NUMERIC[self.kind])


def is_matlab(content: bytes) -> bool:
    """Return whether the bytes are a MAT file of version 5."""
    return content[:6] == b"MATLAB" and content[126:128] in (b"IM", b"MI")


def matlab(content: bytes, path: str | Path, most: int) -> Table:
    """Read the numeric arrays of a MAT file.

    Raises
    ------
    InputError
        A damaged file, one that unpacks to more than `most` bytes, no numeric arrays.
    """
    try:
        found = {a.name: a for a in _arrays(content, path, most)}
    except _Damaged as e:
        raise _refused(path, e) from None
    arrays = [Named(a.name, a.shape) for a in found.values() if a.kind in NUMERIC]
    if not arrays and found:
        first = next(iter(found.values()))
        raise InputError(
            f"{path}: The file must have arrays of numbers. Got {first.name!r} of class {OTHERS[first.kind]}: save its "
            "fields as variables, e.g. save('-struct', ...)."
        )

    def read(name: str) -> np.ndarray:
        if len(found[name].parts) > 1:
            raise InputError(f"{path}: The array {name!r} must hold real numbers. Got complex ones instead.")
        try:
            return found[name].values()
        except _Damaged as e:
            raise _refused(path, e) from None

    return table_of(path, "MAT", arrays, read, most)


def _arrays(content: bytes, path: str | Path, most: int) -> Iterator[_Array]:
    """Yield the arrays of a file that have a name; packed ones are unpacked."""
    order = "<" if content[126:128] == b"IM" else ">"
    size = HEADER
    for stored, element in _elements(memoryview(content)[HEADER:], order):
        unpacked = _unpacked(element, most - size) if stored == COMPRESSED else element
        size += len(unpacked)
        if size > most:
            raise InputError(f"{path}: The file must have at most {most} bytes when unpacked. Got more.")
        inner = _elements(memoryview(unpacked), order) if stored == COMPRESSED else [(stored, element)]
        for kind, matrix in inner:
            if kind == MATRIX and (array := _array(matrix, order)) is not None:
                yield array


def _unpacked(element: memoryview, most: int) -> bytes:
    """Return what a packed element holds, one byte more than `most` at most."""
    unpacker = zlib.decompressobj()
    try:
        found = unpacker.decompress(element, max(most, 0) + 1)
    except zlib.error as e:
        raise _Damaged(str(e)) from None
    if not unpacker.eof and len(found) <= most:
        raise _Damaged("one that breaks off")
    return found


def _elements(content: memoryview, order: str) -> Iterator[tuple[int, memoryview]]:
    """Yield type and content of the elements that stand one after the other."""
    at = 0
    while at + TAG <= len(content):
        stored, length = struct.unpack_from(f"{order}II", content, at)
        if stored >> 16:  # a small element holds its up to four bytes in the tag
            stored, length = stored & 0xFFFF, stored >> 16
            if length > TAG // 2:
                raise _Damaged(f"a small element of {length} bytes")
            yield stored, content[at + TAG // 2 : at + TAG // 2 + length]
            at += TAG
            continue
        if at + TAG + length > len(content):
            raise _Damaged("one that breaks off")
        yield stored, content[at + TAG : at + TAG + length]
        at += TAG + length + (0 if stored == COMPRESSED else -length % TAG)


def _array(matrix: memoryview, order: str) -> _Array | None:
    """Read class, shape, name and elements of an array; None for one without name, which a file needs for itself."""
    elements = _elements(matrix, order)
    kind = _integers(elements, order)[0] & 0xFF
    if kind not in NUMERIC and kind not in OTHERS:
        raise _Damaged(f"an array of class {kind}")
    shape = () if OTHERS.get(kind) == "opaque" else _integers(elements, order)
    stored, name = next(elements, (0, b""))
    if stored not in (1, 2, 16):
        raise _Damaged("an array without a name")
    if not len(name):
        return None
    parts = list(elements) if kind in NUMERIC else []
    return _Array(bytes(name).decode("utf-8", "replace"), kind, shape, parts, order)


def _integers(elements: Iterator[tuple[int, memoryview]], order: str) -> tuple[int, ...]:
    """Return the next element, one of integers: flags or a shape."""
    stored, content = next(elements, (0, b""))
    if stored not in (5, 6) or not len(content) or len(content) % 4:
        raise _Damaged("an array without class or shape")
    return struct.unpack(f"{order}{len(content) // 4}{'i' if stored == 5 else 'I'}", content)


def _refused(path: str | Path, e: _Damaged) -> InputError:
    return InputError(f"{path}: The file must be a whole MAT file. Got {e}.")
