"""Memory check of a fit: at most half of the machine, from the measured bytes per row of each kind."""

from __future__ import annotations

import os
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

from hystfmu.identify.candidate import Memory
from hystfmu.identify.catalogue import AUTO, method, options

SHARE = 0.5  # of the memory: the system and other programs have the rest
LEAST = 400.0  # bytes per row of any fit


def too_large(rows: int, key: str, given: Mapping[str, Any]) -> str:
    """Return the reason why a fit would take too much memory; empty if it would not.

    Parameters
    ----------
    rows : int
        Rows of the record.
    key : str
        Kind of model; ``"auto"`` stands for the kind that takes least memory.
    given : mapping
        Options of the kind that differ from their defaults.
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
