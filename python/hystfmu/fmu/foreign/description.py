"""Reader of the model description of a foreign FMU, and check that the FMU has a binary for this platform."""

import math
import os
import xml.etree.ElementTree as ET
from pathlib import Path
from typing import Any

from hystfmu.base import InputError
from hystfmu.fmu.foreign.instance import version

_VERSIONS = ("1.", "2.", "3.")
_XML = "modelDescription.xml"


def read_description(path: str | Path, folder: Path) -> tuple[Any, ET.Element]:
    """Return the model description of the FMU that is unpacked in `folder`; `path` is the archive, for messages.

    The result is the description read by fmpy, and the root element of the file, because fmpy ignores some elements.

    Raises
    ------
    InputError
        The file is not XML, or its content cannot be read.
    """
    import fmpy

    try:
        root = ET.parse(folder / _XML).getroot()
    except (OSError, ET.ParseError, LookupError, ValueError) as e:  # LookupError and ValueError: unknown encoding
        raise InputError(f"{path}: {_XML}: {e}") from None
    stated = root.get("fmiVersion", "")
    if not stated.startswith(_VERSIONS):
        raise InputError(f"{path}: {_XML}: fmiVersion must be 1.0, 2.0 or 3.0. Got {stated!r} instead.")
    try:
        description = fmpy.read_model_description(str(folder), validate=False)
    except Exception as e:
        raise InputError(f"{path}: {_XML}: {_reason(folder, e)[:300]}") from None
    experiment = description.defaultExperiment
    for name in ("startTime", "stopTime", "stepSize") if experiment is not None else ():
        if not _is_number(text := getattr(experiment, name, None)):
            raise InputError(f"{path}: {_XML}: DefaultExperiment: {name} must be a number. Got {text!r} instead.")
    return description, root


def _is_number(text: Any) -> bool:
    try:
        return text is None or not math.isnan(float(text))
    except ValueError:
        return False


def _reason(folder: Path, error: Exception) -> str:
    """Return the error that the schema finds, with its line, or otherwise the error of fmpy without a line."""
    from fmpy.model_description import ValidationError, read_model_description

    try:
        read_model_description(str(folder), validate=True)
    except ValidationError as e:
        return str(e.problems[0]).removeprefix("ERROR ")
    except Exception as e:
        error = e
    return " ".join(str(error).split())


def check_binary(path: str | Path, folder: Path, description: Any) -> None:
    """Refuse an FMU that has no binary for this platform.

    Raises
    ------
    InputError
        The binary is missing. The message names the missing file, the available platforms, and a remedy.
    """
    from fmpy import platform, platform_tuple, sharedLibraryExtension

    name = (description.coSimulation or description.modelExchange).modelIdentifier or ""
    if not name or set(name) & set("/\\"):
        raise InputError(f"{path}: {_XML}: modelIdentifier must be the name of a file. Got {name!r} instead.")
    own = platform_tuple if version(description) == 3 else platform
    binaries = folder / "binaries"
    file = f"{name}{sharedLibraryExtension}"
    if os.path.isfile(binaries / own / file):  # also False if the name is too long for the system
        return
    others = sorted(p.name for p in binaries.iterdir() if p.is_dir()) if binaries.is_dir() else []
    have = f"it has binaries for {', '.join(others)}" if others else "it has no binaries"
    if own in others:
        have = f"there is {', '.join(sorted(p.name for p in (binaries / own).iterdir())) or 'nothing'}"
    sources = ", or build one from its sources" if (folder / "sources").is_dir() else ""
    raise InputError(
        f"{path}: no binary for this platform: binaries/{own}/{file[:100]} is missing; {have[:200]}. "
        f"Ask its maker for one for {own}{sources}."
    )
