"""Location of the scenarios and studies of a command line: here, or among those that HystFMU ships."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from hystfmu.base.errors import InputError, meant, meant_file
from hystfmu.report.verbosity import echo


def found(paths: Sequence[str]) -> list[Path]:
    """Return scenarios or studies; shipped ones by their names in the repository.

    A line on stderr states their folder.

    Raises
    ------
    InputError
        A path does not exist; the error suggests similar names.
    """
    from hystfmu.scenario.system.folders import here_or_shipped, shipped_names, shipped_scenarios

    places = [here_or_shipped(p) for p in paths]
    for p, place in zip(paths, places, strict=True):
        if not place.exists():
            raise InputError(f"{p}: No such file or directory.{meant_file(p) or meant(p, shipped_names())}")
    if any(place != Path(p) for place, p in zip(places, paths, strict=True)):
        echo(f"scenarios are those that HystFMU ships, in {shipped_scenarios()}", err=True)
    return places


def everything() -> list[Path]:
    """Return the folders of all scenarios in ./scenarios, or of the shipped scenarios if this folder does not exist.

    Raises
    ------
    InputError
        There are none.
    """
    (root,) = found(["scenarios"])
    files = [f for depth in ("*", "*/*") for f in root.glob(f"{depth}/scenario.toml")]
    if not files:
        raise InputError("the current folder has no scenarios/*/scenario.toml")
    return sorted(f.parent for f in files)


def refuse_shipped(paths: Sequence[Path]) -> None:
    """Refuse to write beside scenarios that were installed with the package.

    Raises
    ------
    InputError
        One of the paths is such a scenario.
    """
    from hystfmu.base import PACKAGE

    for path in paths:
        if PACKAGE in path.parents:
            raise InputError(f"--record writes beside a scenario.toml. Copy {path} to a folder of your own first.")
