"""Table of a paper: printed numbers, results of the literal replica, our results, verdicts, and targets.

The column "printed" contains only numbers that the paper prints. Results of other packages and authors, and run times,
have separate groups. In this package, a "figure" of a row is a number, not a diagram. For a missed number, the table
states the factor and the reason. The exit status of ``hystfmu reproduce`` depends on targets, not on printed numbers,
because the records of the papers are not published. Targets of run times have no effect on the exit status, because run
times depend on the load of the computer.
"""

import math
import re
import sys
import tomllib
from collections import ChainMap
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from statistics import median
from typing import Any, Literal

from hystfmu.base import Array, escape
from hystfmu.report import page
from hystfmu.report.diagrams import Ratio, Ratios
from hystfmu.report.page import Section, Table
from hystfmu.report.plot import MOST_POINTS, Line, Plot
from hystfmu.report.terminal import table

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
    def over_seeds(cls, quantity: str, printed: float | None, of: Sequence[Sequence[float]], **more: Any) -> "Row":
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


@dataclass(frozen=True)
class Report:
    """Table and diagrams of one paper.

    `omitted` contains the figures and equations of the paper that have neither rows nor diagrams, with the reasons.
    """

    name: str
    source: str
    rows: tuple[Row, ...]
    notes: tuple[str, ...] = ()
    drawings: tuple[Plot, ...] = ()
    omitted: Mapping[str, str] = field(default_factory=dict)

    def data(self) -> dict[str, Any]:
        """Return the table as a dict of JSON types."""
        rows = [
            {
                **{k: None if isinstance(v, float) and not math.isfinite(v) else v for k, v in asdict(r).items()},
                "group": r.where,
                "met": r.met,
                "printed_met": r.printed_met,
                "ratio": _ratio(r),
                "verdict": verdict(r),
            }
            for r in self.rows
        ]
        drawn = {figure(p): p.title.partition(": ")[2] for p in self.drawings}
        facts: dict[str, Any] = {"name": self.name, "source": self.source, "answer": self.answer(), "rows": rows}
        return facts | {"drawings": drawn, "omitted": dict(self.omitted), "notes": list(self.notes)}

    def tables(self) -> list[tuple[str, list[str], list[list[str]]]]:
        """Return title, column heads and cells of every group of rows, as text, without empty groups and columns."""
        found = []
        for key, title in GROUPS.items():
            rows = [r for r in self.rows if r.where == key]
            if not rows:
                continue
            columns = [(head, [cell(r) for r in rows]) for head, cell in _COLUMNS.items()]
            kept = [(head, cells) for head, cells in columns if any(cells)]
            body = [list(row) for row in zip(*(cells for _, cells in kept), strict=True)]
            found.append((title, [head for head, _ in kept], body))
        return found

    def text(self) -> str:
        """Return the table as text for a terminal."""
        parts = [f"{self.name}: {self.source}"]
        for title, head, rows in self.tables():
            parts += ["", title, "", table(head, rows)]
        return "\n".join([*parts, "", *(f"  {n}" for n in self.notes)])

    def answer(self) -> str:
        """Return sentences that state how many printed numbers, statements and targets are met."""
        counts = []
        for met, what in (("printed_met", "printed figures and statements"), ("met", "targets")):
            # without rows of scans (values that are not printed) and of times (which depend on the load)
            rows = [r for r in self.rows if r.where == "paper" or (met == "met" and r.where != "speed")]
            counted = [v for r in rows if (v := getattr(r, met)) is not None]
            if counted:
                counts.append(f"{sum(counted)} of {len(counted)} {what} are met.")
        scanned = [r.scanned for r in self.rows if r.scanned is not None]
        if scanned:
            held, tried = (sum(s[k] for s in scanned) for k in (0, 1))
            counts.insert(1, f"On the scanned records, {held} of {tried} printed figures are met.")
        return " ".join(counts) or "Nothing is printed, and no target is stated."

    def html(self) -> str:
        """Return an HTML page with a summary, the ratios of results to bounds, the tables, and the diagrams."""
        body = [f"<h1>{escape(self.name)}</h1>", f'<p class="answer">{escape(self.answer())}</p>']
        body.append(f'<p class="lead">{escape(self.source)}</p>')
        plots = self.drawings
        first: list[page.Diagram] = [*bounded(self.rows), *plots[:1]]
        body.append(f'<div class="plots hero">{"".join(map(page.figure, first))}</div>')
        body += [page.section(Section(title, tables=[Table(head, rows)])) for title, head, rows in self.tables()]
        if plots[1:]:
            body.append(page.section(Section("Figures of the paper, from our data", plots=plots[1:])))
        if self.notes:
            listed = "".join(f"<li>{escape(n)}</li>" for n in self.notes)
            body.append(f"<section><h2>Notes</h2><ul>{listed}</ul></section>")
        return page.page(f"{self.name}: the paper beside ours", body)


def report(of: Stated, rows: tuple[Row, ...], drawings: tuple[Plot, ...] = (), **values: Any) -> Report:
    """Return the report of the module of `of`, whose source, notes and omitted figures are in rows.toml.

    `values` contains the values of the names in braces. The value `source` replaces the source in the table.
    """
    facts = of.texts("report", values) | values
    return Report(of.module, facts["source"], rows, tuple(facts["notes"]), drawings, facts.get("omitted", {}))


def curves(
    title: str, axes: tuple[str, str], x: Array | None, lines: Mapping[str, Any], points: int = MOST_POINTS
) -> Plot:
    """Return a diagram. `axes` contains the labels of both axes, and `lines` the values (n,) over `x` by name.

    Without a common `x`, each entry of `lines` is a pair of abscissa and ordinate.
    """
    return Plot(title, *axes, [Line(name, *(v if x is None else (x, v))) for name, v in lines.items()], points=points)


def gathered(parts: Sequence[Callable[[], list[Row]]], progress: Callable[[float], None]) -> tuple[Row, ...]:
    """Return the rows of all `parts`, and call `progress` with the completed fraction after each part."""
    rows: list[Row] = []
    for k, part in enumerate(parts):
        rows += part()
        progress((k + 1) / len(parts))
    return tuple(rows)


def figure(p: Plot) -> str:
    """Return the figure of the paper that a diagram corresponds to: the title before a colon or a part such as (a)."""
    return re.split("[:(]", p.title)[0]


def verdict(r: Row) -> str:
    """Return the verdict of the row r on the printed number, or on the target if no number is printed."""
    return r.printed_verdict() or r.verdict()


def _ratio(r: Row) -> float | None:
    return None if r.literal is None or not r.printed else r.literal / r.printed


def _number(x: float | None) -> str:
    return "" if x is None else f"{x:.4g}"


def _range(ends: tuple[float, float] | None) -> str:
    return "" if ends is None else f" ({_number(ends[0])} .. {_number(ends[1])})"


def _target(r: Row) -> str:
    return "" if r.target is None else f"{'>=' if r.at_least else '<='} {r.target:.4g}"


_COLUMNS: dict[str, Any] = {
    "place": lambda r: r.place,
    "quantity": lambda r: r.quantity,
    "reported": lambda r: _number(r.reported),
    "printed": lambda r: _number(r.printed),
    "literal": lambda r: _number(r.literal) + _range(r.literal_range),
    "literal / printed": lambda r: _number(_ratio(r)),
    "ours": lambda r: _number(r.ours) + _range(r.ours_range),
    "seeds": lambda r: str(r.seeds or ""),
    "against print": Row.printed_verdict,
    "target": _target,
    "against target": Row.verdict,
    "note": lambda r: r.note,
}


def scanned(rows: Sequence[Row]) -> tuple[int, int]:
    """Return the number of rows in a scan on which the printed number is met, and the number of all rows."""
    return sum(r.printed_met is True for r in rows), len(rows)


def nearest(scanned: Sequence[tuple[Any, Sequence[float]]], printed: Sequence[float]) -> Any:
    """Return the setting in a scan for which the results of the literal replica are closest to the printed numbers.

    The distance is the largest ratio between a result and its printed number, or its inverse if that is larger.

    Parameters
    ----------
    scanned : sequence of (setting, results of the literal replica)
    printed : sequence of float
        Printed numbers of the paper, in the order of the results.
    """

    def factor(figures: Sequence[float]) -> float:
        return max(abs(math.log(a / b)) for a, b in zip(figures, printed, strict=True))

    return min(scanned, key=lambda s: factor(s[1]))[0]


MOST = 12  # largest number of rows in the diagram


def bounded(rows: Sequence[Row]) -> list[Ratios]:
    """Return a list with one bar diagram of the ratios of our results to the printed numbers.

    A bound is met if the ratio is at most 1. For a lower bound, the ratio is inverted.

    The results are those in the table rows `rows`. If no number is printed, the diagram contains the ratios to the
    targets. Without targets, the list is empty.
    """
    printed = [_against(r, r.printed, r.sense, r.printed_met, r.literal) for r in rows if r.where == "paper"]
    if found := [r for r in printed if r is not None]:
        return [_drawn("figures over those of the paper", "ours / printed", found)]
    targets = [_against(r, r.target, "least" if r.at_least else "most", r.met) for r in rows]
    found = [r for r in targets if r is not None]
    return [_drawn("figures over their targets", "ours / target", found)] if found else []


def _drawn(title: str, label: str, found: Sequence[Ratio]) -> Ratios:
    ordered = sorted(found, key=lambda r: (r.good, -r.value))
    missed = sum(not r.good for r in found)
    more = f", the {MOST} that are met least" if len(found) > MOST else ""
    said = f"{title}: {len(found) - missed} met, {missed} missed{more}"
    return Ratios(said, f"{label}; 1 and less is met", ordered[:MOST], ("ours", "literal replica"))


def _against(r: Row, bound: float | None, sense: str, met: bool | None, literal: float | None = None) -> Ratio | None:
    """Return the ratio of a result to its bound, and that of the literal replica, or None if a number is missing."""
    if met is None or bound is None or r.ours is None or not (bound > 0 and r.ours > 0):
        return None
    other = None if literal is None or literal <= 0 else over(literal, bound, sense)
    return Ratio(r.quantity, over(r.ours, bound, sense), f"{r.ours:.3g} for {bound:.3g}", met, other)
