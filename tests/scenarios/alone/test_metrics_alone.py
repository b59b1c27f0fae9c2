"""Every metric against its definition written out row by row, whole and in chunks of any length."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from hystfmu.base.errors import InputError
from hystfmu.scenario.outcome.metrics import Measure, measure
from hystfmu.scenario.outcome.trace import Trace
from hystfmu.scenario.system.spec import MetricSpec

H, RIPPLE, N = 0.25, 3, 31
RNG = np.random.default_rng(np.random.SeedSequence().entropy)
SEED = int(RNG.integers(2**31))


def metric(kind: str, **more: Any) -> MetricSpec:
    return MetricSpec.model_validate({"kind": kind, "signal": "a.y", "against": "b.y", **more})


def trace(signal: Any, against: Any, first: int = 0, ripple: int = RIPPLE) -> Trace:
    t = H * np.arange(first, first + len(signal))
    return Trace(t, np.column_stack([signal, against]), {"a.y": 0, "b.y": 1}, ripple, {}, first)


def chunked(m: MetricSpec, whole: Trace, length: int) -> float:
    found = Measure(m)
    for k in range(0, len(whole.t), length):
        rows = slice(k, k + length)
        found.add(trace(whole["a.y"][rows], whole["b.y"][rows], k, whole.ripple))
    return found.value()


def between(y: list[float], r: list[float], first: int) -> float:
    """Largest distance of the error from the straight line between two samples."""
    e, largest = [a - b for a, b in zip(y, r, strict=True)], 0.0
    for k in range(first, len(e)):
        left, right = k // RIPPLE * RIPPLE, -(-k // RIPPLE) * RIPPLE
        if left < first:  # before the first sample of the window: from its value
            largest = max(largest, abs(e[k] - e[right]))
            continue
        share = (k - left) / RIPPLE
        largest = max(largest, abs(e[k] - e[left] - share * (e[min(right, len(e) - 1)] - e[left])))
    return largest


def variation(y: list[float], r: list[float], first: int) -> float:
    at = [k for k in range(len(y)) if k % RIPPLE == 0 and k >= first]
    moved = [sum(abs(x[b] - x[a]) for a, b in itertools.pairwise(at)) for x in (y, r)]
    return moved[0] / moved[1]


def area(y: list[float], r: list[float], first: int) -> float:
    """Shoelace formula over the polygon of the window, closed by its last side; of the rectangle of the spans."""
    x, z = r[first:], y[first:]
    twice = sum(x[k - 1] * z[k] - x[k] * z[k - 1] for k in range(len(x)))
    return 100 * abs(twice) / 2 / ((max(x) - min(x)) * (max(z) - min(z)))


DEFINITIONS: dict[str, Callable[[list[float], list[float], int], float]] = {
    "rms": lambda y, r, f: math.sqrt(sum((a - b) ** 2 for a, b in zip(y[f:], r[f:], strict=True)) / (len(y) - f)),
    "rms_percent": lambda y, r, f: 100 * DEFINITIONS["rms"](y, r, f) / (max(r[f:]) - min(r[f:])),
    "max_percent": lambda y, r, f: (
        100 * max(abs(a - b) for a, b in zip(y[f:], r[f:], strict=True)) / (max(r[f:]) - min(r[f:]))
    ),
    "between_samples_percent": lambda y, r, f: 100 * between(y, r, f) / (max(r[f:]) - min(r[f:])),
    "variation_ratio": variation,
    "peak": lambda y, r, f: max(abs(v) for v in y[f:]),
    "final": lambda y, r, f: abs(y[-1] - r[-1]),
    "loop_area_percent": area,
}


@pytest.mark.parametrize("kind", list(DEFINITIONS))
@pytest.mark.parametrize("skip", [0, 6, 7])
def test_a_metric_is_its_definition(kind: str, skip: int) -> None:
    rng = np.random.default_rng(SEED)
    y, r = (rng.normal(size=N) for _ in range(2))
    m = metric(kind, after=skip * H)
    want = DEFINITIONS[kind](y.tolist(), r.tolist(), skip)
    whole = trace(y, r)
    assert measure(m, whole) == pytest.approx(want, rel=1e-12), SEED
    for length in (1, 2, 4, 9, 30):
        assert chunked(m, whole, length) == pytest.approx(want, rel=1e-12), (SEED, length)
    lower = measure(m, trace(-y, -r))  # mirrored: lowest and highest change places
    assert lower == pytest.approx(want, rel=1e-12)


def test_a_stroke_of_zero_is_refused_and_a_given_one_is_taken() -> None:
    rests = trace([1.0, 2.0], [3.0, 3.0])
    with pytest.raises(InputError, match=r"^the stroke is zero: b\.y does not move; give 'stroke'$"):
        measure(metric("max_percent"), rests)
    assert measure(metric("max_percent", stroke=4.0), rests) == 50.0
    assert measure(metric("rms"), rests) == math.sqrt(2.5)


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
    m = metric(kind, lines=True, stroke=100.0)
    assert chunked(m, whole, 7) == measure(m, whole)
    bow = np.linspace(0, 60, 1000) ** 2
    assert measure(metric("rms_percent", lines=True, stroke=1.0), trace(bow, bow)) == np.inf
    with pytest.raises(ValueError, match="'lines' belongs to"):
        metric("variation_ratio", lines=True)
