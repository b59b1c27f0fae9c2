"""The Reference FMUs of the FMI project, which the folder of measured data may contain."""

import os
from pathlib import Path

import fmpy
import pytest

FOLDER = Path(os.environ.get("HYSTFMU_DATA", Path(__file__).parents[2] / "shared" / "data")) / "reference_fmus"


def reference_fmu(name: str) -> Path:
    """Return the path of an FMU such as "fmi2/Stair"; skip the test that asks if it is absent."""
    path = FOLDER / f"{name}.fmu"
    if not path.exists():
        pytest.skip(f"Reference FMUs not found in {FOLDER}; set HYSTFMU_DATA")
    if fmpy.platform != "linux64":
        pytest.skip("the Reference FMUs at hand are built for x86-64 Linux")
    return path
