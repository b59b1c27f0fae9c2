"""Every paper end to end: `reproduce(name)` gives its table, the printed number beside a literal replica and ours.

One module per paper or data set, named as in `PAPERS`, with a function ``table(data, progress) -> Report``.
"""

from __future__ import annotations

import importlib
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from threadpoolctl import threadpool_limits

from hystfmu.errors import InputError

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


@dataclass(frozen=True)
class Row:
    """One quantity of a paper.

    Parameters
    ----------
    quantity : str
        What was measured, on which signal, in which unit.
    printed : float or None
        As printed in the paper; None where it prints none.
    literal : float or None
        Our literal replica of the paper's method; None where the text leaves it open.
    ours : float or None
        The corrected and improved method.
    target : float or None
        `ours` must not exceed it (or, with `at_least`, not fall below it); None where there is no target.
    at_least : bool
        The target is a lower bound.
    note : str
        Why, when a target is missed; what differs from the paper.
    """

    quantity: str
    printed: float | None = None
    literal: float | None = None
    ours: float | None = None
    target: float | None = None
    at_least: bool = False
    note: str = ""

    @property
    def met(self) -> bool | None:
        """Whether the target is met; None without a target."""
        if self.target is None or self.ours is None:
            return None
        return self.ours >= self.target if self.at_least else self.ours <= self.target

    def verdict(self) -> str:
        """`met`, or by how much the target is missed."""
        if self.met is None:
            return ""
        if self.met:
            return "met"
        assert self.ours is not None
        assert self.target is not None
        ratio = self.target / self.ours if self.at_least else self.ours / self.target
        return f"missed by a factor {ratio:.2f}"


@dataclass(frozen=True)
class Report:
    """The table of one paper."""

    name: str
    source: str
    rows: tuple[Row, ...]
    notes: tuple[str, ...] = ()

    def data(self) -> dict[str, Any]:
        """For machines."""
        rows = [{**asdict(r), "met": r.met} for r in self.rows]
        return {"name": self.name, "source": self.source, "rows": rows, "notes": list(self.notes)}

    def text(self) -> str:
        """For a terminal."""
        from hystfmu.terminal import table

        def number(x: float | None) -> str:
            return "" if x is None else f"{x:.4g}"

        def target(r: Row) -> str:
            return "" if r.target is None else f"{'>=' if r.at_least else '<='} {r.target:.4g}"

        head = ["quantity", "printed", "literal", "ours", "target", "verdict", "note"]
        rows = [
            [r.quantity, number(r.printed), number(r.literal), number(r.ours), target(r), r.verdict(), r.note]
            for r in self.rows
        ]
        return "\n".join([f"{self.name}: {self.source}", "", table(head, rows), *(f"  {n}" for n in self.notes)])


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
    module = importlib.import_module(f"hystfmu.reproduce.{name}")
    with threadpool_limits(1):  # see hystfmu.identify.fit
        more = getattr(module, "FULL", {}) if full else {}
        report: Report = module.table(None if data is None else Path(data), progress, **more)
    return report
