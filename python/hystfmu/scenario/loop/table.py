"""Table of the margins of scenarios, with one row for all cases that have the same loop.

A loop whose gain depends on the amplitude has no linear delay margin. Its delay margin is found by simulations with an
additional delay of whole fine steps after the command. Bisection finds the largest delay for which the case does not
fail. The case fails if the run stops, if the error grows, or if the error is far above the error without this delay.
"""

import math
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from hystfmu.base import InputError
from hystfmu.report.terminal import table
from hystfmu.scenario.engine.native import Native
from hystfmu.scenario.loop.opened import DELAYS, OpenedLoop
from hystfmu.scenario.loop.opening import LoopVerdict, open_loop, stability_of, verdicts_of
from hystfmu.scenario.outcome.trace import Stopped
from hystfmu.scenario.running import plan, read
from hystfmu.scenario.system.spec import UnitSpec
from hystfmu.scenario.system.system import Link, System, build

MOST = 4  # largest additional delay (steps)

GROWTH = 1.5  # allowed growth of the error, because the errors of the two halves of a reference may differ
FAR = 0.005  # allowed additional error, as a fraction of the stroke
NAME = "further_delay"


def simulated_delay(system: System, entry: Link, growth: float = GROWTH, far: float = FAR) -> float:
    """Return the largest additional delay (steps, at most `MOST`) for which a case does not fail.

    Return NaN if the case fails without an additional delay. `entry` is the connection of the command to the units at
    the rate of the plant. `growth` is the allowed factor of the largest error from the first to the second half of the
    window of the metric. `far` is the allowed additional error due to the delay, as a fraction of the stroke.
    """
    ripple = system.case.ripple
    first = _errors(system)
    if first is None or first[1] > growth * first[0]:
        return float("nan")
    most = max(first) + far
    holds, fails = 0, MOST * ripple + 1
    while fails - holds > 1:
        n = (holds + fails) // 2
        found = _errors(_delayed(system, entry, n))
        if found is None or found[1] > growth * found[0] or max(found) > most:
            fails = n
        else:
            holds = n
    return holds / ripple


def _delayed(system: System, entry: Link, n: int) -> System:
    """Return the system with a delay of n fine steps in a connection, directly after its source in the order."""
    case, maker, reader = system.case, system.maker(entry), system.parts[entry.to]
    at = case.order.index(maker.name) + 1
    end = f"{reader.name}.{reader.inputs[entry.input]}"
    unit = UnitSpec.model_validate({"block": "delay", "dims": {"n": n}, "fine": case.ripple > 1})
    connections = case.connections | {end: f"{NAME}.y", f"{NAME}.u": case.connections[end]}
    units = case.units | {NAME: unit}
    changed = replace(case, units=units, order=(*case.order[:at], NAME, *case.order[at:]), connections=connections)
    return build(changed)


def _errors(system: System) -> tuple[float, float] | None:
    """Return the largest error over the stroke in each half of the metric window, or None if the run stopped."""
    metric = system.case.tracked
    assert metric is not None
    ends = [metric.signal, str(metric.against)]
    try:
        trace = Native(system, ends).run()
    except Stopped:
        return None
    y, r = (trace[end][trace.t >= metric.after] for end in ends)
    error = np.abs(y - r) / (metric.stroke or float(np.ptp(r)) or 1.0)
    half = len(error) // 2
    return float(error[:half].max()), float(error[half:].max())


COLUMNS = {
    "Ms_db": "Ms dB",
    "Ms_worst_db": "Ms dB in sector",
    "gain_db": "gain up dB",
    "gain_low_db": "gain down dB",
    "phase_deg": "phase deg",
    "delay_steps": "delay steps",
    "simulated_delay_steps": "delay steps, simulated",
    "bandwidth_hz": "|S| < -3 dB to Hz",
    "noise_gain": "command per noise",
    "learning": "learning factor",
    "Ms_1_db": "Ms dB, 1 step",
    "Ms_1_largest_db": "Ms dB at largest gain, 1 step",
    "stable_to_steps": "stable to steps",
}
OPTIONAL = ("simulated_delay_steps", "learning")  # columns that are empty for some loops
OF_MARGINS = ("Ms_db", "gain_db", "gain_low_db", "phase_deg", "delay_steps", "bandwidth_hz")
AT_DELAY = ("Ms_db", "Ms_worst_db", *OF_MARGINS[1:], "noise_gain", "learning")
FALLING = (
    "delay steps, simulated: the largest delay for which the simulated error does not grow, and exceeds the error "
    "without this delay by at most 0.5 % of the stroke. The other columns are valid for small signals, for which "
    "sliding mode and super-twisting have their largest gain."
)

CONDITIONAL = "conditionally stable, that is, unstable if the gain decreases by more than 'gain down'"


@dataclass(frozen=True)
class LoopRow:
    """Margins of one loop.

    Attributes
    ----------
    scenario, cases : str, tuple of str
        Scenario, and its cases with this loop.
    slopes : (float, float)
        Sector of the incremental gain along the paths of these cases.
    margins : dict
        Whether the loop is ``stable``, and the following values. A missing value is None. The first values are those
        for the nominal incremental gain without additional delay: ``Ms_db``, ``gain_db`` (upper gain margin),
        ``gain_low_db`` (lower gain margin, -inf if there is no limit), ``conditionally_stable`` (whether the lower
        margin is finite), ``phase_deg``, ``delay_steps``, ``bandwidth_hz``, ``noise_gain`` (RMS of the command for
        white noise of RMS 1 at the sensor), and ``learning`` (largest factor from the correction of a period memory in
        one period to that in the next period). ``Ms_worst_db`` is the largest peak of the sensitivity over the sector.
        ``Ms_1_db`` is the peak with one additional step of delay, and ``Ms_1_largest_db`` is this peak for the largest
        incremental gain. ``stable_to_steps`` is the largest delay up to which the whole sector is stable.
        ``simulated_delay_steps`` is the delay margin by simulation, at most 4, for a loop whose gain depends on the
        amplitude.
    at_delay : tuple of dict
        The margins for the nominal incremental gain at each delay in `DELAYS`, with ``further_steps`` (additional
        delay) and ``sector_stable``.
    """

    scenario: str
    cases: tuple[str, ...]
    slopes: tuple[float, float]
    margins: dict[str, Any]
    at_delay: tuple[dict[str, Any], ...] = field(default=())

    @property
    def stable(self) -> bool:
        """True if the loop is stable at the delay of the case, for the nominal and all other gains in the sector."""
        return bool(self.margins["stable"]) and self.margins["Ms_worst_db"] is not None

    @property
    def _shown(self) -> list[str]:
        more = f" and {len(self.cases) - 2} more" if len(self.cases) > 2 else ""
        return [self.scenario, ", ".join(self.cases[:2]) + more, f"{self.slopes[0]:.2f}..{self.slopes[1]:.2f}"]

    def cells(self, columns: Sequence[str]) -> list[str]:
        """Return the cells of the row as text."""
        cells = {k: _text(self.margins[k], k in OPTIONAL) for k in columns}
        if self.margins["simulated_delay_steps"] == MOST and "simulated_delay_steps" in cells:
            cells["simulated_delay_steps"] = f">= {MOST}"
        return [*self._shown, *cells.values()]

    def cells_at_delay(self, columns: Sequence[str]) -> list[list[str]]:
        """Return a row for each delay as text."""
        return [
            [
                *self._shown,
                f"{f['further_steps']:g}",
                *(_text(f[k], k in OPTIONAL) for k in columns),
                _word(f["sector_stable"]),
            ]
            for f in self.at_delay
        ]


def _word(stable: bool) -> str:
    return "stable" if stable else "unstable"


def _text(x: float | None, optional: bool = False) -> str:
    return ("" if optional else "unstable") if x is None else f"{x + 0.0:.3g}"


@dataclass(frozen=True)
class MarginTable:
    """Margins of scenarios, the reason for every case without margins, and a verdict for each limit."""

    rows: list[LoopRow]
    refused: list[str]
    verdicts: list[LoopVerdict]

    def __str__(self) -> str:
        return self.text()

    def text(self, delays: bool = False) -> str:
        """Return the table for a terminal, with verdicts and reasons. A loop has one row, or one row for each delay."""
        lines: list[str] = []
        if self.rows and delays:
            keys = [k for k in AT_DELAY if k not in OPTIONAL or any(r.margins[k] is not None for r in self.rows)]
            head = ["scenario", "cases", "sector", "further steps", *(COLUMNS[k] for k in keys), "whole sector"]
            lines.append(table(head, [c for r in self.rows for c in r.cells_at_delay(keys)], keys=2))
        elif self.rows:
            keys = [k for k in COLUMNS if k not in OPTIONAL or any(r.margins[k] is not None for r in self.rows)]
            head = ["scenario", "cases", "sector", *(COLUMNS[k] for k in keys)]
            lines.append(table(head, [r.cells(keys) for r in self.rows], keys=2))
            lines += [FALLING] if COLUMNS["simulated_delay_steps"] in head else []
        if found := sorted({r.scenario for r in self.rows if r.margins["conditionally_stable"]}):
            lines.append(f"{CONDITIONAL}: {', '.join(found)}")
        if self.verdicts:
            cells = [[v.scenario, v.limit, _text(v.value), f"{v.bound:g}", v.where, v.word] for v in self.verdicts]
            lines.append(table(["scenario", "limit of the loop", "value", "bound", "at", "verdict"], cells))
        return "\n".join([*lines, *_reasons(self.refused), *self.broken()])

    def broken(self) -> list[str]:
        """Return a line for every broken limit."""
        return [v.line() for v in self.verdicts if not v.within]

    def summary(self) -> dict[str, Any]:
        """Return the table as JSON types. An infinite margin is None, because JSON has no infinity."""
        verdicts = [vars(v) | {"within": v.within} for v in self.verdicts]
        loops = [
            vars(r) | {"margins": _finite(r.margins), "at_delay": [_finite(f) for f in r.at_delay]} for r in self.rows
        ]
        return {"loops": loops, "refused": self.refused, "verdicts": verdicts}


def _finite(figures: dict[str, Any]) -> dict[str, Any]:
    return {k: None if isinstance(v, float) and math.isinf(v) else v for k, v in figures.items()}


def _reasons(refused: Sequence[str]) -> list[str]:
    """Return one line for each scenario and each reason why cases have no margins."""
    parts = (line.partition(": ") for line in refused)
    reasons = Counter((title.partition("/")[0], why) for title, _, why in parts)
    return [f"no margins: {name}, {n} case{'s' * (n > 1)}: {why}" for (name, why), n in reasons.items()]


def margin_table(
    paths: Sequence[str | Path],
    case: str | Sequence[str] | None = None,
    progress: Callable[[float], None] = lambda fraction: None,
    *,
    at: str = "",
    delays: bool = False,
) -> MarginTable:
    """Compute the margins of every case of scenarios, and compare them with the stated limits.

    Parameters
    ----------
    paths : sequence of path
        Folders of scenarios, or of groups of them.
    case : str or sequence of str, optional
        Name of a case whose margins are computed. With this argument, the limits in `[margins]` are not checked.
    progress : function
        Function that is called with the completed fraction of the work, 0 to 1.
    at : str
        Signal `unit.output` at which the loops are opened. By default, the loops are opened at the input of the plant.
    delays : bool
        Whether to compute the margins also for additional delays of 1/2, 1 and 2 steps.
    """
    plans = plan(read(paths, {}, None), case, {}, record=True)
    systems = [(p, s) for p in plans for s in p.systems]
    refused: list[str] = []
    loops: dict[tuple[object, ...], list[OpenedLoop]] = {}
    opened: dict[str, dict[str, OpenedLoop | InputError]] = {p.scenario.origin: {} for p in plans}
    for k, (p, system) in enumerate(systems):
        progress(k / (2 * len(systems)))
        try:
            found = open_loop(system, at=at)
        except InputError as e:
            refused.append(str(e))
            opened[p.scenario.origin][system.case.name] = e
            continue
        loops.setdefault((system.case.scenario, *found.key), []).append(found)
        opened[p.scenario.origin][system.case.name] = found
    rows = []
    for k, group in enumerate(loops.values()):
        rows.append(_row(group, delays))
        progress(0.5 + (k + 1) / (2 * len(loops)))
    lost = {id(o) for row, group in zip(rows, loops.values(), strict=True) if not row.stable for o in _unstable(group)}
    verdicts = []
    for p in plans:
        own = opened[p.scenario.origin]
        verdicts += verdicts_of(p.scenario, own) if case is None else []
        verdicts += stability_of(p.scenario, own, [c for c, o in own.items() if id(o) in lost])
    return MarginTable(rows, refused, verdicts)


def _unstable(group: Sequence[OpenedLoop]) -> Sequence[OpenedLoop]:
    """Return the unstable loops of `group`, each with the sector of its own case.

    All loops in `group` are equal except for the sector. If each loop is stable in its own sector, return all loops:
    only the joint sector is unstable.
    """
    return [o for o in group if not (o.margins().stable and o.stable_at(0.0))] or group


def _row(group: Sequence[OpenedLoop], delays: bool) -> LoopRow:
    slopes = min(o.slopes[0] for o in group), max(o.slopes[1] for o in group)
    first = group[0]
    loop = replace(first, slopes=slopes)
    late, steep = loop.margins(delay=1.0), loop.margins(max(slopes, key=abs), 1.0)
    found = _at(loop, 0.0)
    to = loop.stable_to()
    found["Ms_1_db"] = late.Ms_db if late.stable else None
    found["Ms_1_largest_db"] = steep.Ms_db if steep.stable else None
    found["stable_to_steps"] = None if math.isnan(to) else to
    simulated = simulated_delay(first.system, first.side.entry) if first.falling else np.nan
    found["simulated_delay_steps"] = None if math.isnan(simulated) else simulated
    at_delay = tuple({"further_steps": d, **_at(loop, d), "sector_stable": loop.stable_at(d)} for d in DELAYS if delays)
    return LoopRow(first.system.case.scenario, tuple(o.system.case.name for o in group), slopes, found, at_delay)


def _at(loop: OpenedLoop, delay: float) -> dict[str, Any]:
    """Return the margins for the nominal incremental gain and an additional delay (steps)."""
    now = loop.margins(delay=delay)
    found: dict[str, Any] = {"stable": now.stable}
    for key in OF_MARGINS:
        found[key] = getattr(now, key) if now.stable else None
    found["conditionally_stable"] = now.conditional
    worst = loop.worst_peak_db(delay)
    found["Ms_worst_db"] = None if math.isinf(worst) else worst
    found["noise_gain"] = loop.noise_gain(delay=delay) if now.stable else None
    found["learning"] = loop.learning(delay=delay) if loop.memories else None
    return found
