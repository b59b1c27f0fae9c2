"""Compare the report.json of two revisions on one page: metrics with their change, and overlaid signals."""

from __future__ import annotations

import json
from html import escape
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import pydantic
from pydantic import Field

from hystfmu.base.errors import InputError
from hystfmu.base.files import read_bytes, write_text
from hystfmu.report.page import Section, Table, page, section
from hystfmu.report.plot import Line, Plot
from hystfmu.scenario.verdict.baseline import Change

MOST_BYTES = 2**28
Finite = Annotated[float, Field(allow_inf_nan=False)]


class _Metric(pydantic.BaseModel):
    metric: str
    value: float  # 'inf' as text after a diverged run


class _Case(pydantic.BaseModel):
    scenario: str
    case: str
    passed: bool
    metrics: list[_Metric]
    failures: list[str] = []
    signals: dict[str, list[Finite]] = {}

    @pydantic.field_validator("signals")
    @classmethod
    def _same_length(cls, signals: dict[str, list[float]]) -> dict[str, list[float]]:
        if signals and len({"t" in signals, *map(len, signals.values())} - {True}) != 1:
            raise ValueError("must be lists of equal length that include the times 't'")
        return signals


class _Report(pydantic.BaseModel):
    version: str
    results: list[_Case]


def _read(path: str | Path) -> tuple[str, dict[str, _Case]]:
    content = read_bytes(path, MOST_BYTES)  # outside `try`: an InputError is a ValueError
    try:
        report = _Report.model_validate(json.loads(content))
    except (ValueError, RecursionError) as e:
        errors = e.errors() if isinstance(e, pydantic.ValidationError) else []
        why = f"{'.'.join(map(str, errors[0]['loc']))}: {errors[0]['msg']}" if errors else "not JSON"
        raise InputError(f"{path}: not a report of 'hystfmu run --report': {why}") from None
    return report.version, {f"{c.scenario}/{c.case}": c for c in report.results}


def compare_reports(before: str | Path, after: str | Path, out: str | Path) -> list[Change]:
    """Write a page that compares two reports.

    Parameters
    ----------
    before, after : path
        The report.json of each revision.
    out : path
        HTML page to write.

    Returns
    -------
    list of Change
        Metrics and verdicts that differ, and cases that only one report has.

    Raises
    ------
    InputError
        If a file is not a report of ``hystfmu run --report``.
    """
    (old_version, old), (new_version, new) = _read(before), _read(after)
    found: list[Change] = []
    rows: list[list[object]] = []
    sections: list[Section] = []
    for title in dict.fromkeys([*old, *new]):
        a, b = old.get(title), new.get(title)
        values = [{m.metric: m.value for m in c.metrics} if c is not None else {} for c in (a, b)]
        for name in {**values[0], **values[1]}:
            change = Change(title, name, values[0].get(name), values[1].get(name))
            rows.append([title, name, *_cells(change)])
            if change.old != change.new:
                found.append(change)
        verdicts = [_verdict(c) for c in (a, b)]
        if verdicts[0] != verdicts[1]:
            found.append(Change(title, "verdict", *verdicts))
            rows.append([title, "verdict", *verdicts, ""])
        plots = _plots(a, b)
        if plots:
            sections.append(Section(title, plots=plots))
    head = Table(("scenario/case", "what", "old", "new", "change %"), rows)
    text = f"old: {before} (HystFMU {old_version}); new: {after} (HystFMU {new_version}); {len(found)} differences."
    body = [f"<h1>{escape('Two runs side by side')}</h1>", section(Section("Metrics", text, [head]))]
    write_text(out, page("HystFMU comparison", [*body, *map(section, sections)]))
    return found


def _verdict(c: _Case | None) -> str:
    return "missing" if c is None else "ok" if c.passed else "failed"


def _cells(c: Change) -> list[object]:
    share = "" if c.relative is None or not np.isfinite(c.relative) else f"{100 * c.relative:+.3g}"
    return [*("" if v is None else v for v in (c.old, c.new)), share]


def _plots(a: _Case | None, b: _Case | None) -> list[Plot]:
    signals: list[dict[str, Any]] = [c.signals if c is not None else {} for c in (a, b)]
    plots = []
    for name in {**signals[0], **signals[1]}:
        if name == "t":
            continue
        both = zip(("old", "new"), signals, strict=True)
        lines = [Line(which, np.array(s["t"]), np.array(s[name])) for which, s in both if s.get(name)]
        if lines:
            plots.append(Plot(name, "t in s", name, lines))
    return plots
