"""Chromium driven by playwright, and a page of each kind: once for all tests of this folder."""

import os
import shutil
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from compiled import alone
from opened_page import KINDS, Browser

NAMES = ("chromium", "chromium-browser", "google-chrome")
STUDIES = ("study", "compared_studies")


@pytest.fixture(scope="package")
def browser() -> Iterator[Browser]:
    """One browser for the folder: tests of other folders may run an event loop of their own."""
    sync_api = pytest.importorskip("playwright.sync_api", reason="no playwright (pip install playwright)")
    program = next((found for name in NAMES if (found := shutil.which(name))), None)
    if program is None:
        pytest.skip("no chromium")
    with sync_api.sync_playwright() as running:
        made = running.chromium.launch(executable_path=program, args=["--no-sandbox"])
        yield made
        made.close()


@pytest.fixture(scope="session")
def made(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], Path]:
    """A page of a kind, written once for all processes of the run."""
    base = tmp_path_factory.getbasetemp()  # of a process of the run, within that of the run

    def make(kind: str) -> Path:
        if kind in STUDIES:
            pytest.importorskip("pyarrow", reason="a study needs the extra study")
        folder = (base.parent if "PYTEST_XDIST_WORKER" in os.environ else base) / f"page_of_{kind}"
        with alone(folder):
            place = folder / "place"
            if not place.exists():
                place.write_text(str(KINDS[kind](folder)))
        return Path(place.read_text())

    return make
