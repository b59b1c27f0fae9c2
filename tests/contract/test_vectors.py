"""Runs tests/vectors/{published,derived}/*.toml: numbers from outside the code, each with its source.

One file per block, a list of [[case]]:
    source     where the numbers come from: author, year, equation, table or page; or the closed form (required)
    note       what the case shows
    dims       sizes of the block             values   parameters
    h, t0      step and start time in seconds
    u          input rows ([] for a block without inputs): row 0 at initialisation, then one row per step
    y          output rows, all outputs in the order of the table
    tolerance  largest absolute difference
"""

import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from hystfmu.core.library import block_types
from hystfmu.graph import Graph, Node

VECTORS = Path(__file__).parents[1] / "vectors"
KEYS = {"source", "note", "dims", "values", "h", "t0", "u", "y", "tolerance"}
REQUIRED = {"source", "u", "y", "tolerance"}

FILES = sorted(VECTORS.glob("*/*.toml"))


def cases() -> list[Any]:
    return [
        pytest.param(f.stem, case, id=f"{f.parent.name}-{f.stem}-{i}")
        for f in FILES
        for i, case in enumerate(tomllib.loads(f.read_text())["case"])
    ]


@pytest.mark.parametrize(("name", "case"), cases())
def test_vector(name: str, case: dict[str, Any]) -> None:
    assert set(case) >= REQUIRED, f"missing: {REQUIRED - set(case)}"
    assert set(case) <= KEYS, f"unknown: {set(case) - KEYS}"
    assert len(case["source"].split()) >= 2, "a source says who and where, or which closed form"
    graph = Graph.single(Node(name, name, case.get("dims", {}), case.get("values", {})))
    expected = np.asarray(case["y"], dtype=float)
    u = np.asarray(case["u"], dtype=float).reshape(len(case["y"]), graph.n_inputs)
    y = graph.run(u, case.get("h", 1.0), case.get("t0", 0.0)).reshape(len(u), -1)
    assert expected.shape == y.shape
    assert np.abs(y - expected).max() <= case["tolerance"]


@pytest.mark.parametrize("file", FILES, ids=lambda f: f"{f.parent.name}-{f.stem}")
def test_file_names_a_block(file: Path) -> None:
    assert file.stem in block_types(), f"no block {file.stem}: rename {file.name}, or write the block"
    assert file.parent.name in ("published", "derived")
