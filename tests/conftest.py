"""Measured data (never part of the repository), and the cases of a grid that run by default."""

import gc
import os
import random
from collections.abc import Generator
from pathlib import Path

import pytest

# small matrices: more threads only wait for each other, for minutes when other work shares the cores
for library in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(library, "1")

ROOT = Path(__file__).parent.parent


@pytest.fixture(scope="session")
def measured() -> Path:
    """Folder with measured data: $HYSTFMU_DATA, else ../shared/data beside the repository."""
    folder = Path(os.environ.get("HYSTFMU_DATA", ROOT.parent / "shared" / "data"))
    if not folder.is_dir():
        pytest.skip(f"measured data not found in {folder}; set HYSTFMU_DATA")
    return folder


@pytest.hookimpl(wrapper=True)
def pytest_collection() -> Generator[None, object, object]:
    """Collect without the garbage collector, which would spend half of the time on the tests and modules that stay.

    Afterwards it leaves them out for good, so that a collection within a test is short.
    """
    gc.disable()
    try:
        return (yield)
    finally:
        gc.enable()
        gc.freeze()


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Mark the cases of a test with the marker `some(n)` as stress, except n cases, drawn anew in each parallel run.

    The processes of one run draw the same. In `make stress` every case has the mark. Of n < 1, the share n of the cases
    runs: one case in this share of the runs; all of them where one process runs the tests, as for `make mutants`.
    """
    grids: dict[str, list[pytest.Item]] = {}
    for item in items:
        if item.get_closest_marker("some"):
            grids.setdefault(item.nodeid.partition("[")[0], []).append(item)
    run = os.environ.get("PYTEST_XDIST_TESTRUNUID", "")
    for name, cases in grids.items():
        short = [case for case in cases if not case.get_closest_marker("stress")]
        n = cases[0].get_closest_marker("some").args[0] if config.getoption("markexpr") == "not stress" else 0  # type: ignore[union-attr]
        draw = random.Random(run + name)
        if 0 < n < 1:
            n = int(n * len(short) + draw.random()) if run else len(short)
        kept = draw.sample(short, min(n, len(short)))
        for case in cases:
            if case not in kept:
                case.add_marker(pytest.mark.stress)
