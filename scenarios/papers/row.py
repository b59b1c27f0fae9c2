"""A row of a paper's table: printed figure, literal replica, ours, the verdict on the printed figure, a target.

"Printed" holds only what the paper prints.  Results of other packages and authors, and run times, have separate groups.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from statistics import median
from typing import Any, Literal

Group = Literal["paper", "scan", "beyond", "listed", "reported", "speed"]
GROUPS: dict[Group, str] = {
    "paper": "What the paper prints",
    "scan": "Scan over what the paper does not print",
    "beyond": "Beyond the paper: other signals, other models",
    "listed": "For comparison, without targets",
    "reported": "Reported by other packages and authors",
    "speed": "Speed",
}
SAME = 0.01  # relative difference up to which a figure counts as equal to a printed one


@dataclass(frozen=True)
class Row:
    """One quantity.

    Parameters
    ----------
    quantity : str
        Quantity, signal and unit of measure; the same for all three figures.
    printed : float or None
        Figure that the paper prints, if any.
    literal : float or None
        Our literal replica of the paper's method; None if the text does not define it.
    ours : float or None
        The corrected and improved method.
    target : float or None
        Upper bound on `ours` (lower bound with `at_least`), if any.
    at_least : bool
        Whether the target is a lower bound.
    note : str
        Reason for a missed figure or target; difference from the paper.
    place : str
        Table, figure, equation or section of the paper; a row with a place belongs to the group "paper".
    sense : {"most", "least", "equal"}
        When a printed figure is met: `ours` at most, at least, or equal to it within 1 %.
    group : str
        Key of `GROUPS`; "" for "paper" with a place and "beyond" without.
    reported : float or None
        Figure that another package or author reports.
    seeds : int
        Number of seeds, of random starts or noise, of which the figures are medians; 0: nothing is drawn.
    literal_range, ours_range : tuple of float, optional
        Least and largest figure over the seeds.
    scanned : tuple of int, optional
        Number of scanned records on which the printed figure is met, and number of scanned records.
    """

    quantity: str
    printed: float | None = None
    literal: float | None = None
    ours: float | None = None
    target: float | None = None
    at_least: bool = False
    note: str = ""
    place: str = ""
    sense: Literal["most", "least", "equal"] = "most"
    group: Group | Literal[""] = ""
    reported: float | None = None
    seeds: int = 0
    literal_range: tuple[float, float] | None = None
    ours_range: tuple[float, float] | None = None
    scanned: tuple[int, int] | None = None

    @classmethod
    def over_seeds(cls, quantity: str, printed: float | None, of: Sequence[Sequence[float]], **more: Any) -> Row:
        """Return a row of the medians over seeds, with the ranges; `of` has literal and ours, a figure per seed."""
        literal, ours = (float(median(v)) if len(v) else None for v in of)
        ranges = [(float(min(v)), float(max(v))) if len(v) > 1 else None for v in of]
        ends: dict[str, Any] = {"literal_range": ranges[0], "ours_range": ranges[1]}
        return cls(quantity, printed, literal, ours, seeds=max(map(len, of)), **ends, **more)

    @property
    def met(self) -> bool | None:
        """True if the target is met; None without a target."""
        if self.target is None or self.ours is None:
            return None
        return bool(self.ours >= self.target if self.at_least else self.ours <= self.target)

    @property
    def printed_met(self) -> bool | None:
        """True if the printed figure is met, an equal one on every seed; None if nothing is printed or computed."""
        if self.printed is None or self.ours is None:
            return None
        if self.sense == "equal":
            return all(abs(v - self.printed) <= SAME * abs(self.printed) for v in (self.ours, *(self.ours_range or ())))
        return bool(self.ours >= self.printed if self.sense == "least" else self.ours <= self.printed)

    @property
    def where(self) -> Group:
        """Key of the group to which the row belongs."""
        return self.group or ("paper" if self.place else "beyond")

    def verdict(self) -> str:
        """Return "met", or the factor by which the target is missed; "" without a target."""
        if self.met is None:
            return ""
        assert self.ours is not None
        assert self.target is not None
        return "met" if self.met else _missed(self.ours, self.target, "least" if self.at_least else "most")

    def printed_verdict(self) -> str:
        """Return "met", or the factor by which the printed figure is missed; "" if nothing is printed."""
        if self.printed is None:
            return ""
        if self.ours is None:
            return "not computed"
        missing = self.ours
        if self.sense == "equal" and self.ours_range and abs(self.ours - self.printed) <= SAME * abs(self.printed):
            missing = max(self.ours_range, key=lambda v: abs(v - (self.printed or 0.0)))
        verdict = "met" if self.printed_met else _missed(missing, self.printed, self.sense)
        return verdict if self.scanned is None else f"{verdict}; met on {_of(self.scanned)} scanned records"


def _of(counts: tuple[int, int]) -> str:
    return f"{counts[0]} of {counts[1]}"


def _missed(ours: float, bound: float, sense: str) -> str:
    ratio = bound / ours if sense == "least" and ours else ours / bound if bound else math.inf
    if not 0 < ratio < math.inf:
        return f"missed, {ours:.3g} for {bound:.3g}"
    return f"missed by a factor {max(ratio, 1 / ratio):.2f}"
