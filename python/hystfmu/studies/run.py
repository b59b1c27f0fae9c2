"""Run a study file, and write its table and report. An interrupted study can be resumed."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from hystfmu.base import InputError, checked, extras
from hystfmu.report.plot import Figure
from hystfmu.scenario import Run, build
from hystfmu.studies.figures import distributions, outcome_html
from hystfmu.studies.pool import DaskPool, Pool
from hystfmu.studies.report import write_report
from hystfmu.studies.spec import LOOP_METRICS, Study, StudySpec
from hystfmu.studies.store import Store
from hystfmu.studies.summary import Summary, summarise
from hystfmu.studies.task import OUTSIDE, Task, fingerprint, identity, row_of, sampler

if TYPE_CHECKING:
    import pandas

_LIMIT_OF = {"timeout": "timeout", "memory": "memory", "killed": "memory"}  # native code crashes if it has no memory


def with_limits(row: dict[str, Any], spec: StudySpec) -> dict[str, Any]:
    """Return a row of the table in the form in which it is stored.

    The row of a failed run also contains the limits of time and memory.
    """
    return row if row["status"] == "ok" else row | {"limits": {"timeout": spec.timeout, "memory": spec.memory}}


def is_final(row: dict[str, Any], spec: StudySpec, retry: bool) -> bool:
    """Return whether a stored row needs no new run under the present limits. With `retry`, failed rows run again."""
    if row["status"] == "ok":
        return True
    limit = _LIMIT_OF.get(row["status"], "")
    raised = limit in row.get("limits", {}) and getattr(spec, limit) > row["limits"][limit]
    return not (retry or raised)


Progress = Callable[[int, int, float], None]
"""Called with the number of finished rows, the total number, and the rate of this run (rows/s)."""


@dataclass(frozen=True)
class Outcome:
    """Results of a study.

    Parameters
    ----------
    rows : list of dict
        Rows of the table in the order of their index.
    table, report : Path
        Paths of results.parquet and report.html.
    ran : int
        Number of runs of this call. The other rows existed before.
    seconds : float
        Duration of this call (s).
    summary : Summary, optional
        Share of the variations inside the limits. None for the method 'optuna', whose variations are not random.
    seed : int
        Seed of the variations.
    """

    rows: list[dict[str, Any]]
    table: Path
    report: Path
    ran: int
    seconds: float
    summary: Summary | None = None
    seed: int = 0

    def __repr__(self) -> str:
        return f"Outcome({len(self.rows)} rows, {len(self.failed)} failed, {str(self.table)!r})"

    def _repr_html_(self) -> str:
        """Return HTML for a notebook: result, percentiles, failed runs, and paths of the table and the report."""
        return outcome_html(self.summary, self.failed, [self.table, self.report])

    def to_pandas(self) -> pandas.DataFrame:
        """Return a data frame with one row for each run: variation, case, parameters, metrics, status and reason.

        Raises
        ------
        MissingExtra
            pandas is not installed.
        """
        with extras("to_pandas()"):
            import pandas
        rows = [
            {"variation": r["variation"], "case": r["case"], **r["values"], **r["metrics"]}
            | {"status": r["status"], "reason": r["reason"]}
            for r in self.rows
        ]
        return pandas.DataFrame(rows, index=pandas.Index([r["index"] for r in self.rows], name="index"))

    def plot(self) -> Figure:
        """Plot the distributions of the metrics with a limit, or of all metrics if no metric has a limit.

        Returns
        -------
        Figure
            A notebook shows the figure; `Figure.save` writes a file.

        Raises
        ------
        InputError
            No run has succeeded.
        """
        return distributions(self.rows, self.summary)

    @property
    def failed(self) -> list[dict[str, Any]]:
        """Rows of failed runs."""
        return [r for r in self.rows if r["status"] not in ("ok", OUTSIDE)]


@checked
def study(
    path: str | Path,
    folder: str | Path | None = None,
    *,
    workers: int | None = None,
    on: str | None = None,
    retry: Literal["failed"] | None = None,
    confined: bool = True,
    progress: Progress = lambda done, total, rate: None,
) -> Outcome:
    """Run a scenario over many variations; an interrupted study resumes.

    Parameters
    ----------
    path : str or Path
        A file ``*.study.toml``.
    folder : str or Path, optional
        Folder for the table and the report. If the folder already contains results of this study, only the missing runs
        are simulated.

        The default is a folder with the name of the study file, in the current folder.
    workers : int in [1, 1024], optional
        Number of local processes. The default is one process per processor core.
    on : str, optional
        Run the study on a Dask cluster instead of local processes. The scheduler of the cluster is at
        ``dask://HOST:PORT``.
    retry : {"failed"}, optional
        Repeat the runs that failed. Without this option, a failed run is repeated only if it exceeded a limit of time
        or memory and this limit is now higher.
    confined : bool
        Whether foreign FMUs are confined: they have no access to the network and can write only to one private folder.
        Some operating systems do not offer this protection.
    progress : function, optional
        Called with the number of finished rows, the number of all rows, and rows per second.

    Returns
    -------
    Outcome
        The outcome has the attributes `rows`, `table` and `report`; the last two are files.

    Raises
    ------
    InputError
        The study or the scenario is invalid, the disk is full, or the cluster is not available. Finished rows are kept.

    Examples
    --------
    >>> import hystfmu as hy
    >>> from pathlib import Path
    >>> loop = hy.Scenario("loop", step=1e-3, stop=0.01).add("source", hy.blocks.Reference(frequency=50.0))
    >>> folder = loop.metric("peak", "peak", "source.r").save("loop")
    >>> lines = ['name = "size"', 'scenario = "loop"', 'method = "grid"', "[parameters]"]
    >>> lines.append('"source.amplitude" = { values = [1.0, 2.0, 3.0] }')
    >>> characters = Path("size.study.toml").write_text("\\n".join(lines))
    >>> outcome = hy.study("size.study.toml", workers=1)
    >>> [round(row["metrics"]["peak"], 6) for row in outcome.rows]
    [1.0, 2.0, 3.0]
    """
    folder = Path(Path(path).name.removesuffix(".toml").removesuffix(".study")) if folder is None else Path(folder)
    plan = Study(path)
    systems = [build(c) for c in plan.cases]
    middle = {k: p.at(0.5) for k, p in plan.parameters.items()}
    for name in plan.settings(middle):
        if not any(name in system.parameters for system in systems):
            raise InputError(f"{plan.file}: parameters: no case has a unit with the parameter {name!r}")
    marks = [fingerprint(s) for s in systems]
    metrics = [*systems[0].case.metrics, *(LOOP_METRICS if plan.spec.margins else ())]
    store = Store(folder, list(plan.parameters), metrics, f"{plan.spec.name} of {plan.cases[0].scenario}")
    if plan.spec.seed == "run":
        plan.seed = store.seed()
    begin, order, ran = time.monotonic(), dict[str, int](), 0
    run = Run(plan.spec.engine, seconds=plan.spec.timeout, gigabytes=plan.spec.memory, confined=confined)
    pool = DaskPool(on, systems, run) if on is not None else Pool(systems, run, workers)
    first = there = 0
    try:
        with pool:
            kept = (row for row in store.rows() if is_final(row, plan.spec, retry == "failed"))
            known = {row["id"]: row for row in kept}
            proposals = sampler(plan)
            total = proposals.n * len(systems)
            for batch in proposals.batches():
                reasons = [proposals.outside(k) for k in range(len(batch))]
                missing = _Missing(_tasks(plan, batch, marks, first), known)
                missing.leave_out = {first + k: reason for k, reason in enumerate(reasons) if reason}
                for row in pool.run(missing, len(batch) * len(marks)):
                    store.append(with_limits(row, plan.spec))
                    known[row["id"]] = row
                    ran += 1
                    progress(there + missing.there + ran, total, ran / max(time.monotonic() - begin, 1e-9))
                for t in missing.left_out:
                    reason = f"breaks a limit of the loop: {missing.leave_out[t.variation]}"
                    row = row_of(t, plan.cases[t.case].name, OUTSIDE, reason)
                    store.append(row)
                    known[row["id"]] = row
                first += len(batch)
                there += missing.there
                order |= {t.id: t.index for t in missing.all}
                k = len(systems)
                of_variation = [missing.all[i : i + k] for i in range(0, len(missing.all), k)]
                proposals.tell([[known[t.id] for t in tasks] for tasks in of_variation])
            rows = [known[i] | {"index": n} for i, n in sorted(order.items(), key=lambda item: item[1])]
            table = store.finish(rows)
            summary = summarise(plan, systems, rows)
            report = write_report(plan, systems, rows, summary, folder)
    finally:
        store.close()
    return Outcome(rows, table, report, ran, time.monotonic() - begin, summary, plan.seed)


def _tasks(study: Study, batch: list[dict[str, float]], marks: list[str], first: int) -> Iterator[Task]:
    for k, values in enumerate(batch):
        settings = study.settings(values)
        for c, mark in enumerate(marks):
            variation, margins = first + k, study.cases[c].name == study.spec.margins
            name = identity(mark, settings, margins)
            yield Task(variation * len(marks) + c, variation, c, name, values, settings, margins)


class _Missing:
    """Iterator over the tasks that have no row in the table yet.

    Each task occurs once, even if a sampler proposes a variation twice.

    Each task is created on demand, while other tasks run. At the end, `all` contains every task, and `there` is the
    number of tasks that already had a row. Tasks of the variations in `leave_out` do not run. They are stored in
    `left_out`.
    """

    def __init__(self, tasks: Iterator[Task], known: Mapping[str, object]) -> None:
        self._tasks, self._known = tasks, known
        self.all: list[Task] = []
        self.left_out: list[Task] = []
        self.leave_out: Mapping[int, str] = {}
        self.there = 0

    def __iter__(self) -> Iterator[Task]:
        asked: set[str] = set()
        for t in self._tasks:
            self.all.append(t)
            if t.id in self._known or t.id in asked:
                self.there += 1
                continue
            asked.add(t.id)
            if t.variation in self.leave_out:
                self.there += 1
                self.left_out.append(t)
                continue
            yield t
