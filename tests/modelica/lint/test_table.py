"""Classes with a twin among the C blocks carry the same names, units, ranges and defaults."""

import library
import pytest
import table

from hystfmu.core.library import block_types


def test_there_are_twins() -> None:
    assert len(table.PAIRS) >= 40


@pytest.mark.parametrize("name", table.PAIRS)
def test_class_equals_the_table(name: str) -> None:
    assert list(table.differences(library.classes()[name])) == []


def test_every_block_has_a_class() -> None:
    classes = [n for n in table.PAIRS if not library.classes()[n].tree.partial]
    assert {table.TWINS[n.rsplit(".", 1)[-1]].name for n in classes} == set(block_types())
