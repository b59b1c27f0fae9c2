"""Paths in a scenario file: relative to the file that states them, inside the folder of all scenarios."""

from __future__ import annotations

from pathlib import Path

from hystfmu.base.errors import InputError


def is_relative(path: str) -> bool:
    """Whether a path is relative and written with '/'."""
    return not (Path(path).is_absolute() or "\\" in path or ":" in path)


def inside(folder: Path, relative: str, where: str, scenario: Path | None = None) -> Path:
    """A path of a scenario file, which may not leave the folder of all scenarios.

    Parameters
    ----------
    folder : path
        The file that states the path is there.
    relative : str
    where : str
        Place in the file, for messages.
    scenario : path, optional
        Folder of the scenario, default `folder`; its parent holds all scenarios.

    Raises
    ------
    InputError
        Absolute path, or a path that leads out (also through a symbolic link).
    """
    if not is_relative(relative):
        raise InputError(f"{where}: must be a path relative to the scenario, with '/'; got {relative!r}")
    root = (scenario or folder).resolve().parent
    try:
        path = (folder.resolve() / relative).resolve()
    except (OSError, RuntimeError, ValueError) as e:  # links in a circle, a zero byte
        raise InputError(f"{where}: {e}; got {relative!r}") from None
    if not path.is_relative_to(root):
        raise InputError(f"{where}: must stay within the folder of the scenarios; got {relative!r}")
    return path
