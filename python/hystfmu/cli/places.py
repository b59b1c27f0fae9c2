"""Find scenarios and studies of a command line in the current folder or among the shipped scenarios."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from hystfmu.base.errors import InputError, meant, meant_file
from hystfmu.report.terminal import echo


def found(paths: Sequence[str]) -> list[Path]:
    """Return the paths of scenarios or studies; a shipped one has its name in the repository.

    If a shipped scenario or study is used, a line on stderr states its folder.

    Raises
    ------
    InputError
        A path does not exist; the error suggests similar names.
    """
    from hystfmu.scenario.system.spec import here_or_shipped, shipped_names, shipped_scenarios

    places = [here_or_shipped(p) for p in paths]
    for p, place in zip(paths, places, strict=True):
        if not place.exists():
            raise InputError(f"{p}: No such file or directory.{meant_file(p) or meant(p, shipped_names())}")
    if any(place != Path(p) for place, p in zip(places, paths, strict=True)):
        echo(f"using the scenarios that HystFMU ships, in {shipped_scenarios()}", err=True)
    return places


def everything() -> list[Path]:
    """Return the folders of all scenarios in ./scenarios, or of the shipped scenarios if this folder does not exist.

    Raises
    ------
    InputError
        There is no scenario.
    """
    (root,) = found(["scenarios"])
    files = [f for depth in ("*", "*/*") for f in root.glob(f"{depth}/scenario.toml")]
    if not files:
        raise InputError("the current folder has no scenarios/*/scenario.toml")
    return sorted(f.parent for f in files)


def refuse_shipped(paths: Sequence[Path]) -> None:
    """Raise an error if a command would write into the folder of an installed scenario.

    Raises
    ------
    InputError
        One of the paths is a scenario that was installed with the package.
    """
    from hystfmu.base import PACKAGE

    for path in paths:
        if PACKAGE in path.parents:
            raise InputError(f"--record writes beside a scenario.toml. Copy {path} to a folder of your own first.")
