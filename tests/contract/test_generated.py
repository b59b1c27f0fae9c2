"""What follows from the C tables is up to date: page of the blocks, signatures for editors, Modelica base classes."""

from __future__ import annotations

from pathlib import Path

import pytest

import generator
from hystfmu.graph import listing

ROOT = Path(__file__).parents[2]


@pytest.mark.parametrize(
    ("file", "text"),
    [("python/hystfmu/graph/blocks.pyi", listing.stub), ("python/docs/blocks.md", lambda: listing.markdown("##"))],
    ids=["signatures", "page"],
)
def test_texts_follow_from_the_tables(file, text):
    assert text() in (ROOT / file).read_text(), f"{file} is stale; run 'make generate'"


def test_modelica_follows_from_the_tables():
    assert list(generator.stale(ROOT / "modelica" / "HystFMU")) == []
