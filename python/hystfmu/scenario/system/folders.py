"""Folders of scenarios: shipped scenarios, and paths inside the folder of all scenarios.

Scenarios may be grouped: a folder of scenarios within the folder of all scenarios.
"""

from __future__ import annotations

from pathlib import Path

from hystfmu.base import PACKAGE
from hystfmu.base.errors import InputError

FILE = "scenario.toml"


def is_relative(path: str) -> bool:
    """Return whether a path is relative and written with '/'."""
    return not (Path(path).is_absolute() or "\\" in path or ":" in path)


def inside(folder: Path, relative: str, where: str, scenario: Path | None = None) -> Path:
    """Return a path of a scenario file in `folder`. The path must not lead out of the folder of all scenarios.

    `scenario` is the folder of the scenario, by default `folder`. Its parent contains all scenarios or a group of
    scenarios. A path that is absolute or leads out of the folder, for example through a symbolic link, is an
    InputError. Errors begin with `where`.
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
    """Return the scenarios of a group, sorted. If the folder is a scenario or has none, return the folder."""
    if (folder / FILE).exists() or not folder.is_dir():
        return [folder]
    return sorted(p.parent for p in folder.glob(f"*/{FILE}")) or [folder]


def shipped_scenarios() -> Path:
    """Return the folder of the shipped scenarios and their models; an InputError if they are not installed."""
    for folder in (PACKAGE / "_scenarios", PACKAGE.parents[1] / "scenarios"):
        if folder.is_dir():
            return folder
    raise InputError(f"no scenarios in {PACKAGE / '_scenarios'}: install the package with 'pip install .'")


def shipped_names() -> list[str]:
    """Return the names of the shipped scenarios for a command, such as ``scenarios/pid``; empty if not installed."""
    try:
        root = shipped_scenarios()
    except InputError:
        return []
    return sorted(f"scenarios/{f.parent.relative_to(root).as_posix()}" for f in root.rglob("scenario.toml"))


def here_or_shipped(path: str) -> Path:
    """Return a path; if `scenarios/...` does not exist in the current folder, return the path of the shipped one."""
    first, *inside = Path(path).parts or (".",)
    if first != "scenarios" or Path(path).exists():
        return Path(path)
    try:
        found = shipped_scenarios().joinpath(*inside)
    except InputError:
        return Path(path)
    return found if found.exists() else Path(path)
