"""Reproduction of papers. `reproduce(name)` returns a table of the printed numbers and of our results.

Each row of the table has up to three numbers: the number that the paper prints, the result of a literal replica (the
method exactly as the paper describes it), and "ours", the result of the corrected and improved method of this project.
Each paper or data set has one module with the name in `PAPERS` and a function ``table(data, progress) -> Report``. If a
module needs a file or an optional package, it also has a function ``check(data)``. The modules of the four papers also
have a function ``quick()``, which returns the table rows that can be computed in seconds.
"""

import importlib
from collections.abc import Callable
from pathlib import Path
from types import ModuleType

from threadpoolctl import threadpool_limits

from hystfmu.base import InputError, extras
from papers.table import Report, Row

__all__ = ["PAPERS", "Report", "Row", "missing", "quick", "reproduce"]

PAPERS: dict[str, str] = {
    "zhao_tan_2008": "hysteretic operator and 2-12-1 network, KP model, inverse in cascade",
    "shen_ma_2017": "constraint factor, odd polynomial and 2-5-1 network against weighted plays, N up to 5000",
    "ipmc_bfbnn": "polynomial of lagged input and auxiliary function, recursive least squares with dead zone",
    "yu_alici_2005_smc": "network on (u, du/dt), its inverse, sliding mode; against H -> G0(s) identified",
    "boucwen_benchmark": "oscillator with a Bouc-Wen force: grey box, structured Duhem, black box, published results",
    "dbo_piezo": "measured piezo stack, protocol P1: every model; needs --data",
    "fresh_plants": "random plants, seeds fixed and drawn at run time: models and inverses on held-out signals",
    "loops": "the shipped loops: tracking and margins in every corner, the stage, adaptation, speed of a study",
}
NEEDS_DATA = ("dbo_piezo",)
"""Names that have only the published numbers without measured data."""


def missing(name: str, data: str | Path | None = None) -> str:
    """Return one line that names the missing data or packages for a paper or data set, or "" if nothing is missing.

    `name` is a key of `PAPERS`. `data` is the folder with the measured data. Call this function before a long
    computation.

    Raises
    ------
    InputError
        The name is unknown.
    """
    module = _module(name)
    try:
        with extras(name):
            getattr(module, "check", lambda data: None)(None if data is None else Path(data))
    except InputError as e:
        return str(e)
    return ""


def reproduce(
    name: str,
    data: str | Path | None = None,
    progress: Callable[[float], None] = lambda fraction: None,
    full: bool = False,
) -> Report:
    """Compute the table of one paper or data set.

    Parameters
    ----------
    name : str
        Key of `PAPERS`.
    data : path, optional
        Folder with the measured data. It is used only if the table contains results for measured data.
    progress : function
        Function that is called with the completed fraction of the work, 0 to 1.
    full : bool
        True computes all variants in the paper, such as all numbers of neurons. False computes fewer variants.

    Raises
    ------
    InputError
        The name is unknown, or data are missing.
    """
    module = _module(name)
    with extras(name), threadpool_limits(1):  # see hystfmu.identify.fit
        more = getattr(module, "FULL", {}) if full else {}
        report: Report = module.table(None if data is None else Path(data), progress, **more)
    return report


def quick(name: str) -> tuple[Row, ...]:
    """Compute the table rows of a paper that take only seconds: tests of equations, lemmas and statements.

    Parameters
    ----------
    name : str
        Key of `PAPERS`. Only the four papers have such rows.

    Raises
    ------
    InputError
        The name is unknown, or the paper has no such rows.
    """
    module = _module(name)
    if not hasattr(module, "quick"):
        raise InputError(f"The paper must have rows that take seconds. Got {name!r} instead.")
    with threadpool_limits(1):
        return tuple(module.quick())


def _module(name: str) -> ModuleType:
    if name not in PAPERS:
        raise InputError(f"The paper must be one of {', '.join(PAPERS)}. Got {name!r} instead.")
    with extras(name):
        return importlib.import_module(f"papers.{name}")
