"""Every paper end to end: `reproduce(name)` gives its table, the printed number beside a literal replica and ours.

One module per paper or data set, named as in `PAPERS`, with a function ``table(data, progress) -> Report``.
"""

from __future__ import annotations

import importlib
from collections.abc import Callable
from pathlib import Path

from threadpoolctl import threadpool_limits

from hystfmu.base.errors import InputError
from hystfmu.base.extras import extras
from hystfmu.papers.table import Report, Row

__all__ = ["PAPERS", "Report", "Row", "reproduce"]

PAPERS: dict[str, str] = {
    "zhao_tan_2008": "hysteretic operator and 2-12-1 network, KP model, inverse in cascade",
    "shen_ma_2017": "constraint factor, odd polynomial and 2-5-1 network against weighted plays, N up to 5000",
    "ipmc_bfbnn": "polynomial of lagged input and auxiliary function, recursive least squares with dead zone",
    "yu_alici_2005_smc": "network on (u, du/dt), its inverse, sliding mode; against H -> G0(s) identified",
    "boucwen_benchmark": "oscillator with a Bouc-Wen force: grey box, structured Duhem, black box, published results",
    "dbo_piezo": "measured piezo stack, protocol P1: every model; needs --data",
}
NEEDS_DATA = ("dbo_piezo",)
"""What has only the published numbers without measured data."""


def reproduce(
    name: str,
    data: str | Path | None = None,
    progress: Callable[[float], None] = lambda fraction: None,
    full: bool = False,
) -> Report:
    """The table of one paper or data set.

    Parameters
    ----------
    name : str
        A key of `PAPERS`.
    data : path, optional
        Folder with the measured data of that name, for those that need it.
    progress : function
        Called with the fraction done, 0..1.
    full : bool
        Everything the paper tried, where the default is a part of it (``FULL`` of the paper's module).

    Raises
    ------
    InputError
        Unknown name; data missing.
    """
    if name not in PAPERS:
        raise InputError(f"nothing to reproduce called {name!r}; there are: {', '.join(PAPERS)}")
    with extras(name), threadpool_limits(1):  # see hystfmu.identify.fit
        module = importlib.import_module(f"hystfmu.papers.{name}")
        more = getattr(module, "FULL", {}) if full else {}
        report: Report = module.table(None if data is None else Path(data), progress, **more)
    return report
