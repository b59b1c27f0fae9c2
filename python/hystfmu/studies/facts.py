"""Data of a study for a comparison: report.json contains summary and verdicts, results.parquet contains the rows."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import pydantic
from pydantic import Field

from hystfmu.base.arrays import Array
from hystfmu.base.errors import InputError, extras
from hystfmu.base.files import read_bytes
from hystfmu.scenario.system.system import System
from hystfmu.studies.spec import Study
from hystfmu.studies.summary import Row, Summary, metric_unit, outcomes

KEY = "study"
WORDS = {"i": "inside", "o": "outside", "u": "unstable", "f": "failed"}
MOST_BYTES = 2**28
Share = Annotated[float, Field(ge=0, le=1)]


class Facts(pydantic.BaseModel):
    """Data of a study in its report.json.

    `outcomes` has a letter of `WORDS` for each draw, in the order of the draws.
    """

    model_config = pydantic.ConfigDict(strict=True)
    name: str
    scenario: str
    inside: Annotated[int, Field(ge=0)]
    interval: Annotated[list[Share], Field(min_length=2, max_length=2)] | None
    limits: dict[str, dict[str, Annotated[float, Field(allow_inf_nan=False)]]]
    units: dict[str, str]
    parameters: dict[str, str]
    outcomes: Annotated[str, Field(pattern=f"^[{''.join(WORDS)}]+$")]


def facts(
    study: Study, systems: Sequence[System], labels: Mapping[str, str], rows: Sequence[Row], summary: Summary
) -> dict[str, Any]:
    """Return the data of a study for report.json. `labels` contains the parameters with their units of measure."""
    letters, kinds = {word: letter for letter, word in WORDS.items()}, outcomes(study, systems, rows)
    metrics = {k: metric_unit(s, k) for s in reversed(systems) for k in s.case.metrics}
    found = Facts(
        name=study.spec.name,
        scenario=study.cases[0].scenario,
        inside=summary.inside,
        interval=None if summary.interval is None else list(summary.interval),
        limits={s.case.name: dict(study.limits(s.case)) for s in systems},
        units={k: unit for k, unit in metrics.items() if unit},
        parameters=dict(labels),
        outcomes="".join(letters[kinds[v]] for v in sorted(kinds)),
    )
    return {KEY: found.model_dump()}


@dataclass(frozen=True)
class Read:
    """Data of a study from its files.

    `values` contains the parameters, shape (n, p). `metrics` contains each metric with a limit, shape (n,). A metric of
    a failed run is infinite.
    """

    facts: Facts
    values: Array
    metrics: Mapping[tuple[str, str], Array]


def is_study(path: str | Path) -> bool:
    """Return whether a folder or a report.json belongs to a study; False if the file is not a report."""
    try:
        content = json.loads(read_bytes(_report(path), MOST_BYTES))
    except (ValueError, RecursionError):  # whoever reads it next says what is wrong
        return False
    return isinstance(content, dict) and KEY in content


def read_study(path: str | Path) -> Read:
    """Read a study for a comparison. The path is the folder of the study, or the report.json in this folder.

    An InputError is raised if a file is missing or damaged, or belongs to another study.
    """
    file = _report(path)
    content = read_bytes(file, MOST_BYTES)
    try:
        found = Facts.model_validate(json.loads(content)[KEY])
    except (ValueError, KeyError, TypeError, RecursionError) as e:
        errors = e.errors() if isinstance(e, pydantic.ValidationError) else []
        why = f"{'.'.join(map(str, errors[0]['loc']))}: {errors[0]['msg']}" if errors else "no study"
        raise InputError(f"{file}: not a report of 'hystfmu study': {why}") from None
    table = file.with_name("results.parquet")
    rows = _rows(table)
    try:
        return _in_order(found, rows)
    except (KeyError, TypeError, ValueError):
        raise InputError(f"{table}: not the table of the study in {file.name} beside it") from None


def _report(path: str | Path) -> Path:
    return Path(path) / "report.json" if Path(path).is_dir() else Path(path)


def _rows(table: Path) -> list[dict[str, Any]]:
    with extras("a comparison of studies"):
        import pyarrow as pa
        import pyarrow.parquet as pq
    try:
        found: list[dict[str, Any]] = pq.read_table(pa.BufferReader(read_bytes(table, MOST_BYTES))).to_pylist()
    except (pa.ArrowException, OSError):
        raise InputError(f"{table}: not a table of 'hystfmu study'") from None
    return found


def _in_order(found: Facts, rows: Sequence[Mapping[str, Any]]) -> Read:
    """Sort the rows by draw. A KeyError or a ValueError means that the rows belong to another study."""
    place = {v: k for k, v in enumerate(sorted({r["variation"] for r in rows}))}
    if len(place) != len(found.outcomes):
        raise ValueError
    values = np.full((len(place), len(found.parameters)), np.nan)
    pairs = [(case, metric) for case, limits in found.limits.items() for metric in limits]
    metrics: dict[tuple[str, str], Array] = {pair: np.full(len(place), np.inf) for pair in pairs}
    for r in rows:
        k = place[r["variation"]]
        values[k] = [r[name] for name in found.parameters]
        for metric in found.limits[r["case"]]:
            v = r[f"metric:{metric}"]
            metrics[r["case"], metric][k] = np.inf if v is None or np.isnan(v) else v
    return Read(found, values, metrics)
