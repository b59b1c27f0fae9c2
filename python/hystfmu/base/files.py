"""Reading and writing files of strangers: size limits, one-line errors, nothing half-written."""

from __future__ import annotations

import os
import tempfile
import tomllib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO, Any, TypeVar

import pydantic
import tomli_w

from hystfmu.base.errors import InputError

MOST_BYTES = 256 * 2**20

M = TypeVar("M", bound=pydantic.BaseModel)


def read_bytes(path: str | Path, most: int = MOST_BYTES) -> bytes:
    """The content of a file.

    Raises
    ------
    InputError
        If it cannot be read or is larger than `most` bytes.
    """
    try:
        size = Path(path).stat().st_size
        if size > most:
            raise InputError(f"{path}: larger than {most} bytes ({size})")
        return Path(path).read_bytes()
    except OSError as e:
        raise InputError(f"{path}: {e.strerror or e}") from None


@contextmanager
def written(path: str | Path) -> Iterator[IO[bytes]]:
    """A file that is there as a whole or not at all: a temporary one beside it, then an atomic rename.

    Raises
    ------
    InputError
        It cannot be written.
    """
    path = Path(path)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        handle, name = tempfile.mkstemp(prefix=f".{path.name}.", dir=path.parent)
        try:
            with os.fdopen(handle, "wb") as f:
                yield f
            os.chmod(name, 0o644)
            os.replace(name, path)
        except BaseException:
            Path(name).unlink(missing_ok=True)
            raise
    except OSError as e:
        raise InputError(f"{path}: cannot be written: {e.strerror or e}") from None


def write_bytes(path: str | Path, content: bytes) -> None:
    """Write a file as a whole or not at all."""
    with written(path) as f:
        f.write(content)


def write_text(path: str | Path, content: str) -> None:
    """Like `write_bytes`, for text in UTF-8."""
    write_bytes(path, content.encode())


def read_toml(path: str | Path, kind: type[M], most: int = MOST_BYTES) -> M:
    """A TOML file checked against a pydantic model.

    Raises
    ------
    InputError
        One line that names the file, the key, the rule and the value; of several errors the first and their number.
    """
    content = read_bytes(path, most)  # outside of `try`: an InputError is a ValueError, but no matter of the syntax
    try:
        data = tomllib.loads(content.decode())
    except ValueError as e:  # syntax, encoding, an integer of thousands of digits
        raise InputError(f"{path}: not a TOML file: {' '.join(str(e).split())}") from None
    except RecursionError:
        raise InputError(f"{path}: not a TOML file: arrays or tables are nested too deep") from None
    return check(data, kind, path)


def check(data: dict[str, Any], kind: type[M], path: str | Path) -> M:
    """A dictionary checked against a pydantic model.

    Raises
    ------
    InputError
        In the form of `read_toml`: the file `path`, the key, the rule and the value.
    """
    try:
        return kind.model_validate(data)
    except pydantic.ValidationError as e:
        errors = e.errors(include_url=False)
        unknown = [error for error in errors if error["type"] == "extra_forbidden"]
        first = (unknown or errors)[0]  # a key that is misspelt is missing too: the one that stands there says more
        key = ".".join(str(k) for k in first["loc"]) or "file"
        more = f" (and {len(errors) - 1} more)" if len(errors) > 1 else ""
        if unknown:
            raise InputError(f"{path}: {key}: there is no such key{more}") from None
        value = "" if first["type"] == "missing" else f"; got {str(first['input'])[:80]!r}"
        raise InputError(f"{path}: {key}: {first['msg']}{value}{more}") from None


def write_toml(path: str | Path, data: dict[str, Any], heading: str = "") -> None:
    """Write a dictionary as TOML; floats keep all their bits."""
    lines = "".join(f"# {line}\n" for line in heading.splitlines())
    write_text(path, lines + tomli_w.dumps(data))
