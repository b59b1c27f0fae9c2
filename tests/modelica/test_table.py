"""Classes with a twin among the C blocks carry the same names, units, ranges and defaults."""

from __future__ import annotations

import library
import pytest
import table


def test_there_are_twins() -> None:
    assert len(table.PAIRS) >= 40


@pytest.mark.parametrize("name", table.PAIRS)
def test_class_equals_the_table(name: str) -> None:
    assert list(table.differences(library.classes()[name])) == []
