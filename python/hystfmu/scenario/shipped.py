"""Where the scenarios of this project are: installed with the package, or in the checkout that it runs from."""

from __future__ import annotations

from pathlib import Path

from hystfmu.base.errors import InputError
from hystfmu.base.package_files import PACKAGE


def shipped_scenarios() -> Path:
    """The folder that holds a folder for each scenario, and their models.

    Raises
    ------
    InputError
        The package came without them.
    """
    for folder in (PACKAGE / "_scenarios", PACKAGE.parents[1] / "scenarios"):
        if folder.is_dir():
            return folder
    raise InputError(f"no scenarios in {PACKAGE / '_scenarios'}: install the package with 'pip install .'")
