"""Chromium driven by playwright, and the core for pages."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from hystfmu.report.explorer import CORE

if TYPE_CHECKING:
    from playwright.sync_api import Browser

NAMES = ("chromium", "chromium-browser", "google-chrome")


@pytest.fixture(scope="module")
def core() -> Path:
    """The core for pages."""
    if not CORE.exists():
        pytest.skip("no core for pages: make platforms")
    return CORE


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    """One browser for a module: another module may run an event loop of its own."""
    sync_api = pytest.importorskip("playwright.sync_api", reason="no playwright (pip install playwright)")
    program = next((found for name in NAMES if (found := shutil.which(name))), None)
    if program is None:
        pytest.skip("no chromium")
    with sync_api.sync_playwright() as running:
        made = running.chromium.launch(executable_path=program, args=["--no-sandbox"])
        yield made
        made.close()
