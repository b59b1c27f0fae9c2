"""The controller of a case as an FMU."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

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
        Pack the binary of this machine, or those of all platforms that are installed.
    source : bool
        Pack the C source too.

    Raises
    ------
    InputError
        The controller cannot be cut out of the case, or the file cannot be written.
    """
    from hystfmu.fmu.write.export import export_fmu

    found = controller(case)
    return Written(export_fmu(found.model, path, fmi, name, platforms, source, one_step=True), found)
