"""Table of the margins of scenarios: one row for every loop that differs, with the cases that share it."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from hystfmu.base.errors import InputError
from hystfmu.report.terminal import table
from hystfmu.scenario.loop_margins import OpenedLoop, open_loop
from hystfmu.scenario.plan import plan, read

HEAD = (
    "scenario",
    "cases",
    "slopes",
    "Ms dB",
    "gain dB",
    "phase deg",
    "delay steps",
    "|S| < -3 dB to Hz",
    "noise to command",
    "Ms dB, 1 step",
    "Ms dB at largest slope, 1 step",
    "stable to steps",
)


@dataclass(frozen=True)
class LoopRow:
    """Margins of one loop.

    Attributes
    ----------
    scenario, cases : str, tuple of str
        Scenario, and its cases with this loop.
    slopes : (float, float)
        Sector of local slopes of plant over inverse along the paths of these cases.
    margins : dict
        ``stable``, and for slope 1 without further delay: ``Ms_db``, ``gain_db``, ``phase_deg``, ``delay_steps``,
        ``bandwidth_hz``, ``noise_gain`` (RMS of the command for white noise of RMS 1 at the sensor); with one step of
        delay: ``Ms_1_db``, and at the largest slope ``Ms_1_largest_db``; ``stable_to_steps``, the largest delay up to
        which the whole sector is stable.  What an unstable loop does not have is None.
    """

    scenario: str
    cases: tuple[str, ...]
    slopes: tuple[float, float]
    margins: dict[str, Any]

    def cells(self) -> list[str]:
        """Return the row as text."""
        m = self.margins
        keys = ("Ms_db", "gain_db", "phase_deg", "delay_steps", "bandwidth_hz", "noise_gain", "Ms_1_db")
        numbers = [_text(m[k]) for k in (*keys, "Ms_1_largest_db", "stable_to_steps")]
        more = f" and {len(self.cases) - 2} more" if len(self.cases) > 2 else ""
        shown = ", ".join(self.cases[:2]) + more
        return [self.scenario, shown, f"{self.slopes[0]:.2f}..{self.slopes[1]:.2f}", *numbers]


def _text(x: float | None) -> str:
    return "unstable" if x is None else f"{x:.3g}"


def margin_rows(
    paths: Sequence[str | Path], case: str | None = None, progress: Callable[[float], None] = lambda fraction: None
) -> tuple[list[LoopRow], list[str]]:
    """Compute the margins of every case of scenarios.

    Parameters
    ----------
    paths : sequence of path
        Folders of scenarios, or of groups of them.
    case : str, optional
        Only this case.
    progress : function
        Called with the fraction done.

    Returns
    -------
    rows : list of LoopRow
    refused : list of str
        A line for every case that has no margins, with its reason.

    Raises
    ------
    InputError
        Bad scenario file.
    """
    plans = plan(read(paths, {}, None), case, {}, record=True)
    systems = [(s.case.scenario, s) for p in plans for s in p.systems]
    rows, refused = [], []
    loops: list[tuple[str, list[OpenedLoop]]] = []
    for k, (name, system) in enumerate(systems):
        progress(k / (2 * len(systems)))
        try:
            found = open_loop(system)
        except InputError as e:
            refused.append(str(e))
            continue
        alike = next((group for n, group in loops if n == name and _same(group[0], found)), None)
        if alike is None:
            loops.append((name, [found]))
        else:
            alike.append(found)
    for k, (name, group) in enumerate(loops):
        rows.append(_row(name, group))
        progress(0.5 + (k + 1) / (2 * len(loops)))
    return rows, refused


def _same(a: OpenedLoop, b: OpenedLoop) -> bool:
    pairs = zip((*a.controller, *a.plant), (*b.controller, *b.plant), strict=True)
    return (a.h, a.hysteresis) == (b.h, b.hysteresis) and all(
        x.shape == y.shape and np.array_equal(x, y) for x, y in pairs
    )


def _row(name: str, group: Sequence[OpenedLoop]) -> LoopRow:
    slopes = min(o.slopes[0] for o in group), max(o.slopes[1] for o in group)
    loop = replace(group[0], slopes=slopes)
    now, late, steep = loop.margins(), loop.margins(delay=1.0), loop.margins(slopes[1], 1.0)
    to = loop.stable_to()
    found: dict[str, Any] = {"stable": now.stable}
    for key in ("Ms_db", "gain_db", "phase_deg", "delay_steps", "bandwidth_hz"):
        found[key] = getattr(now, key) if now.stable else None
    found["noise_gain"] = loop.noise_gain() if now.stable else None
    found["Ms_1_db"] = late.Ms_db if late.stable else None
    found["Ms_1_largest_db"] = steep.Ms_db if steep.stable else None
    found["stable_to_steps"] = None if math.isnan(to) else to
    return LoopRow(name, tuple(o.system.case.name for o in group), slopes, found)


def margin_text(rows: Sequence[LoopRow], refused: Sequence[str]) -> str:
    """Format the table for a terminal, then the cases without margins."""
    parts = [table(HEAD, [r.cells() for r in rows])] if rows else []
    reasons: dict[tuple[str, str], int] = {}
    for line in refused:
        title, _, why = line.partition(": ")
        key = title.partition("/")[0], why
        reasons[key] = reasons.get(key, 0) + 1
    told = (f"no margins: {name}, {n} case{'s' * (n > 1)}: {why}" for (name, why), n in reasons.items())
    return "\n".join([*parts, *told])
