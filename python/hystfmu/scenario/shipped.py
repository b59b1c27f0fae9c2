"""Location of the shipped scenarios: installed with the package, or in the checkout that it runs from."""

from __future__ import annotations

from pathlib import Path

from hystfmu.base import PACKAGE
from hystfmu.base.errors import InputError


def shipped_scenarios() -> Path:
    """The folder that holds a folder for each scenario, and their models.

    Raises
    ------
    InputError
        The package was installed without them.
    """
    for folder in (PACKAGE / "_scenarios", PACKAGE.parents[1] / "scenarios"):
        if folder.is_dir():
            return folder
    raise InputError(f"no scenarios in {PACKAGE / '_scenarios'}: install the package with 'pip install .'")


def shipped_names() -> list[str]:
    """Names of the shipped scenarios as a command takes them, ``scenarios/pid`` and so on; none without them."""
    try:
        root = shipped_scenarios()
    except InputError:
        return []
    return sorted(f"scenarios/{f.parent.relative_to(root).as_posix()}" for f in root.rglob("scenario.toml"))


def here_or_shipped(path: str) -> Path:
    """Return a path unchanged, or the shipped one if `scenarios/...` does not exist in the current folder."""
    first, *inside = Path(path).parts or (".",)
    if first != "scenarios" or Path(path).exists():
        return Path(path)
    try:
        found = shipped_scenarios().joinpath(*inside)
    except InputError:
        return Path(path)
    return found if found.exists() else Path(path)
