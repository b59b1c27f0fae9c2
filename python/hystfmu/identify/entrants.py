"""Candidates of ``auto`` and the number of rows: reasons to leave a kind out, time and memory of the fits.

A fit may use at most half of the memory of the machine. The estimate uses the measured bytes per row of each kind.
"""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path

from hystfmu.data import Dataset
from hystfmu.identify.catalogue import (
    AUTO,
    CLOSES,
    LAGS,
    LATE,
    OPENS,
    Candidate,
    Memory,
    Options,
    candidates,
    method,
    options,
    takes_covariates,
)
from hystfmu.identify.excitation.minor_loops import NONE, OPEN_LOOPS, RETURN_POINT, Excitation

LARGE = 2.0  # % of the span: if minor loops stay open by more, no static return-point model can represent the data
CLOSED = 0.05  # and by more than this, a memory that opens them may be the better one: the record decides
BUDGET = 24.0  # s for all candidates; estimated, not timed: the load must not decide
HOPEFUL = 0.3  # of the time of kinds with a trial fit: most of them end there
LEAST_ROWS, FEWER = 2000, 0.9  # rows that race, however expensive all are; how much fewer are tried at a time
SHARE = 0.5  # of the memory: the system and other programs have the rest
LEAST = 400.0  # bytes per row of any fit


def entrants(data: Dataset, seen: Excitation) -> tuple[dict[str, tuple[str, Candidate]], dict[str, str]]:
    """Return the candidates that suit the data, each with its key, and the reasons against all other kinds."""
    found = candidates()
    reasons = left_out({n: c for n, (_, c) in found.items()}, seen)
    if data.covariates:
        reasons |= {n: "it takes no covariates" for n, (key, _) in found.items() if not takes_covariates(key)}
    reasons |= {n: large for n, (key, c) in found.items() if (large := too_large(len(data.t), key, c.options))}
    return {n: kc for n, kc in found.items() if n not in reasons}, reasons


def affordable(entered: Sequence[Candidate], rows: int) -> int:
    """Return the number of rows, up to `rows`, on which all candidates can be tried within the budget."""
    n = rows
    while n > LEAST_ROWS and sum(c.cost(n) * (HOPEFUL if c.tries(n) else 1.0) for c in entered) > BUDGET:
        n = max(LEAST_ROWS, int(FEWER * n))
    return n


def left_out(found: Mapping[str, Candidate], seen: Excitation) -> dict[str, str]:
    """Return the candidates that contradict the data, with the reasons."""
    reasons: dict[str, str] = {}
    for name, candidate in found.items():
        if candidate.memory in (OPENS, LATE) and seen.memory == NONE:
            reasons[name] = "the output is a function of the input"
        elif candidate.memory in (OPENS, LATE) and seen.memory == RETURN_POINT and seen.gap <= CLOSED:
            reasons[name] = f"minor loops close (gap {seen.gap:.2g} % of the span of y)"
        elif candidate.memory == CLOSES and seen.memory == OPEN_LOOPS and seen.gap > LARGE:
            reasons[name] = f"minor loops stay open by {seen.gap:.2g} % of the span of y"
        elif candidate.memory == LAGS and not seen.several_speeds:
            reasons[name] = "the input has one speed only and is not informative about rate dependence"
    return reasons


def too_large(rows: int, key: str, given: Options) -> str:
    """Return the reason why a fit to so many rows would take too much memory; empty if it would not.

    ``"auto"`` means the kind that takes least memory. `given` contains options of the kind that differ from their
    defaults.
    """
    have = _memory()
    if have is None:
        return ""
    taken = Memory(LEAST) if key == AUTO else getattr(method(key), "MEMORY", Memory(LEAST))
    default = next((float(o.default or 1.0) for o in options(key) if o.name == taken.option), 1.0)
    need = rows * max(taken.grown(given, default), LEAST)
    if need <= SHARE * have:
        return ""
    return (
        f"A fit must take at most half of the memory, {_shown(SHARE * have)}. Got {rows} rows, of which a fit "
        f"of {key} takes about {_shown(need)}: resample the record to a lower rate (--resample HZ), or fit fewer rows"
    )


def _memory() -> float | None:
    """Return the memory of the machine, or of the container if it has less (bytes); None where it is not known."""
    found = []
    with suppress(AttributeError, ValueError, OSError):  # not on Windows
        found.append(float(os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")))
    with suppress(OSError, ValueError):  # "max" without a limit
        found.append(float(Path("/sys/fs/cgroup/memory.max").read_text()))
    return min(found, default=None)


def _shown(size: float) -> str:
    return f"{size / 2**30:.3g} GiB"
