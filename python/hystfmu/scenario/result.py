"""Results of a run of scenarios: verdicts, signals, diagrams and report."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from hystfmu.base.errors import InputError
from hystfmu.base.printable import escape
from hystfmu.report.page import Table, table
from hystfmu.report.plot import Figure
from hystfmu.scenario.outcome.result import CaseResult
from hystfmu.scenario.report.cases import case_plots
from hystfmu.scenario.report.page import write_report

if TYPE_CHECKING:
    import pandas

__all__ = ["Result", "Results"]


class Result(CaseResult):
    """Result of one case of a scenario.

    `trace` contains the signals (``result.trace["plant.y"]``), and `verdicts` contains the metrics. `passed` is True if
    all limits are met and no metric differs from the baseline. `failures()` returns a line for each missed limit and
    each difference.

    Parameters
    ----------
    system : System
    verdicts : tuple of Verdict
        One verdict per metric.
    lines : tuple of str
        One line per failure: scenario/case, metric, value, limit.
    trace : Trace, optional
        Signals that the case records or uses in loops and metrics. For a long run, the trace contains only the rows for
        a plot. (`simulate` returns all rows, and `chunks` yields all rows in parts.) The trace is None if a unit
        stopped the run.
    seconds : float
        Duration of the run (s).
    notes : tuple of str
        Remarks on the run that are not failures, for example on discontinuities between two steps.
    counted : Sweeps
        Numbers of sweeps of an iterative coupling.
    loop : LoopFigures, optional
        Margins of the linearised loop of the case, or None if there are none.
    """

    def plot(self) -> Figure:
        """Plot hysteresis loops, recorded signals, and the error including the error between samples.

        Raises
        ------
        InputError
            A unit ended the run with an error, so there are no signals.
        """
        if self.trace is None:
            raise InputError(self.lines[0])
        return Figure(case_plots(self.system, self.trace))

    def report(self, folder: str | Path) -> Path:
        """Write report.html and report.json into `folder`, and return the path of report.html."""
        return Results([self]).report(folder)

    def _repr_html_(self) -> str:
        """Return HTML for a notebook."""
        return Results([self])._repr_html_()


class Results(list[Result]):
    """Results of several cases: a list of the results in `iterable`, in the order of the cases."""

    @property
    def passed(self) -> bool:
        """True if all cases have passed."""
        return all(r.passed for r in self)

    def report(self, folder: str | Path) -> Path:
        """Write report.html and report.json into `folder`, and return the path of report.html."""
        return write_report(self, folder)

    def to_pandas(self) -> pandas.DataFrame:
        """Return a data frame with a row for each metric: scenario, case, metric, value, limit, baseline, within.

        Signals of a case are in ``results[0].trace.to_pandas()``.

        Raises
        ------
        MissingExtra
            pandas is not installed.
        """
        from hystfmu.base.errors import extras

        with extras("to_pandas()"):
            import pandas
        columns = ("metric", "value", "limit", "baseline", "within")
        rows = [(r.scenario, r.case, *(getattr(v, c) for c in columns)) for r in self for v in r.verdicts]
        return pandas.DataFrame(rows, columns=["scenario", "case", *columns])

    def __repr__(self) -> str:
        if len(self) <= 1:
            return f"Results([{', '.join(map(repr, self))}])"
        bad = [r.system.case.title for r in self if not r.passed]
        failed = f"; failed: {', '.join(bad[:3])}{', ...' if len(bad) > 3 else ''}" if bad else ""
        return f"Results({len(self)} cases, {len(self) - len(bad)} passed{failed})"

    def _repr_html_(self) -> str:
        """Return HTML for a notebook."""
        rows = [
            (r.scenario, r.case, v.metric, f"{v.value:.4g}", "" if v.limit is None else f"{v.limit:.4g}", _word(r))
            for r in self
            for v in r.verdicts
        ]
        rows += [(r.scenario, r.case, "", "", "", "stopped") for r in self if not r.verdicts]
        lines = "".join(f"<li>{escape(line)}</li>" for r in self for line in r.lines)
        head = ("scenario", "case", "metric", "value", "limit", "verdict")
        return table(Table(head, rows)) + (f"<ul>{lines}</ul>" if lines else "")


def _word(r: CaseResult) -> str:
    return "passed" if r.passed else "failed"
