"""Rows that are kept of a run in chunks, and a run put together again."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from hystfmu.base.errors import InputError
from hystfmu.scenario.outcome import trace
from hystfmu.scenario.outcome.trace import Picture, Sweeps, Trace
from hystfmu.scenario.system.spec import MetricSpec

ENDS = {"a.y": 0, "b.y": 1, "c.y": 2}


def run(n: int, seed: int = 1) -> Trace:
    return Trace(0.5 * np.arange(n), np.random.default_rng(seed).normal(size=(n, 3)), ENDS, 1)


def chunks(whole: Trace, *edges: int) -> list[Trace]:
    pieces = []
    for a, b in zip([0, *edges], [*edges, len(whole.t)], strict=True):
        last = {"a": "0"} if b == len(whole.t) else {}
        pieces.append(Trace(whole.t[a:b], whole.values[a:b], ENDS, 1, last, a, Sweeps(2 * (b - a), b - a, b - a)))
    return pieces


def metric(kind: str, signal: str = "a.y", against: str | None = "b.y") -> MetricSpec:
    return MetricSpec.model_validate({"kind": kind, "signal": signal} | ({"against": against} if against else {}))


# ---- a run in one piece --------------------------------------------------------------------------------------------


def test_a_trace_that_is_too_large_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(trace, "MOST_VALUES", 30)
    assert len(Trace.joined(chunks(run(10), 5), 10).t) == 10
    with pytest.raises(InputError, match=r"^a trace would hold 11 rows of 3 values, more than 30: take its chunks$"):
        Trace.joined(chunks(run(11), 5), 11)


def test_a_trace_in_words() -> None:
    t = Trace(np.array([0.0, 0.25]), np.zeros((2, 4)), {f"{n}.y": k for k, n in enumerate("abcd")}, 1)
    assert repr(t) == "Trace(2 rows to t = 0.25 s, a.y, b.y, c.y, d.y)"
    more = Trace(t.t, np.zeros((2, 5)), {f"{n}.y": k for k, n in enumerate("abcde")}, 1)
    assert repr(more).endswith("d.y, ...)")
    assert more["c.y"].tolist() == more.values[:, 2].tolist()


# ---- a picture -----------------------------------------------------------------------------------------------------
def case(*metrics: MetricSpec) -> Any:
    return SimpleNamespace(metrics={f"m{k}": m for k, m in enumerate(metrics)}, record=("c.y",), loops=())


def picture(n: int, monkeypatch: pytest.MonkeyPatch, *metrics: MetricSpec, most: int = 12) -> tuple[Trace, Picture]:
    monkeypatch.setattr(trace, "MOST_ROWS", most)
    monkeypatch.setattr(trace, "SHORTEST_CHUNK", 64)
    return run(n), Picture(SimpleNamespace(n_steps=n - 1, case=case(*metrics)))  # type: ignore[arg-type]


def test_without_an_error_only_spaced_rows_are_kept(monkeypatch: pytest.MonkeyPatch) -> None:
    whole, found = picture(32, monkeypatch, metric("rms"))
    found.add(whole)
    assert (2 * found.trace().t).tolist() == [0, 8, 16, 24, 31]
