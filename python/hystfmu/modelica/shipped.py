"""Location of the Modelica library: in the installed package, or in the checkout."""

from __future__ import annotations

import re
from pathlib import Path

from hystfmu.base import PACKAGE
from hystfmu.base.errors import InputError


def library_date() -> str:
    """Return the day of the version of the library, ``2026-11-21``; exports carry it, so that their bytes repeat."""
    found = re.search(r'versionDate = "([\d-]+)"', (shipped_library() / "HystFMU" / "package.mo").read_text("utf-8"))
    assert found is not None
    return found[1]


def shipped_library() -> Path:
    """Return the folder for the library path (MODELICAPATH); this folder contains the library HystFMU.

    Raises
    ------
    InputError
        The package was installed without the library.
    """
    for folder in (PACKAGE / "_modelica", PACKAGE.parents[1] / "modelica"):
        if (folder / "HystFMU" / "package.mo").is_file():
            return folder
    raise InputError(f"no Modelica library in {PACKAGE / '_modelica'}: install the package with 'pip install .'")
