"""Measured data (never part of the repository), and the cases and tests that run by default."""

import gc
import os
import random
from collections.abc import Generator
from pathlib import Path
from typing import Any

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


@pytest.hookimpl(wrapper=True)
def pytest_make_collect_report(collector: pytest.Collector) -> Generator[None, Any, Any]:
    """Let the second of two processes collect from the end: each compiles half of the files. The order is restored."""
    report = yield
    if os.environ.get("PYTEST_XDIST_WORKER") == "gw1" and isinstance(collector, pytest.Dir):
        report.result.reverse()
    return report


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Mark as stress the cases of grids and the tests that this run leaves out.

    Of a test with the marker `some(n)`, n cases run; of n < 1, the share n of the cases runs: one case in this share of
    the runs. Of all tests with the marker `turn(topic)`, one runs; those that share a `name` run together.

    Both are drawn anew in each parallel run, and the processes of one run draw the same. Where one process runs the
    tests, as for `make mutants`, n < 1 means all cases, and all tests of a topic run. In `make stress` every case has
    the mark.
    """
    if "PYTEST_XDIST_WORKER" in os.environ:
        items.sort(key=lambda item: item.path)
    grids: dict[str, list[pytest.Item]] = {}
    topics: dict[str, dict[str, list[pytest.Item]]] = {}
    for item in items:
        test = item.nodeid.partition("[")[0]
        if item.get_closest_marker("some"):
            grids.setdefault(test, []).append(item)
        if (turn := item.get_closest_marker("turn")) and not item.get_closest_marker("stress"):
            topics.setdefault(turn.args[0], {}).setdefault(turn.kwargs.get("name", test), []).append(item)
    run, short_run = os.environ.get("PYTEST_XDIST_TESTRUNUID", ""), config.getoption("markexpr") == "not stress"
    left: list[pytest.Item] = []
    for name, cases in grids.items():
        short = [case for case in cases if not case.get_closest_marker("stress")]
        n = cases[0].get_closest_marker("some").args[0] if short_run else 0  # type: ignore[union-attr]
        draw = random.Random(run + name)
        if 0 < n < 1:
            n = int(n * len(short) + draw.random()) if run else len(short)
        kept = draw.sample(short, min(n, len(short)))
        left += [case for case in cases if case not in kept]
    for topic, tests in topics.items():
        drawn = random.Random(run + topic).choice(sorted(tests))
        left += [case for name, cases in tests.items() for case in cases if not short_run or (run and name != drawn)]
    for case in left:
        case.add_marker(pytest.mark.stress)
