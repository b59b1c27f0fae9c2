"""Compare the report.json of two runs on one page: metrics and margins, largest changes first, and signals."""

import json
import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
import pydantic

from hystfmu.base import InputError, escape, read_bytes, write_text
from hystfmu.graph.tables import Number
from hystfmu.report.page import Section, Table, figure, page, section, table
from hystfmu.report.plot import Line, Plot
from hystfmu.scenario.outcome.metrics import label
from hystfmu.scenario.outcome.result import Change

MOST_BYTES = 2**28
MOST_CASES, MOST_FIRST = 12, 8  # largest number of cases with plotted signals, and of changes beside the first diagram
TALL, LOW = 220, 150
Form = TypeVar("Form", bound=pydantic.BaseModel)


class _Metric(pydantic.BaseModel):
    metric: str
    value: float  # the text 'inf' if the run diverged


class _Margins(pydantic.BaseModel):
    stable: bool
    Ms_db: float | None
    delay_steps: float | None  # None if no delay makes the loop unstable

    def values(self) -> dict[str, float]:
        """Return the peak and the delay margin as numbers, or the worst possible values for an unstable loop."""
        if not self.stable or self.Ms_db is None:
            return {"Ms, dB": math.inf, "delay margin, steps": 0.0}
        return {"Ms, dB": self.Ms_db, "delay margin, steps": math.inf if self.delay_steps is None else self.delay_steps}


class _Case(pydantic.BaseModel):
    scenario: str
    case: str
    passed: bool
    metrics: list[_Metric]
    margins: _Margins | None = None
    failures: list[str] = []
    signals: dict[str, list[Number]] = {}
    units: dict[str, str] = {}

    @pydantic.field_validator("signals")
    @classmethod
    def _same_length(cls, signals: dict[str, list[float]]) -> dict[str, list[float]]:
        if signals and ("t" not in signals or len(set(map(len, signals.values()))) > 1):
            raise ValueError("must be lists of equal length that include the times 't'")
        return signals


class _Report(pydantic.BaseModel):
    version: str
    results: list[_Case]


def report_file(path: str | Path) -> Path:
    """Return the report.json in a folder, or the file itself."""
    return Path(path) / "report.json" if Path(path).is_dir() else Path(path)


def read_report(path: str | Path, form: type[Form], command: str, otherwise: str, key: str | None = None) -> Form:
    """Read a report, or the part `key` of a report, that `command` wrote.

    `otherwise` is the reason in the error message if the content is no JSON, or has no part `key`.
    """
    file = report_file(path)
    content = read_bytes(file, MOST_BYTES)  # outside of `try`, because an InputError is also a ValueError
    try:
        found = json.loads(content)
        return form.model_validate(found if key is None else found[key])
    except (ValueError, KeyError, TypeError, RecursionError) as e:
        errors = e.errors() if isinstance(e, pydantic.ValidationError) else []
        why = f"{'.'.join(map(str, errors[0]['loc']))}: {errors[0]['msg']}" if errors else otherwise
        raise InputError(f"{file}: not a report of '{command}': {why}") from None


def _read(path: str | Path) -> tuple[str, dict[str, _Case]]:
    report = read_report(path, _Report, "hystfmu run --report", "not JSON")
    return report.version, {f"{c.scenario}/{c.case}": c for c in report.results}


def compare_reports(before: str | Path, after: str | Path, out: str | Path) -> list[Change]:
    """Write a page that compares two reports. Each path is a report.json or the folder with this file.

    Return the differences of metrics and verdicts, and the cases that only one report has. An InputError is raised if a
    file is not a report of ``hystfmu run --report``.
    """
    (old_version, old), (new_version, new) = _read(before), _read(after)
    found: list[Change] = []
    same: list[Change] = []
    for title in dict.fromkeys([*old, *new]):
        a, b = old.get(title), new.get(title)
        # reports of earlier versions contain no margins
        margins = all(c is None or c.margins is not None for c in (a, b))
        values = [_values(c, margins) for c in (a, b)]
        for name in {**values[0], **values[1]}:
            change = Change(title, name, values[0].get(name), values[1].get(name))
            (same if change.old == change.new else found).append(change)
        verdicts = [_verdict(c) for c in (a, b)]
        if verdicts[0] != verdicts[1]:
            found.append(Change(title, "verdict", *verdicts))
    ordered = _largest_first(found)
    cases = list(dict.fromkeys(c.title for c in ordered))
    text = f"Old: {before} (HystFMU {old_version}). New: {after} (HystFMU {new_version})."
    body = ["<h1>Two runs side by side</h1>", f'<p class="answer">{escape(_answer(found, same))}</p>']
    body.append(f'<p class="lead">{escape(text)}</p>')
    if found:
        first = table(change_table([c for c in ordered if c.what != "verdict"][:MOST_FIRST], "the largest changes"))
        drawn = _drawn(cases[0], old.get(cases[0]), new.get(cases[0]))
        body.append(f'<div class="plots hero">{drawn}<div>{first}</div></div>')
    folded = [change_table(same)] if same else []
    body.append(
        section(Section("Changes, the largest first", "", [change_table(ordered)] if found else [], folded=folded))
    )
    for title in cases[:MOST_CASES]:
        plots = _plots(old.get(title), new.get(title))
        if plots:
            body.append(section(Section(title, plots=plots)))
    write_text(out, page("HystFMU comparison", body))
    return found


def _values(c: _Case | None, margins: bool) -> dict[str, float]:
    """Return the metrics of a case, and its margins if they are required."""
    if c is None:
        return {}
    return {m.metric: m.value for m in c.metrics} | (c.margins.values() if margins and c.margins else {})


def _largest_first(found: Sequence[Change]) -> list[Change]:
    """Sort changes by their relative size. Verdicts are first, sorted by the largest change of their case.

    A metric that only one run has counts as the largest change.
    """

    def share(c: Change) -> float:
        return math.inf if c.relative is None or not math.isfinite(c.relative) else abs(c.relative)

    most: dict[str, float] = {}
    for c in found:
        if c.what != "verdict":
            most[c.title] = max(most.get(c.title, 0.0), share(c))
    key = {id(c): (c.what == "verdict", most.get(c.title, 0.0) if c.what == "verdict" else share(c)) for c in found}
    return sorted(found, key=lambda c: key[id(c)], reverse=True)


def _answer(found: Sequence[Change], same: Sequence[Change]) -> str:
    """Return one sentence that summarises the changes."""
    verdicts = [c for c in found if c.what == "verdict"]
    figures = len(found) - len(verdicts)
    if not found:
        return f"All {len(same)} figures are the same."
    worse = sum(c.relative is not None and c.relative > 0 for c in found)
    said = f"{figures} of {figures + len(same)} figures differ, {worse} of them are larger"
    if verdicts:
        failing = sum(c.new != "ok" for c in verdicts)
        said += f"; {len(verdicts)} verdict{'s' if len(verdicts) > 1 else ''} changed, {failing} to failed or missing"
    return said + "."


def change_table(changes: Sequence[Change], caption: str = "") -> Table:
    """Return a table of changes: old value, new value, and change in percent."""
    rows = [[c.title, c.what, *_cells(c)] for c in changes]
    return Table(("scenario/case", "what", "old", "new", "change in %"), rows, caption)


def _drawn(title: str, a: _Case | None, b: _Case | None) -> str:
    """Plot old and new values of the most changed signal, and their difference, or return ""."""
    times = a.signals.get("t") if a is not None else None
    if a is None or b is None or times is None or times != b.signals.get("t"):
        return ""
    t = np.array(times)
    moved = {s: np.array(b.signals[s]) - np.array(a.signals[s]) for s in a.signals if s in b.signals and s != "t"}
    sizes = {s: float(np.max(np.abs(d), initial=0.0)) / (float(np.ptp(a.signals[s])) or 1.0) for s, d in moved.items()}
    name = max(sizes, key=sizes.__getitem__, default=None)
    if name is None or sizes[name] == 0:
        return ""
    unit = a.units.get(name, "")
    lines = [Line("old", t, np.array(a.signals[name])), Line("new", t, np.array(b.signals[name]))]
    plots = [
        Plot(f"{title}: the case of the largest change", "t in s", label(name, unit), lines, height=TALL),
        Plot(
            "difference",
            "t in s",
            label("new - old", unit),
            [Line("new - old", t, moved[name])],
            envelope=True,
            height=LOW,
        ),
    ]
    return f"<div>{''.join(map(figure, plots))}</div>"


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
            unit = next((c.units[name] for c in (a, b) if c is not None and c.units.get(name)), "")
            plots.append(Plot(name, "t in s", label(name, unit), lines))
    return plots
