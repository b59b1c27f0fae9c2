"""Existing files that a command may replace: files that the command wrote, and with --force all files.

Writing the same content again is always allowed. From Python, `save` and `export` always replace a file.
"""

from __future__ import annotations

import os
import re
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, field
from pathlib import Path

from hystfmu.base.errors import InputError

_CHUNK = 2**20


@dataclass(frozen=True)
class _Rule:
    """Files that the running command may replace."""

    force: bool
    own: set[Path] = field(default_factory=set)  # files, and folders with all that is in them


@dataclass(frozen=True)
class _New:
    """A written file that does not have its final name yet."""

    file: Path
    target: Path
    shown: str
    apart: re.Pattern[bytes] | None


_RULE: ContextVar[_Rule | None] = ContextVar("rule", default=None)
_WAITING: ContextVar[list[_New] | None] = ContextVar("waiting", default=None)


@contextmanager
def keeping(force: bool) -> Iterator[None]:
    """Refuse to replace files with different content in this context, unless `force`."""
    before = _RULE.set(_Rule(force))
    try:
        yield
    finally:
        _RULE.reset(before)


def own(*paths: str | Path) -> None:
    """Allow replacement of these files, and of all files in these folders.

    The command wrote these files, or must change them.
    """
    if rule := _RULE.get():
        rule.own.update(_real(p) for p in paths)


def may_replace(path: str | Path) -> bool:
    """Return whether the file at `path` may be replaced by any content."""
    rule, real = _RULE.get(), _real(path)
    return rule is None or rule.force or not real.exists() or any(p in rule.own for p in (real, *real.parents))


def refuse_existing(*paths: str | Path) -> None:
    """Refuse existing files whose content differs in each run, before the command computes anything.

    Raises
    ------
    InputError
        One of these files exists, and the command may not replace this file.
    """
    for path in paths:
        if not may_replace(path):
            raise refusal(path)


def refusal(path: str | Path) -> InputError:
    """Return the error for a file that must not be replaced."""
    return InputError(f"{path}: exists with other content. Name another file, or replace it with --force.")


@contextmanager
def together() -> Iterator[None]:
    """Rename all files that are written in this context at its end; if the context fails, rename no file."""
    waiting: list[_New] = []
    before = _WAITING.set(waiting)
    try:
        yield
        placed = [new for new in waiting if _is_wanted(new)]
        for new in placed:
            os.replace(new.file, new.target)
            own(new.target)
    finally:
        _WAITING.reset(before)
        for new in waiting:
            new.file.unlink(missing_ok=True)


def place(file: Path, target: Path, shown: str | Path, apart: re.Pattern[bytes] | None = None) -> None:
    """Rename a written file to its final name, at once or at the end of `together`; remove an unchanged file.

    Parameters
    ----------
    file, target : Path
        Written file and final name, in the same folder.
    shown : path
        The target as the user names it.
    apart : pattern, optional
        Pattern of parts that are ignored in a comparison of contents, such as the run time of a fit.

    Raises
    ------
    InputError
        The target has other content, and the command may not replace the target.
    """
    new, waiting = _New(file, target, str(shown), apart), _WAITING.get()
    if waiting is not None:
        waiting.append(new)
    elif _is_wanted(new):
        os.replace(file, target)
        own(target)
    else:
        file.unlink()


def _is_wanted(new: _New) -> bool:
    if may_replace(new.target):
        return True
    if not _same(new.file, new.target, new.apart):
        raise refusal(new.shown)
    return False


def _same(a: Path, b: Path, apart: re.Pattern[bytes] | None) -> bool:
    if apart is not None:
        return apart.sub(b"", a.read_bytes()) == apart.sub(b"", b.read_bytes())
    if a.stat().st_size != b.stat().st_size:
        return False
    with a.open("rb") as first, b.open("rb") as second:
        while chunk := first.read(_CHUNK):
            if chunk != second.read(_CHUNK):
                return False
    return True


def _real(path: str | Path) -> Path:
    return Path(os.path.realpath(path))
