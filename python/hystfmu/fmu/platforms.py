"""Where the prebuilt binaries lie, and how the two standards call their folders."""

from __future__ import annotations

import functools
import platform
import sys
from dataclasses import dataclass
from pathlib import Path

from hystfmu.errors import InputError
from hystfmu.fmu.description import Fmi

_PACKAGE = Path(__file__).parents[1]


@dataclass(frozen=True)
class Platform:
    """One platform: its FMI 3.0 tuple, the folder in FMI 2.0, the suffix of a shared library."""

    tuple3: str
    folder2: str
    suffix: str

    def folder(self, fmi: Fmi) -> str:
        """The folder below `binaries`."""
        return self.folder2 if fmi == 2 else self.tuple3


# FMI 2.0.4 section 2.3 names win64, linux64, darwin64; for other processors it lets the exporter choose
PLATFORMS = {
    p.tuple3: p
    for p in (
        Platform("x86_64-windows", "win64", "dll"),
        Platform("x86_64-linux", "linux64", "so"),
        Platform("aarch64-linux", "aarch64-linux", "so"),
        Platform("x86_64-darwin", "darwin64", "dylib"),
        Platform("aarch64-darwin", "aarch64-darwin", "dylib"),
    )
}
_HOSTS = {
    ("linux", "x86_64"): "x86_64-linux",
    ("linux", "aarch64"): "aarch64-linux",
    ("darwin", "x86_64"): "x86_64-darwin",
    ("darwin", "arm64"): "aarch64-darwin",
    ("win32", "AMD64"): "x86_64-windows",
}


def host() -> Platform:
    """The platform this process runs on.

    Raises
    ------
    InputError
        If FMI has no folder for it that we know.
    """
    key = (sys.platform, platform.machine())
    if key not in _HOSTS:
        raise InputError(f"no FMU folder is defined for the platform {key[0]} {key[1]}")
    return PLATFORMS[_HOSTS[key]]


@functools.cache
def binary(p: Platform) -> bytes | None:
    """The prebuilt binary, the same one in every FMU; None if it is not installed."""
    crossed = _PACKAGE / "_platforms" / f"{p.tuple3}.{p.suffix}"
    own = _PACKAGE / f"_fmu.{p.suffix}"
    for path in (own, crossed) if p == host() else (crossed,):
        if path.exists():
            return path.read_bytes()
    return None
