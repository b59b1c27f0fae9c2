"""Bar diagram of the ratio of each of our results to its bound: the printed number or the target.

A bound is met if the ratio is at most 1. For a lower bound, the ratio is inverted.
"""

from __future__ import annotations

from collections.abc import Sequence

from hystfmu.report.diagrams import Ratio, Ratios
from papers.row import Row, over

MOST = 12  # largest number of rows in the diagram


def bounded(rows: Sequence[Row]) -> list[Ratios]:
    """Return a list with one diagram of the ratios of our results to the printed numbers.

    The results are those in the table rows `rows`. If no number is printed, the diagram contains the ratios to the
    targets. Without targets, the list is empty.
    """
    printed = [_ratio(r, r.printed, r.sense, r.printed_met, r.literal) for r in rows if r.where == "paper"]
    if found := [r for r in printed if r is not None]:
        return [_drawn("figures over those of the paper", "ours / printed", found)]
    targets = [_ratio(r, r.target, "least" if r.at_least else "most", r.met) for r in rows]
    found = [r for r in targets if r is not None]
    return [_drawn("figures over their targets", "ours / target", found)] if found else []


def _drawn(title: str, label: str, found: Sequence[Ratio]) -> Ratios:
    ordered = sorted(found, key=lambda r: (r.good, -r.value))
    missed = sum(not r.good for r in found)
    more = f", the {MOST} that are met least" if len(found) > MOST else ""
    said = f"{title}: {len(found) - missed} met, {missed} missed{more}"
    return Ratios(said, f"{label}; 1 and less is met", ordered[:MOST], ("ours", "literal replica"))


def _ratio(r: Row, bound: float | None, sense: str, met: bool | None, literal: float | None = None) -> Ratio | None:
    """Return the ratio of a result to its bound, and that of the literal replica, or None if a number is missing."""
    if met is None or bound is None or r.ours is None or not (bound > 0 and r.ours > 0):
        return None
    other = None if literal is None or literal <= 0 else over(literal, bound, sense)
    return Ratio(r.quantity, over(r.ours, bound, sense), f"{r.ours:.3g} for {bound:.3g}", met, other)
