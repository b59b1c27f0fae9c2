"""Where the Modelica library of this project is: installed with the package, or in the checkout that it runs from."""

from __future__ import annotations

from pathlib import Path

from hystfmu.base.errors import InputError
from hystfmu.base.package_files import PACKAGE


def shipped_library() -> Path:
    """Return the folder for the library path (MODELICAPATH); it holds the library HystFMU.

    Raises
    ------
    InputError
        If the package came without it.
    """
    for folder in (PACKAGE / "_modelica", PACKAGE.parents[1] / "modelica"):
        if (folder / "HystFMU" / "package.mo").is_file():
            return folder
    raise InputError(f"no Modelica library in {PACKAGE / '_modelica'}: install the package with 'pip install .'")
