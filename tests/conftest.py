"""Fixtures of the whole suite: where measured data lies (never part of the repository)."""

import os
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
