"""Numbers beside an axis: short, exact, the same in a page as in Python."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pytest

from hystfmu import report
from hystfmu.report.axis import axis, thin, tick

if TYPE_CHECKING:
    from playwright.sync_api import Browser

COMMON = (Path(report.__file__).parent / "script" / "common.js").read_text()


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (0.0, "0"), (0.1 + 0.2, "0.3"), (-0.005, "-0.005"), (115000.0, "115000"), (120000.0, "1.2e5"), (1e6, "1e6"),
        (2e-8, "2e-8"), (-5e299, "-5e299"), (100000.0005, "100000.0005"), (5e-301, "5e-301"),
    ],
)  # fmt: skip
def test_a_number_beside_an_axis(value: float, text: str) -> None:
    assert tick(value) == text


def test_ticks_are_round_inside_the_range_and_told_apart() -> None:
    rng = np.random.default_rng()
    for _ in range(200):
        lo = rng.normal() * 10.0 ** rng.integers(-12, 12)
        values = lo + np.array([0.0, abs(lo) * 10.0 ** rng.uniform(-6, 3) + 1e-12])
        (first, last), at = axis(values)
        assert first < values[0] < values[1] < last
        assert all(first <= v <= last for v in at)
        assert 2 <= len(at) <= 7
        assert len({tick(v) for v in at}) == len(at)
        assert [float(tick(v)) for v in at] == pytest.approx(at, rel=1e-11, abs=1e-9 * (last - first))


def test_a_page_writes_the_same_numbers(browser: Browser) -> None:
    rng = np.random.default_rng()
    spans = [sorted((rng.normal(size=2) * 10.0 ** rng.integers(-9, 9)).tolist()) for _ in range(100)]
    values = [float(f"{v:.12g}") for s in spans for v in axis(np.array(s))[1]]
    values += [5e299, -1e-300, 100000.0005, 115000.0, 1e6, 1e21, 2e-8, 0.0]
    page = browser.new_page()
    program = "([code, values]) => new Function(code + 'return a => a.map(tick);')()(values)"
    found = page.evaluate(program, [COMMON, values])
    page.close()
    assert found == [tick(v) for v in values]


def test_a_thinned_curve_keeps_its_ends_or_its_extremes() -> None:
    x = np.arange(10_000.0)
    y = np.zeros(10_000)
    y[[1234, 7890]] = 1.0, -2.0
    few = thin(x, y, 100)
    assert (len(few[0]), few[0][0], few[0][-1]) == (100, 0.0, 9999.0)
    kept = thin(x, y, 100, envelope=True)
    assert {(1234.0, 1.0), (7890.0, -2.0)} <= set(zip(*(v.tolist() for v in kept), strict=True))
    assert np.all(np.diff(kept[0]) >= 0)
    assert thin(x[:50], y[:50], 100)[0].tolist() == x[:50].tolist()
