"""Peak of the sensitivity and delay margin of the loop of a case, for its result; computed once for all cases with the
same loop. Only `hystfmu margins` computes the sector of slopes, because it needs another run. A loop without an inverse
needs this run for its gain, and has no figures here if the run is long.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import lru_cache

from hystfmu.base.errors import InputError
from hystfmu.scenario.loop_margins import OpenedLoop, open_loop
from hystfmu.scenario.system.system import System
from hystfmu.scenario.verdict.result import LoopFigures

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
    """A loop that equals another one with the same key."""

    key: tuple[object, ...]
    opened: OpenedLoop = field(compare=False)


@lru_cache(maxsize=256)
def _figures(loop: _Loop) -> LoopFigures:
    found = loop.opened.margins()
    if not found.stable:
        return LoopFigures(stable=False, Ms_db=None, delay_steps=None)
    return LoopFigures(stable=True, Ms_db=found.Ms_db + 0.0, delay_steps=found.delay_steps)
