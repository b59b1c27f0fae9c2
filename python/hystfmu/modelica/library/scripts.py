"""The scripts for OpenModelica: a check of the library, and a simulation of every model of a package."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import PurePath

from hystfmu.modelica.library.shelf import REALISATIONS

_FOLDER = PurePath("Resources", "Scripts", "OpenModelica")
_WHERE = "run with omc in the folder that holds HystFMU."
_LOAD = 'loadFile("HystFMU/package.mo"); getErrorString();'


def scripts(files: Iterable[PurePath]) -> dict[PurePath, str]:
    """Every script for the .mo files of a library, all relative to its folder."""
    models = sorted(".".join(f.with_suffix("").parts) for f in files if f.stem != "package")
    operators = [m for r in REALISATIONS for m in models if m.startswith(f"Validation.{r}.")]
    examples = [m for m in models if m.startswith("Examples.")]
    return {
        _FOLDER / "Check.mos": _script("Checks the whole library", ["checkAllModelsRecursive(HystFMU)"]),
        _FOLDER / "Examples.mos": _script("Simulates every example", _simulations(examples)),
        _FOLDER / "Operators.mos": _script(
            "Simulates the Validation models of every operator", _simulations(operators)
        ),
    }


def _simulations(models: list[str]) -> list[str]:
    return [f"simulate(HystFMU.{m})" for m in models]


def _script(what: str, calls: list[str]) -> str:
    return "\n".join([f"// {what}: {_WHERE}", _LOAD, *(f"{c}; getErrorString();" for c in calls), ""])
