"""Properties that a kind of model states to compete in ``auto``: its memory, its cost, its trial fit."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

CLOSES, OPENS, LAGS, LATE, ANY = "return-point", "open", "rate", "open, then rate", ""
EXPENSIVE = 3.0  # s: a fit that takes longer, and has no quick options, is tried on a part of the rows first


@dataclass(frozen=True)
class Candidate:
    """An entry of the table ``CANDIDATES`` of a kind of model.

    Parameters
    ----------
    memory : str
        `CLOSES`: static, minor loops close; `OPENS`: static, minor loops stay open; `LAGS`: rate-dependent;
        `LATE`: dynamics behind an operator whose loops stay open, which one speed may show as well; `ANY`: creep or
        lags may open a loop.
    seconds, per_1000 : float
        Estimated cost of a fit (s): fixed, and per 1000 rows up to the last training row.
    options : dict
        Options of the kind that differ from its defaults.
    quick : dict
        Options of a short trial fit, which a kind must pass before it is fitted in full; empty: there is none.  It may
        be coarser than the full fit but must have each of its parts.
    local : bool
        Whether each parameter acts only on some states of the memory, so that states outside the record remain
        undetermined. A network states its coverage itself.
    """

    memory: str
    seconds: float
    per_1000: float
    options: Mapping[str, Any] = field(default_factory=dict)
    quick: Mapping[str, Any] = field(default_factory=dict)
    local: bool = False

    def cost(self, rows: int) -> float:
        """Return the estimated cost (s) for this number of rows."""
        return self.seconds + self.per_1000 * rows / 1000

    def tries(self, rows: int) -> bool:
        """Return whether a short trial fit comes before a full one."""
        return bool(self.quick) or self.cost(rows) > EXPENSIVE

    def named(self, key: str) -> str:
        """Return the kind with its options, e.g. ``zhao_tan_mlp memory=last``."""
        return " ".join([key, *(f"{k}={v}" for k, v in self.options.items())])


@dataclass(frozen=True)
class Memory:
    """Measured memory of a fit; a kind whose module states no ``MEMORY`` takes the least.

    Parameters
    ----------
    per_row : float
        Peak of a fit with the default options (bytes per row of a long record).
    option : str
        Option that it grows with; empty: none.
    power : int
        Exponent of this growth.
    """

    per_row: float
    option: str = ""
    power: int = 1

    def grown(self, given: Mapping[str, Any], default: float) -> float:
        """Return the bytes per row of a fit with these options.

        Parameters
        ----------
        given : mapping
            Options of the kind that differ from their defaults.
        default : float
            Default of the option that the memory grows with.
        """
        size = float(given.get(self.option, default))
        return float(self.per_row * (size / default) ** self.power)
