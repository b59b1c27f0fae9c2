"""Metrics against values known in closed form."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from hystfmu.base.errors import InputError
from hystfmu.scenario.outcome.metrics import Measure, measure
from hystfmu.scenario.outcome.trace import Trace
from hystfmu.scenario.system.spec import MetricSpec


def trace(signal: Any, against: Any, ripple: int = 1, h: float = 0.001) -> Trace:
    t = h * np.arange(len(signal))
    return Trace(t, np.column_stack([signal, against]), {"a.y": 0, "b.y": 1}, ripple)


def metric(kind: str, **more: Any) -> MetricSpec:
    return MetricSpec.model_validate({"kind": kind, "signal": "a.y", "against": "b.y", **more})


PHASE = 2 * np.pi * np.arange(1000) / 100  # ten whole periods
WAVE = trace(np.sin(PHASE) + 0.02 * np.cos(PHASE), np.sin(PHASE))


def test_rms_of_a_cosine_error_in_percent_of_the_span() -> None:
    # stroke 2 (the span of the reference), error amplitude 0.02: 100 * 0.02 / sqrt(2) / 2
    assert measure(metric("rms_percent"), WAVE) == pytest.approx(1 / np.sqrt(2), rel=1e-12)
    assert measure(metric("rms_percent", stroke=4.0), WAVE) == pytest.approx(0.5 / np.sqrt(2), rel=1e-12)


def test_largest_error() -> None:
    assert measure(metric("max_percent"), WAVE) == pytest.approx(1.0, rel=1e-12)


def test_the_window_begins_at_after() -> None:
    e = np.zeros(100)
    e[49] = 7.0
    ramp = np.linspace(0, 1, 100)
    assert measure(metric("max_percent", after=0.050, stroke=1.0), trace(ramp + e, ramp)) < 1e-12
    assert measure(metric("max_percent", after=0.049, stroke=1.0), trace(ramp + e, ramp)) == pytest.approx(700)


@pytest.mark.parametrize("kind", ["rms_percent", "max_percent"])
def test_lines_leave_out_the_turn_arounds(kind: str) -> None:
    """A scan whose error is 0.3 on the lines and 5 in the turn-arounds; in one piece and in chunks of seven rows."""
    down = np.arange(40.0, 0, -1)
    turn = 40 + np.array([0.8, 1.2, 1.2, 0.8])
    scan = np.concatenate([np.arange(0, 41.0), turn, down])
    bent = np.abs(np.diff(scan, 2)) > 0.01
    on = ~np.concatenate([[True, True], bent])  # two steps tell whether a row is on a line
    whole = trace(scan + np.where(on, 0.3, 5.0), scan)
    assert measure(metric(kind, lines=True, stroke=100.0), whole) == pytest.approx(0.3)
    assert measure(metric(kind, stroke=100.0), whole) > 0.5
    m = Measure(metric(kind, lines=True, stroke=100.0))
    for k in range(0, len(scan), 7):
        rows = slice(k, k + 7)
        m.add(Trace(whole.t[rows], whole.values[rows], whole.columns, 1, k))
    assert m.value() == measure(metric(kind, lines=True, stroke=100.0), whole)
    assert measure(metric("rms_percent", lines=True, stroke=1.0), trace(PHASE**2, PHASE**2)) == np.inf
    with pytest.raises(ValueError, match="'lines' belongs to"):
        metric("variation_ratio", lines=True)


def test_ripple_is_what_samples_do_not_show() -> None:
    k = np.arange(101)
    bump = (k % 10) * (10 - k % 10) / 25  # zero at the samples, 1 half-way between
    drift = 0.5 * k  # a straight error has no ripple
    assert measure(metric("between_samples_percent", stroke=100.0), trace(bump + drift, 0 * k, 10)) == pytest.approx(1)
    assert measure(metric("between_samples_percent", stroke=100.0), trace(drift, 0 * k, 10)) < 1e-12


def test_variation_peak_and_final() -> None:
    k = np.arange(101)
    zigzag = k + 3 * (k % 2)  # rises by 4, falls by 2: variation 3 per step instead of 1
    assert measure(metric("variation_ratio"), trace(zigzag, k)) == pytest.approx(3.0)
    assert measure(metric("variation_ratio"), trace(0 * k, 0 * k)) == 1.0
    assert measure(metric("peak"), trace(-2 * k, k)) == 200.0
    assert measure(metric("final"), trace(-2 * k, k)) == 300.0


def test_no_stroke_no_percent() -> None:
    with pytest.raises(InputError, match="stroke is zero"):
        measure(metric("rms_percent"), trace(np.arange(5.0), np.ones(5)))
