"""Renaming of keys and values in a TOML text: comments, order and layout do not change."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Callable
from typing import Any

Path = tuple[str, ...]
"""Keys from the top of a file down to a value; places in arrays of tables are left out."""
Rename = Callable[[Path, Any], tuple[str, Any] | None]
"""New key and value for a path with its value, or None to keep both."""

_HEADER = re.compile(r"\s*\[{1,2}([^\[\]]+)\]{1,2}\s*(?:#.*)?$")
_KEY = re.compile(
    r"""(\s*)((?:[A-Za-z0-9_-]+|"[^"]*"|'[^']*')(?:\s*\.\s*(?:[A-Za-z0-9_-]+|"[^"]*"|'[^']*'))*)\s*=\s*"""
)
_INLINE = re.compile(r"""(?<=[{,\s])([A-Za-z0-9_-]+)(\s*=\s*)("[^"\\]*"|'[^']*'|[^\s,{}\[\]"']+)""")


def renamed(table: Any, rename: Rename, path: Path = ()) -> Any:
    """Return parsed tables with other keys and values."""
    if isinstance(table, list):
        return [renamed(v, rename, path) for v in table]
    if not isinstance(table, dict):
        return table
    found = {}
    for key, value in table.items():
        new = rename((*path, key), value) or (key, value)
        found[new[0]] = renamed(new[1], rename, (*path, key))
    return found


def renamed_text(text: str, rename: Rename) -> str:
    """Return a TOML text with other keys and values; the caller parses it and compares it with `renamed`.

    It supports tables, arrays of tables, dotted keys and inline tables on one line.
    """
    header: Path = ()
    lines = []
    for line in text.splitlines(keepends=True):
        if m := _HEADER.match(line):
            header = _parts(m[1])
            new = [(rename(header[: k + 1], None) or (key,))[0] for k, key in enumerate(header)]
            if tuple(new) != header:
                line = line.replace(m[1], ".".join(new), 1)
        elif m := _KEY.match(line):
            line = _line(line, m, (*header, *_parts(m[2])), rename)
        lines.append(line)
    return "".join(lines)


def _line(line: str, m: re.Match[str], path: Path, rename: Rename) -> str:
    rest = line[m.end() :]
    if rest.startswith("{"):

        def inside(i: re.Match[str]) -> str:
            new = rename((*path, i[1]), _value(i[3]))
            return i[0] if new is None else f"{new[0]}{i[2]}{_written(new[1], i[3])}"

        new = rename(path, None)
        start = line[: m.end()] if new is None else f"{m[1]}{new[0]} = "
        return start + _INLINE.sub(inside, rest)
    value = re.match(r"""("[^"\\]*"|'[^']*'|[^\s#]+)""", rest)
    new = rename(path, _value(value[0])) if value else None
    if new is None or value is None:
        return line
    key = ".".join([*m[2].split(".")[:-1], new[0]])
    return f"{m[1]}{key} = {_written(new[1], value[0])}{rest[value.end() :]}"


def _parts(key: str) -> Path:
    """Return the keys of a dotted key."""
    table: Any = tomllib.loads(f"{key} = 0")
    found: list[str] = []
    while isinstance(table, dict):
        (name,) = table
        found.append(name)
        table = table[name]
    return tuple(found)


def _value(text: str) -> Any:
    try:
        return tomllib.loads(f"v = {text}")["v"]
    except tomllib.TOMLDecodeError:  # the first part of an array or of a text over several lines
        return None


def _written(value: Any, old: str) -> str:
    """Return a value as TOML; an unchanged value keeps its notation."""
    if value == _value(old):
        return old
    return f'"{value}"' if isinstance(value, str) else repr(value)
