"""The controller of a case as an FMU, and as C files for a target."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from hystfmu.base.errors import InputError
from hystfmu.base.files import write_bytes
from hystfmu.base.replacing import together
from hystfmu.scenario.deploy.unit import Controller, controller
from hystfmu.scenario.system.case import Case


@dataclass(frozen=True)
class Written:
    """A controller that was written to `path`."""

    path: Path
    controller: Controller


def write_controller(
    case: Case,
    path: str | Path,
    fmi: Literal[2, 3] = 2,
    name: str | None = None,
    platforms: Literal["host", "all"] = "host",
    source: bool = False,
) -> Written:
    """Write the controller of a case as an FMU, which an importer calls at each sample.

    Parameters
    ----------
    case : Case
    path : path
        Usually ``*.fmu``.
    fmi : {2, 3}
        Version of the standard.
    name : str, optional
        Name of the FMU; by default that of the scenario.
    platforms : {"host", "all"}
        Pack the binary of this machine, or those of all platforms; one that is not installed is an error.
    source : bool
        Pack the C source too.

    Raises
    ------
    InputError
        The controller cannot be separated from the case, or the file cannot be written.
    """
    from hystfmu.fmu.write.export import export_fmu

    found = controller(case)
    return Written(export_fmu(found.model, path, fmi, name, platforms, source), found)


def write_target(case: Case, folder: str | Path, name: str | None = None) -> tuple[list[Path], Controller]:
    """Write the controller of a case as a header and one C file, without FMI and without allocation.

    Parameters
    ----------
    case : Case
    folder : path
        For ``NAME.h`` and ``NAME.c``.
    name : str, optional
        Of the files, and the begin of every public symbol; by default that of the scenario.

    Returns
    -------
    files : list of Path
    controller : Controller

    Raises
    ------
    InputError
        The controller cannot be separated from the case, the name is not valid in C, or a file cannot be written.
    """
    from hystfmu.fmu.write.target import target_files

    found, name = controller(case), case.scenario if name is None else name
    if not re.fullmatch("[A-Za-z][A-Za-z0-9_]*", name):
        raise InputError(f"The name must be a letter followed by letters, digits or _. Got {name!r} instead.")
    assert found.model.step is not None
    files = target_files(found.model.graph, name, found.model.step, found.model.text)
    with together():
        for file, content in files.items():
            write_bytes(Path(folder) / file, content)
    return [Path(folder) / file for file in files], found
