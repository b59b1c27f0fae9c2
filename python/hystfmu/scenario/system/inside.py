"""Paths in a scenario file: relative to the file that states them, inside the folder of all scenarios.

Scenarios may be grouped: a folder of scenarios within the folder of all scenarios.
"""

from __future__ import annotations

from pathlib import Path

from hystfmu.base.errors import InputError

FILE = "scenario.toml"


def is_relative(path: str) -> bool:
    """Return whether a path is relative and written with '/'."""
    return not (Path(path).is_absolute() or "\\" in path or ":" in path)


def inside(folder: Path, relative: str, where: str, scenario: Path | None = None) -> Path:
    """Return a path of a scenario file, which must not lead out of the folder of all scenarios.

    Parameters
    ----------
    folder : path
        Folder of the file that states the path.
    relative : str
    where : str
        Place in the file, for messages.
    scenario : path, optional
        Folder of the scenario, default `folder`; its parent holds all scenarios, or is a group of them.

    Raises
    ------
    InputError
        The path is absolute or leads out of the folder (also through a symbolic link).
    """
    if not is_relative(relative):
        raise InputError(f"{where}: must be a path relative to the scenario, with '/'; got {relative!r}")
    root = _root((scenario or folder).resolve())
    try:
        path = (folder.resolve() / relative).resolve()
    except (OSError, RuntimeError, ValueError) as e:  # links in a circle, a zero byte
        raise InputError(f"{where}: {e}; got {relative!r}") from None
    if not path.is_relative_to(root):
        raise InputError(f"{where}: must stay within the folder of the scenarios; got {relative!r}")
    return path


def _root(scenario: Path) -> Path:
    """Return the folder of all scenarios: the parent of a scenario, or of its group."""
    group = scenario.parent
    if (group / FILE).exists():
        return group
    beside = (p.parent for p in group.parent.glob(f"*/{FILE}"))
    return group.parent if any(p != group for p in beside) else group


def scenario_folders(folder: Path) -> list[Path]:
    """The folder itself if it is a scenario, else the scenarios of a group, sorted; the folder if there are none."""
    if (folder / FILE).exists() or not folder.is_dir():
        return [folder]
    return sorted(p.parent for p in folder.glob(f"*/{FILE}")) or [folder]
