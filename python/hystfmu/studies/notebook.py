"""A study in a notebook: its answer as HTML, its metrics as a figure."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from hystfmu.base.errors import InputError
from hystfmu.base.printable import escape
from hystfmu.report.page import Table, table
from hystfmu.report.plot import Figure
from hystfmu.studies.figures import distribution
from hystfmu.studies.summary import PERCENTILES, Row, Summary

MOST_FAILED, MOST_PLOTS = 5, 6
HEAD = ("case", "metric", "limit", "% within", *(f"{p} %" for p in PERCENTILES), "worst")


def outcome_html(summary: Summary | None, failed: Sequence[Row], files: Sequence[Path]) -> str:
    """Return the answer of a study as HTML without scripts, everything escaped."""
    parts = []
    if summary is not None:
        parts.append(f"<p>{escape(summary.sentence)}</p>")
        rows = [
            (s.case, s.metric, _or_blank(s.limit), _or_blank(s.within, 100), *s.percentiles, s.worst)
            for s in summary.spreads
        ]
        parts.append(table(Table(HEAD, rows)))
    if failed:
        shown = [(r["index"], r["case"], r["status"], r["reason"]) for r in failed[:MOST_FAILED]]
        parts.append(table(Table(("row", "case", "status", "reason"), shown, f"{len(failed)} runs failed")))
    return "".join([*parts, *(f"<p>{escape(str(f))}</p>" for f in files)])


def _or_blank(value: float | None, times: float = 1.0) -> float | str:
    return "" if value is None else times * value


def distributions(rows: Sequence[Row], summary: Summary | None) -> Figure:
    """Draw how the metrics of the runs that succeeded are distributed: those with a limit, or all.

    Raises
    ------
    InputError
        There is no such run.
    """
    good = [r for r in rows if r["status"] == "ok"]
    limits = {(s.case, s.metric): s.limit for s in summary.spreads} if summary is not None else {}
    all_of = dict.fromkeys((r["case"], name) for r in good for name in r["metrics"])
    wanted = [key for key in all_of if limits.get(key) is not None] or list(all_of)
    plots = []
    for case, name in wanted[:MOST_PLOTS]:
        values = np.array([r["metrics"][name] for r in good if r["case"] == case and name in r["metrics"]])
        if (values := values[np.isfinite(values)]).size:
            plots.append(distribution(f"{name}, {case}", name, values, limits.get((case, name))))
    if not plots:
        raise InputError("A study must have a run that succeeded to plot. Got none.")
    return Figure(plots)
