"""Scripts for OpenModelica: a check of the library, and a simulation of every model of a package."""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import PurePath

from hystfmu.modelica.library.declarations import number
from hystfmu.modelica.library.shelf import REALISATIONS

_FOLDER = PurePath("Resources", "Scripts", "OpenModelica")
_WHERE = "run with omc in a folder of its own, with HystFMU or a link to it in it."
_LOAD = 'loadFile("HystFMU/package.mo"); getErrorString();'


def scripts(texts: Mapping[str, str]) -> dict[PurePath, str]:
    """Return every script by its path relative to the folder of a library, for classes by names below HystFMU."""
    operators = [m for r in REALISATIONS for m in sorted(texts) if m.startswith(f"Validation.{r}.")]
    examples = [m for m in sorted(texts) if m.startswith("Examples.")]
    return {
        _FOLDER / "Check.mos": _script("Checks the whole library", ["checkAllModelsRecursive(HystFMU)"]),
        _FOLDER / "Examples.mos": _script("Simulates every example", _simulations(examples, texts)),
        _FOLDER / "Operators.mos": _script(
            "Simulates the Validation models of every operator", _simulations(operators, texts)
        ),
    }


def _simulations(models: list[str], texts: Mapping[str, str]) -> list[str]:
    return [f"simulate(HystFMU.{m}, {_settings(texts[m])})" for m in models if not m.endswith(".package")]


def _settings(text: str) -> str:
    """Return the experiment of a model with its number of intervals, because OpenModelica truncates the quotient."""
    found = re.search(r"experiment\(StopTime = ([^,]+), Interval = ([^,]+), Tolerance = ([^)]+)\)", text)
    assert found is not None
    stop, interval, tolerance = map(float, found.groups())
    intervals = round(stop / interval)
    return f"stopTime = {number(stop)}, numberOfIntervals = {intervals}, tolerance = {number(tolerance)}"


def _script(what: str, calls: list[str]) -> str:
    return "\n".join([f"// {what}: {_WHERE}", _LOAD, *(f"{c}; getErrorString();" for c in calls), ""])
