"""Limits of the linearised loop of a scenario with verdicts, and figures of the loop of a case.

The figures are computed once for all cases with the same loop. The sector of slopes needs another run, so only `hystfmu
margins` computes it. A loop without an inverse needs this run for its gain. If the run is long, such a loop has no
figures.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping
from dataclasses import dataclass, field, replace
from fnmatch import fnmatchcase
from functools import lru_cache

from hystfmu.base.errors import InputError
from hystfmu.scenario.loop.opened import DELAYS, OpenedLoop
from hystfmu.scenario.loop.opening import open_loop
from hystfmu.scenario.outcome.result import LoopFigures
from hystfmu.scenario.system.build import build
from hystfmu.scenario.system.case import Cases
from hystfmu.scenario.system.system import System

MOST_STEPS = 100_000  # of a case without an inverse, which runs again for its slopes, all rows in memory


def loop_figures(system: System) -> LoopFigures | None:
    """Return the figures of the loop of a case, opened at the input of its plant; None if it has no margins."""
    try:
        opened = open_loop(system, (1.0, 1.0))
        if not opened.inverted and system.n_steps > MOST_STEPS:
            return None
        return _figures(_Loop(opened.key, opened))
    except InputError:
        return None


@dataclass(frozen=True)
class _Loop:
    """A loop that equals any other loop with the same key."""

    key: tuple[object, ...]
    opened: OpenedLoop = field(compare=False)


@lru_cache(maxsize=256)
def _figures(loop: _Loop) -> LoopFigures:
    found = loop.opened.margins()
    if not found.stable:
        return LoopFigures(stable=False, Ms_db=None, delay_steps=None)
    return LoopFigures(stable=True, Ms_db=found.Ms_db + 0.0, delay_steps=found.delay_steps)


@dataclass(frozen=True)
class LoopVerdict:
    """Verdict on one limit of a loop, with the key `limit` of the scenario and the case or the corners of this limit.

    `value` is the value of the loop, or None if the loop is unstable. `bound` is the required value. If `expected` is
    True, the scenario states that this loop is unstable.
    """

    scenario: str
    limit: str
    where: str
    value: float | None
    bound: float
    at_least: bool
    expected: bool = False

    @property
    def within(self) -> bool:
        """True if the limit is met."""
        if self.value is None:
            return self.expected
        return self.value >= self.bound if self.at_least else self.value <= self.bound

    @property
    def word(self) -> str:
        """Verdict as one word."""
        if self.expected:
            return "expected"
        return "ok" if self.within else "BROKEN"

    def line(self) -> str:
        """Return the verdict as one line."""
        side = "at least" if self.at_least else "at most"
        got = "an unstable loop" if self.value is None else f"{self.value:.4g}"
        return f"{self.scenario}: margins.{self.limit}: must be {side} {self.bound:g} at {self.where}. Got {got}."


def opened_loops(scenario: Cases) -> dict[str, OpenedLoop | InputError]:
    """Return the loop of each case, or the reason why the case has no loop.

    No case runs if the scenario states the slopes.
    """
    spec = scenario.spec.margins
    slopes = None if spec is None or spec.slopes is None else (spec.slopes[0], spec.slopes[1])
    found: dict[str, OpenedLoop | InputError] = {}
    for case in scenario.cases:
        try:
            found[case.name] = open_loop(build(case), slopes)
        except InputError as e:
            found[case.name] = e
    return found


def verdicts_of(scenario: Cases, opened: Mapping[str, OpenedLoop | InputError]) -> list[LoopVerdict]:
    """Compare the loops of a scenario with its limits. For each case, the argument has a loop or the reason for none.

    A limit for a case without a loop is an InputError.
    """
    spec = scenario.spec.margins
    if spec is None:
        return []
    name, where = scenario.spec.name, f"{scenario.origin}: margins"
    case = spec.case or scenario.cases[0].name
    verdicts = []
    if spec.Ms_db is not None:
        loop = opened.get(case, InputError(""))
        if isinstance(loop, InputError):
            why = f" {loop}" if str(loop) else ""
            raise InputError(f"{where}.case: The case must have a loop. Got {case!r} instead.{why}")
        found = loop.margins()
        verdicts.append(
            LoopVerdict(name, "Ms_db", case, found.Ms_db if found.stable else None, spec.Ms_db, at_least=False)
        )
    if spec.stable_to_steps is not None:
        loops = {c: o for c, o in opened.items() if not isinstance(o, InputError)}
        corners = {c: o for c, o in loops.items() if any(fnmatchcase(c, pattern) for pattern in spec.corners)}
        if not corners:
            raise InputError(f"{where}.corners: A case with a loop must have such a name. Got {spec.corners} instead.")
        low, high = spec.slopes or (None, None)
        reached: dict[str, float] = {}
        kept: dict[tuple[object, ...], float] = {}
        for c, o in corners.items():
            wide = o if low is None or high is None else replace(o, slopes=(low, high))
            key = (*wide.key, wide.slopes)
            if key not in kept:
                kept[key] = wide.stable_to(sorted({*DELAYS, spec.stable_to_steps}))
            reached[c] = kept[key]
        worst = min(reached, key=lambda c: -1.0 if math.isnan(reached[c]) else reached[c])
        value = None if math.isnan(reached[worst]) else reached[worst]
        at = f"{worst}, the worst of {len(corners)}"
        verdicts.append(LoopVerdict(name, "stable_to_steps", at, value, spec.stable_to_steps, at_least=True))
    return verdicts


def stability_of(
    scenario: Cases, opened: Mapping[str, OpenedLoop | InputError], lost: Collection[str]
) -> list[LoopVerdict]:
    """Return a verdict for each case whose loop is unstable at its own delay.

    The verdict is broken unless the scenario expects an unstable loop. `lost` contains the cases whose loop is unstable
    for the nominal slope or for a slope along the path. If a case is expected to be unstable but is stable or does not
    exist, an InputError is raised.
    """
    name, expected = scenario.spec.name, scenario.spec.margins.expected_unstable if scenario.spec.margins else []
    known = {c.name for c in scenario.cases}
    for case in expected:
        if case not in known or (case in opened and case not in lost):
            why = "is stable, or has none" if case in known else "does not exist"
            raise InputError(
                f"{scenario.origin}: margins.expected_unstable: The case must have an unstable loop. "
                f"Got {case!r}, which {why}."
            )
    verdicts = []
    for case in lost:
        loop = opened[case]
        assert not isinstance(loop, InputError)
        at = f"{case}, slopes {loop.slopes[0]:.2f} to {loop.slopes[1]:.2f}"
        verdicts.append(LoopVerdict(name, "stable_to_steps", at, None, 0.0, at_least=True, expected=case in expected))
    return verdicts
