"""Figures of a page: three digits, and no error below the floor is a figure."""

import pytest

from hystfmu.report.page import figure_of, percent


@pytest.mark.parametrize(
    ("value", "text"),
    [(5.58e-17, "< 0.001"), (0.0, "< 0.001"), (0.00099, "< 0.001"), (0.001, "0.001"), (12.345, "12.3"), (-2.0, "-2")],
)
def test_percent(value: float, text: str) -> None:
    assert percent(value) == text


def test_the_floor_is_that_of_percents() -> None:
    assert figure_of(1e-6, "rms_percent") == "< 0.001"
    assert figure_of(1e-6, "rms") == "1e-06"
