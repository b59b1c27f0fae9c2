"""Bar diagram of the ratio of each of our results to its bound: the printed number or the target.

A bound is met if the ratio is at most 1. For a lower bound, the ratio is inverted.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from hystfmu.report.diagrams import Ratio, Ratios

if TYPE_CHECKING:
    from papers.row import Row

MOST = 12  # largest number of rows in the diagram


def bounded(rows: Sequence[Row]) -> list[Ratios]:
    """Return a list with one diagram of the ratios of our results to the printed numbers.

    The results are those in the table rows `rows`. If no number is printed, the diagram contains the ratios to the
    targets. Without targets, the list is empty.
    """
    printed = [
        _printed(r) for r in rows if r.where == "paper" and r.printed_met is not None and _positive(r.printed, r.ours)
    ]
    if printed:
        return [_drawn("figures over those of the paper", "ours / printed", printed)]
    targets = [_target(r) for r in rows if r.met is not None and _positive(r.target, r.ours)]
    return [_drawn("figures over their targets", "ours / target", targets)] if targets else []


def _drawn(title: str, label: str, found: Sequence[Ratio]) -> Ratios:
    ordered = sorted(found, key=lambda r: (r.good, -r.value))
    missed = sum(not r.good for r in found)
    more = f", the {MOST} that are met least" if len(found) > MOST else ""
    said = f"{title}: {len(found) - missed} met, {missed} missed{more}"
    return Ratios(said, f"{label}; 1 and less is met", ordered[:MOST], ("ours", "literal replica"))


def _positive(*values: float | None) -> bool:
    return all(v is not None and v > 0 for v in values)


def _printed(r: Row) -> Ratio:
    assert r.ours is not None
    assert r.printed is not None
    other = None if r.literal is None or r.literal <= 0 else _over(r.literal, r.printed, r.sense)
    text = f"{r.ours:.3g} for {r.printed:.3g}"
    return Ratio(r.quantity, _over(r.ours, r.printed, r.sense), text, bool(r.printed_met), other)


def _target(r: Row) -> Ratio:
    assert r.ours is not None
    assert r.target is not None
    over = _over(r.ours, r.target, "least" if r.at_least else "most")
    return Ratio(r.quantity, over, f"{r.ours:.3g} for {r.target:.3g}", bool(r.met))


def _over(ours: float, bound: float, sense: str) -> float:
    """Return the ratio of the result `ours` to its bound, so that the ratio is at most 1 if the bound is met."""
    if sense == "equal":
        return max(ours / bound, bound / ours)
    return bound / ours if sense == "least" else ours / bound
