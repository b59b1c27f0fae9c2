"""Reader of MAT files of version 5: numeric arrays, also inside structs and cells, with a limited decompressed size.

In recordings of dSPACE and Simulink, a struct contains a signal and its name. The signal becomes a column with this
name.

This module contains its own parser, because the parser of scipy loads slowly and is native code that an untrusted file
can crash. The format is defined in MathWorks, MAT-File Format, level 5.
"""

from __future__ import annotations

import math
import struct
import zlib
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from hystfmu.base.errors import InputError
from hystfmu.data.reader.arrays import Named, table_of
from hystfmu.data.reader.table import Table, stated_step

HEADER, TAG = 128, 8
MATRIX, COMPRESSED = 14, 15  # types of data elements
STORED = {1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 9: "f8", 12: "i8", 13: "u8"}
NUMERIC = {6: "f8", 7: "f4", 8: "i1", 9: "u1", 10: "i2", 11: "u2", 12: "i4", 13: "u4", 14: "i8", 15: "u8"}  # by class
CELL, STRUCT, CHAR = 1, 2, 4
MOST_DEPTH, LEAST_COLUMNS = 8, 2
OTHERS = {1: "cell", 2: "struct", 3: "object", 4: "char", 5: "sparse", 16: "function", 17: "opaque"}


class _Damaged(ValueError):
    """The content is not a valid MAT file."""


@dataclass(frozen=True)
class _Array:
    """An array in a MAT file, with its class and the stored elements that contain its values."""

    name: str
    kind: int
    shape: tuple[int, ...]
    parts: list[tuple[int, memoryview]]  # real and imaginary part
    order: str
    unit: str = ""

    def values(self) -> np.ndarray:
        """Return the real values in the shape of the array.

        Raises
        ------
        _Damaged
            The number of values differs from the shape, or the values are not numbers.
        """
        stored, content = self.parts[0] if self.parts else (0, b"")
        if stored not in STORED:
            raise _Damaged(f"values of type {stored} in {self.name!r}")
        count, given = math.prod(self.shape), len(content) // int(STORED[stored][1])
        if count != given:
            raise _Damaged(f"{given} values for {count} in {self.name!r}")
        values = np.frombuffer(content, self.order + STORED[stored], count).reshape(self.shape, order="F")
        with np.errstate(invalid="ignore"):  # MATLAB may store integers in a smaller type than the class of the array
            return values.astype(NUMERIC[self.kind])


def is_matlab(content: bytes) -> bool:
    """Return whether the content of a file is a MAT file of version 5."""
    return content[:6] == b"MATLAB" and content[126:128] in (b"IM", b"MI")


def matlab(content: bytes, path: str | Path, most: int) -> Table:
    """Return a table of the numeric arrays in a MAT file.

    Raises
    ------
    InputError
        The file is damaged, has more than `most` bytes after decompression, or contains no numeric arrays.
    """
    try:
        whole = list(_arrays(content, path, most))
        found = {a.name: a for a in whole if a.kind in NUMERIC}
        if sum(math.prod(a.shape) > 1 for a in found.values()) < LEAST_COLUMNS:  # enough arrays: ignore structs
            for a in (a for outer in whole if outer.kind not in NUMERIC for a in _leaves(outer)):
                found[a.name if a.name not in found else f"{a.name} #{len(found)}"] = a
    except _Damaged as e:
        raise _refused(path, e) from None
    arrays = [Named(name, _even(a.shape), a.unit) for name, a in found.items() if a.kind in NUMERIC]
    if not arrays and whole:
        first = whole[0]
        raise InputError(
            f"{path}: The file must have arrays of numbers. Got {first.name!r} of class {OTHERS[first.kind]}: save its "
            "values as variables, e.g. t = {first.name}.Time; save('run.mat', 't', 'u', 'y')."
        )

    def read(name: str) -> np.ndarray:
        if len(found[name].parts) > 1:
            raise InputError(f"{path}: The array {name!r} must hold real numbers. Got complex ones instead.")
        try:
            return found[name].values().reshape(_even(found[name].shape), order="F")
        except _Damaged as e:
            raise _refused(path, e) from None

    return table_of(path, "MAT", arrays, read, most)


def _arrays(content: bytes, path: str | Path, most: int) -> Iterator[_Array]:
    """Yield the arrays of a file that have a name, decompressed if needed."""
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
    """Return the decompressed content of an element, at most `most` + 1 bytes."""
    unpacker = zlib.decompressobj()
    try:
        found = unpacker.decompress(element, max(most, 0) + 1)
    except zlib.error as e:
        raise _Damaged(str(e)) from None
    if not unpacker.eof and len(found) <= most:
        raise _Damaged("one that breaks off")
    return found


def _elements(content: memoryview, order: str) -> Iterator[tuple[int, memoryview]]:
    """Yield type and content of consecutive data elements."""
    at = 0
    while at + TAG <= len(content):
        stored, length = struct.unpack_from(f"{order}II", content, at)
        if stored >> 16:  # a small element contains its data, at most four bytes, in the tag
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


def _even(shape: tuple[int, ...]) -> tuple[int, ...]:
    """Return the shape of an array without dimensions of length 1 before the last dimension.

    Simulink stores signals with the shape 1 x 1 x n.
    """
    return shape if len(shape) < 3 else tuple(n for n in shape if n != 1) or (1,)


def _array(matrix: memoryview, order: str, inner: bool = False) -> _Array | None:
    """Return an array with its class, shape, name and elements; None for an internal array without name.

    `order` is the byte order. With `inner`, the array is part of a struct or of a cell array, and has no name.
    """
    if inner and not len(matrix):
        return None  # an empty array
    elements = _elements(matrix, order)
    kind = _integers(elements, order)[0] & 0xFF
    if kind not in NUMERIC and kind not in OTHERS:
        raise _Damaged(f"an array of class {kind}")
    shape = () if OTHERS.get(kind) == "opaque" else _integers(elements, order)
    stored, name = next(elements, (0, b""))
    if stored not in (1, 2, 16):
        raise _Damaged("an array without a name")
    if not inner and not len(name):
        return None
    parts = list(elements) if kind in NUMERIC or kind in (CELL, STRUCT, CHAR) else []
    return _Array(bytes(name).decode("utf-8", "replace"), kind, shape, parts, order)


def _leaves(array: _Array, depth: int = 0) -> Iterator[_Array]:
    """Yield the arrays inside a struct or a cell array, named after their fields; yield another array unchanged."""
    if array.kind not in (CELL, STRUCT):
        yield array
        return
    if depth > MOST_DEPTH:
        return
    for k, element in enumerate(_members(array)):
        base = array.name if len(array.parts) == 1 or math.prod(array.shape) == 1 else f"{array.name}({k + 1})"
        words = {key.lower(): _text(a) for key, a in element.items() if a.kind == CHAR}
        title, unit = next((words[w] for w in ("name", "label") if words.get(w)), ""), words.get("unit", "")
        for key, a in element.items():
            named = f"{base}/{key}" if key else base
            if key.lower() in ("data", "values") and a.kind in NUMERIC:
                clock = f"{base[:-2]}/time" if base.endswith("/X") else ""  # dSPACE
                yield replace(a, name=clock or title or named, unit=unit)
            elif a.kind in (CELL, STRUCT):
                yield from _leaves(replace(a, name=named), depth + 1)
            elif a.kind in NUMERIC and (math.prod(a.shape) > 1 or stated_step(key, 1.0)):
                yield replace(a, name=named)


def _members(array: _Array) -> Iterator[dict[str, _Array]]:
    """Yield the elements of a struct array or of a cell array, each as a dictionary of its fields.

    The field of a cell has an empty name.
    """
    parts = array.parts
    names = [""]
    if array.kind == STRUCT:
        if len(parts) < 2 or len(parts[0][1]) != 4:
            raise _Damaged(f"a struct {array.name!r} without fields")
        (length,) = struct.unpack(f"{array.order}i", parts[0][1])
        text = bytes(parts[1][1])
        if length <= 0 or len(text) % length:
            raise _Damaged(f"a struct {array.name!r} without fields")
        names = [text[k : k + length].split(b"\0")[0].decode("utf-8", "replace") for k in range(0, len(text), length)]
        parts = parts[2:]
    for at in range(0, len(parts), max(len(names), 1)):
        found: dict[str, _Array] = {}
        for name, (stored, content) in zip(names, parts[at : at + len(names)], strict=False):
            if stored == MATRIX and (inner := _array(content, array.order, True)) is not None:
                found[name] = inner
        yield found


def _text(array: _Array) -> str:
    """Return the text of a char array."""
    if not array.parts or array.parts[0][0] not in (1, 2, 4, 16, 17):
        return ""
    stored, content = array.parts[0]
    wide = "utf-16-le" if array.order == "<" else "utf-16-be"
    return bytes(content).decode(wide if stored in (4, 17) else "utf-8", "replace").strip()


def _integers(elements: Iterator[tuple[int, memoryview]], order: str) -> tuple[int, ...]:
    """Return the integers of the next data element, which contains flags or a shape."""
    stored, content = next(elements, (0, b""))
    if stored not in (5, 6) or not len(content) or len(content) % 4:
        raise _Damaged("an array without class or shape")
    return struct.unpack(f"{order}{len(content) // 4}{'i' if stored == 5 else 'I'}", content)


def _refused(path: str | Path, e: _Damaged) -> InputError:
    return InputError(f"{path}: The file must be a whole MAT file. Got {e}.")
