"""Fixtures of the whole suite: where measured data lies (never part of the repository)."""

import os
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent


@pytest.fixture(scope="session")
def measured() -> Path:
    """Folder with measured data: $HYSTFMU_DATA, else ../shared/data beside the repository."""
    folder = Path(os.environ.get("HYSTFMU_DATA", ROOT.parent / "shared" / "data"))
    if not folder.is_dir():
        pytest.skip(f"measured data not found in {folder}; set HYSTFMU_DATA")
    return folder
