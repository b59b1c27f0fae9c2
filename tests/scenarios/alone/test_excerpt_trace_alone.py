"""Rows that are kept of a run in chunks, and a run put together again."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from hystfmu.base.errors import InputError
from hystfmu.scenario.outcome import trace
from hystfmu.scenario.outcome.trace import Excerpt, Picture, Stopped, Sweeps, Trace, drawn
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
def test_a_run_is_joined_from_its_chunks() -> None:
    whole = run(10)
    found = Trace.joined(chunks(whole, 3, 4), 10)
    assert found.t.tolist() == whole.t.tolist()
    assert found.values.tolist() == whole.values.tolist()
    assert (found.columns, found.ripple, found.first, found.final_states) == (ENDS, 1, 0, {"a": "0"})
    assert found.sweeps == Sweeps(20, 6, 10)
    (one,) = chunks(whole)
    assert Trace.joined([one], 10) is one


def test_a_trace_that_is_too_large_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(trace, "MOST_VALUES", 30)
    assert len(Trace.joined(chunks(run(10), 5), 10).t) == 10
    with pytest.raises(InputError, match=r"^a trace would hold 11 rows of 3 values, more than 30: take its chunks$"):
        Trace.joined(chunks(run(11), 5), 11)


def test_sweeps_add_up() -> None:
    some = Sweeps(5, 3, 2)
    some.add(Sweeps(7, 2, 4))
    assert some == Sweeps(12, 3, 6)
    some.add(Sweeps(9, 9, 1))
    assert some == Sweeps(21, 9, 7)


def test_a_trace_in_words() -> None:
    t = Trace(np.array([0.0, 0.25]), np.zeros((2, 4)), {f"{n}.y": k for k, n in enumerate("abcd")}, 1)
    assert repr(t) == "Trace(2 rows to t = 0.25 s, a.y, b.y, c.y, d.y)"
    more = Trace(t.t, np.zeros((2, 5)), {f"{n}.y": k for k, n in enumerate("abcde")}, 1)
    assert repr(more).endswith("d.y, ...)")
    assert more["c.y"].tolist() == more.values[:, 2].tolist()


def test_a_reason_has_a_status() -> None:
    assert (str(Stopped("why")), Stopped("why").status, Stopped("why", "killed").status) == ("why", "stopped", "killed")


# ---- some rows -----------------------------------------------------------------------------------------------------
@pytest.mark.parametrize("edges", [(), (1,), (3, 4), (2, 6, 9)])
def test_stated_rows_are_kept(edges: tuple[int, ...]) -> None:
    whole, rows = run(12), np.array([0, 3, 4, 9, 11])
    kept = Excerpt(["c.y", "a.y", "c.y"], rows)
    for chunk in chunks(whole, *edges):
        kept.add(chunk)
    found = kept.trace()
    assert found.columns == {"c.y": 0, "a.y": 1}
    assert found.t.tolist() == whole.t[rows].tolist()
    assert found["a.y"].tolist() == whole["a.y"][rows].tolist()
    assert found["c.y"].tolist() == whole["c.y"][rows].tolist()
    assert found.final_states == {"a": "0"}
    assert kept.trace().t.tolist() == found.t.tolist()


def test_chunks_without_such_rows_leave_nothing() -> None:
    kept = Excerpt(["a.y"], np.array([0, 1]))
    for chunk in chunks(run(12), 4, 8):
        kept.add(chunk)
    assert len(kept._pieces) == 1


# ---- a picture -----------------------------------------------------------------------------------------------------
def case(*metrics: MetricSpec) -> Any:
    return SimpleNamespace(metrics={f"m{k}": m for k, m in enumerate(metrics)}, record=("c.y",), loops=())


def test_the_error_in_percent_is_drawn() -> None:
    peak, rms, percent = metric("peak", against=None), metric("rms"), metric("max_percent")
    assert drawn(case(peak, rms, percent, metric("rms_percent"))) is percent
    assert drawn(case(peak, rms)) is None
    assert drawn(case()) is None
    area = metric("between_samples_percent", "c.y", "a.y")
    assert drawn(case(peak, area)) is area


def picture(n: int, monkeypatch: pytest.MonkeyPatch, *metrics: MetricSpec, most: int = 12) -> tuple[Trace, Picture]:
    monkeypatch.setattr(trace, "MOST_ROWS", most)
    monkeypatch.setattr(trace, "SHORTEST_CHUNK", 64)
    return run(n), Picture(SimpleNamespace(n_steps=n - 1, case=case(*metrics)))  # type: ignore[arg-type]


def test_a_short_run_is_kept_as_a_whole(monkeypatch: pytest.MonkeyPatch) -> None:
    whole, found = picture(12, monkeypatch, metric("rms_percent"))
    found.add(whole)
    assert found.trace().t.tolist() == whole.t.tolist()
    assert set(found.trace().columns) == {"c.y", "a.y", "b.y"}


@pytest.mark.parametrize(("n", "stride"), [(13, 4), (16, 4), (17, 8), (32, 8), (33, 16), (64, 16), (1000, 64)])
def test_a_long_run_keeps_every_other_row_and_the_extremes_between(
    monkeypatch: pytest.MonkeyPatch, n: int, stride: int
) -> None:
    """At most a third of the rows is spaced: each piece may add two."""
    whole, found = picture(n, monkeypatch, metric("rms_percent"))
    e = whole["a.y"] - whole["b.y"]
    want = {*range(0, n, stride), n - 1}
    for begin in range(0, n, stride):
        piece = e[begin : begin + stride]
        want |= {begin + int(piece.argmin()), begin + int(piece.argmax())}
    found.add(whole)
    assert (2 * found.trace().t).tolist() == sorted(want)


def test_a_picture_in_chunks_is_that_of_the_whole(monkeypatch: pytest.MonkeyPatch) -> None:
    whole, found = picture(60, monkeypatch, metric("rms_percent"))
    other = picture(60, monkeypatch, metric("rms_percent"))[1]
    found.add(whole)
    for chunk in chunks(whole, 16, 48):
        other.add(chunk)
    assert other.trace().t.tolist() == found.trace().t.tolist()


def test_without_an_error_only_spaced_rows_are_kept(monkeypatch: pytest.MonkeyPatch) -> None:
    whole, found = picture(32, monkeypatch, metric("rms"))
    found.add(whole)
    assert (2 * found.trace().t).tolist() == [0, 8, 16, 24, 31]
