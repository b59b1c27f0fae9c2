"""The table of a paper: the printed number beside a literal replica and ours, with a target where there is one."""

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
        What was measured, on which signal, in which unit.
    printed : float or None
        As printed in the paper; None where it prints none.
    literal : float or None
        Our literal replica of the paper's method; None where the text leaves it open.
    ours : float or None
        The corrected and improved method.
    target : float or None
        `ours` must not exceed it (or, with `at_least`, not fall below it); None where there is no target.
    at_least : bool
        The target is a lower bound.
    note : str
        Why, when a target is missed; what differs from the paper.
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
        """`met`, or by how much the target is missed."""
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
        """For machines."""
        rows = [{**asdict(r), "met": r.met} for r in self.rows]
        return {"name": self.name, "source": self.source, "rows": rows, "notes": list(self.notes)}

    def text(self) -> str:
        """For a terminal."""

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
