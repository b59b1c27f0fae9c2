"""Table of a paper: printed number, literal replica, ours, and a target."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

from hystfmu.report.terminal import table


@dataclass(frozen=True)
class Row:
    """One quantity of a paper.

    Parameters
    ----------
    quantity : str
        Quantity, signal and unit of measure.
    printed : float or None
        Number printed in the paper, if any.
    literal : float or None
        Our literal replica of the paper's method; None if the text does not define it.
    ours : float or None
        The corrected and improved method.
    target : float or None
        Upper bound on `ours` (lower bound with `at_least`), if any.
    at_least : bool
        Whether the target is a lower bound.
    note : str
        Reason for a missed target; difference from the paper.
    """

    quantity: str
    printed: float | None = None
    literal: float | None = None
    ours: float | None = None
    target: float | None = None
    at_least: bool = False
    note: str = ""

    @property
    def met(self) -> bool | None:
        """Whether the target is met; None without a target."""
        if self.target is None or self.ours is None:
            return None
        return self.ours >= self.target if self.at_least else self.ours <= self.target

    def verdict(self) -> str:
        """Return "met", or the factor by which the target is missed."""
        if self.met is None:
            return ""
        if self.met:
            return "met"
        assert self.ours is not None
        assert self.target is not None
        ratio = self.target / self.ours if self.at_least else self.ours / self.target
        return f"missed by a factor {ratio:.2f}"


@dataclass(frozen=True)
class Report:
    """The table of one paper."""

    name: str
    source: str
    rows: tuple[Row, ...]
    notes: tuple[str, ...] = ()

    def data(self) -> dict[str, Any]:
        """Return the table as plain data for JSON."""
        rows = [{**asdict(r), "met": r.met} for r in self.rows]
        return {"name": self.name, "source": self.source, "rows": rows, "notes": list(self.notes)}

    def text(self) -> str:
        """Format the table for a terminal."""

        def number(x: float | None) -> str:
            return "" if x is None else f"{x:.4g}"

        def target(r: Row) -> str:
            return "" if r.target is None else f"{'>=' if r.at_least else '<='} {r.target:.4g}"

        head = ["quantity", "printed", "literal", "ours", "target", "verdict", "note"]
        rows = [
            [r.quantity, number(r.printed), number(r.literal), number(r.ours), target(r), r.verdict(), r.note]
            for r in self.rows
        ]
        return "\n".join([f"{self.name}: {self.source}", "", table(head, rows), *(f"  {n}" for n in self.notes)])
