"""One row in the table of a paper: printed number, result of the literal replica, our result, verdict and target.

The column "printed" contains only numbers that the paper prints. Results of other packages and authors, and run times,
have separate groups. In this package, a "figure" of a row is a number, not a diagram.
"""

from __future__ import annotations

import math
import sys
import tomllib
from collections import ChainMap
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
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
SAME = 0.01  # largest relative difference at which a number counts as equal to a printed one


@dataclass(frozen=True)
class Row:
    """One row of the table: a quantity with up to three numbers.

    Parameters
    ----------
    quantity : str
        Quantity, signal and unit of measure, which are the same for all numbers of the row.
    printed : float or None
        Number that the paper prints, or None.
    literal : float or None
        Result of the literal replica, that is, of the method exactly as in the paper. None if the text does not define
        the method.
    ours : float or None
        Result of the corrected and improved method.
    target : float or None
        Upper bound of `ours`, or lower bound if `at_least` is True, or None.
    at_least : bool
        Whether the target is a lower bound.
    note : str
        Reason for a missed number or target, or difference from the paper.
    place : str
        Table, figure, equation or section of the paper.
    sense : {"most", "least", "equal"}
        Condition under which the printed number is met: `ours` is at most the printed number, at least the printed
        number, or equal to it within 1 %.
    group : str
        Key of `GROUPS`. The default "" means "paper" for a row with a place, and "beyond" for other rows.
    reported : float or None
        Number that another package or author reports.
    seeds : int
        Number of seeds of random start values or noise. The numbers of the row are medians over these seeds. 0 if
        nothing is random.
    literal_range, ours_range : tuple of float, optional
        Smallest and largest number over the seeds.
    scanned : tuple of int, optional
        Number of records in a scan on which the printed number is met, and number of all records in the scan.
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
        """Return a row whose numbers are medians and ranges over random seeds.

        `of` contains two sequences, the results of the literal replica and ours, with one number per seed. Either one
        may be empty. `quantity` and `printed` are fields of the row, and `more` contains other fields.
        """
        literal, ours = (float(median(v)) if len(v) else None for v in of)
        ranges = [(float(min(v)), float(max(v))) if len(v) > 1 else None for v in of]
        ends: dict[str, Any] = {"literal_range": ranges[0], "ours_range": ranges[1]}
        return cls(quantity, printed, literal, ours, seeds=max(map(len, of)), **ends, **more)

    @property
    def met(self) -> bool | None:
        """True if our result meets the target. None if there is no target or no result."""
        if self.target is None or self.ours is None:
            return None
        return bool(self.ours >= self.target if self.at_least else self.ours <= self.target)

    @property
    def printed_met(self) -> bool | None:
        """True if our result meets the printed number. None if there is no printed number or no result.

        With the sense "equal", the results of all seeds must be equal to the printed number.
        """
        if self.printed is None or self.ours is None:
            return None
        if self.sense == "equal":
            return all(abs(v - self.printed) <= SAME * abs(self.printed) for v in (self.ours, *(self.ours_range or ())))
        return bool(self.ours >= self.printed if self.sense == "least" else self.ours <= self.printed)

    @property
    def where(self) -> Group:
        """Key in `GROUPS` of the group to which the row belongs."""
        return self.group or ("paper" if self.place else "beyond")

    def verdict(self) -> str:
        """Return "met", or the factor by which our result misses the target, or "" without a target or a result."""
        if self.met is None:
            return ""
        assert self.ours is not None
        assert self.target is not None
        return "met" if self.met else _missed(self.ours, self.target, "least" if self.at_least else "most")

    def printed_verdict(self) -> str:
        """Return "met", or the factor by which our result misses the printed number, or "" if nothing is printed."""
        if self.printed is None:
            return ""
        if self.ours is None:
            return "not computed"
        missing = self.ours
        if self.sense == "equal" and self.ours_range and abs(self.ours - self.printed) <= SAME * abs(self.printed):
            missing = max(self.ours_range, key=lambda v: abs(v - (self.printed or 0.0)))
        verdict = "met" if self.printed_met else _missed(missing, self.printed, self.sense)
        return (
            verdict
            if self.scanned is None
            else f"{verdict}; met on {self.scanned[0]} of {self.scanned[1]} scanned records"
        )


class Stated:
    """Rows of a module of this package, whose texts and printed numbers are in rows.toml.

    Parameters
    ----------
    module : str
        Name of the module, which is the name of the table in rows.toml.
    """

    def __init__(self, module: str) -> None:
        table: dict[str, Any] = tomllib.loads(Path(__file__).with_name("rows.toml").read_text(encoding="utf-8"))
        for part in module.split(".")[1:]:
            table = table[part]
        self._table, self._name, self.module = table, module, part

    def __call__(self, key: str, literal: float | None = None, ours: float | None = None, **more: Any) -> Row:
        """Return the row `key`. `more` contains fields of the row, and values of the names in braces."""
        return Row(literal=literal, ours=ours, **self._facts(key, more))

    def over_seeds(self, key: str, of: Sequence[Sequence[float]], **more: Any) -> Row:
        """Return the row `key` with medians and ranges over random seeds, see `Row.over_seeds`."""
        facts = self._facts(key, more)
        return Row.over_seeds(facts.pop("quantity"), facts.pop("printed", None), of, **facts)

    def texts(self, key: str, values: Mapping[str, Any]) -> dict[str, Any]:
        """Return the entry `key` of the table. `values` and constants of the module replace the names in braces."""
        filled: dict[str, Any] = _filled(self._table[key], ChainMap(dict(values), vars(sys.modules[self._name])))
        return filled

    def _facts(self, key: str, more: dict[str, Any]) -> dict[str, Any]:
        return self.texts(key, more) | {k: v for k, v in more.items() if k in Row.__dataclass_fields__}


def _filled(part: Any, values: Mapping[str, Any]) -> Any:
    if isinstance(part, dict):
        return {k: _filled(v, values) for k, v in part.items()}
    if isinstance(part, list):
        return [_filled(v, values) for v in part]
    return part.format_map(values) if isinstance(part, str) else part


def over(ours: float, bound: float, sense: str) -> float:
    """Return the ratio of the result `ours` to its bound, so that the ratio is at most 1 if the bound is met."""
    if sense == "equal":
        return max(ours / bound, bound / ours)
    return bound / ours if sense == "least" else ours / bound


def _missed(ours: float, bound: float, sense: str) -> str:
    # a ratio of numbers with different signs, or to 0, states no factor
    if not 0 < (ours * bound) < math.inf:
        return f"missed, {ours:.3g} for {bound:.3g}"
    ratio = over(ours, bound, sense)
    return f"missed by a factor {max(ratio, 1 / ratio):.2f}"
