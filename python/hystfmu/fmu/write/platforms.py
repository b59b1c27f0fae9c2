"""Platforms of FMUs: the installed prebuilt binaries, and their folders in FMI 2.0 and 3.0."""

import functools
import platform
import sys
import zlib
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from hystfmu.base import PACKAGE, InputError
from hystfmu.fmu.archive import Deflated
from hystfmu.fmu.write.description import Fmi


@dataclass(frozen=True)
class Platform:
    """A platform with its FMI 3.0 platform tuple, its folder name in FMI 2.0, and the suffix of shared libraries."""

    tuple3: str
    folder2: str
    suffix: str

    def folder(self, fmi: Fmi) -> str:
        """Return the name of the folder of this platform in the folder `binaries` of an FMU."""
        return self.folder2 if fmi == 2 else self.tuple3


# FMI 2.0.4, section 2.3, defines win64, linux64 and darwin64 without a processor. Here, darwin64 contains a universal
# binary for both processors of macOS; other processors of Windows and Linux have their own folders
PLATFORMS = {
    p.tuple3: p
    for p in (
        Platform("x86_64-windows", "win64", "dll"),
        Platform("x86-windows", "win32", "dll"),
        Platform("x86_64-linux", "linux64", "so"),
        Platform("aarch64-linux", "aarch64-linux", "so"),
        Platform("x86_64-darwin", "darwin64", "dylib"),
        Platform("aarch64-darwin", "darwin64", "dylib"),
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
    """Return the platform of this process.

    Raises
    ------
    InputError
        FMI defines no folder for this platform.
    """
    key = (sys.platform, platform.machine())
    if key not in _HOSTS:
        raise InputError(f"no FMU folder is defined for the platform {key[0]} {key[1]}")
    return PLATFORMS[_HOSTS[key]]


def _installed(file: str) -> Path:
    """Return the path of a binary that `make platforms` installs."""
    return PACKAGE / "_platforms" / file


def _path(p: Platform, which: Literal["host", "all"]) -> Path | None:
    """Return the path of the prebuilt binary of a platform; None if it is not installed.

    The same binary serves every FMU.

    An FMU for all platforms contains the cross-compiled binary if there is one, because it runs with older C libraries.
    """
    own, crossed = PACKAGE / f"_fmu.{p.suffix}", _installed(f"{p.tuple3}.{p.suffix}")
    order = (crossed,) if p != host() else (own, crossed) if which == "host" else (crossed, own)
    return next((path for path in order if path.exists()), None)


@functools.cache
def _deflated(path: Path) -> Deflated:
    """Return a compressed binary.

    `make platforms` has compressed the binary in advance, because the compression is too slow for an export.
    """
    content = path.read_bytes()
    made = path.with_name(f"{path.name}.deflate")
    if made.exists():
        stream = made.read_bytes()
        if zlib.decompress(stream, -zlib.MAX_WBITS) == content:  # the compressed file belongs to this binary
            return Deflated(content, stream)
    return Deflated.of(content)


def missing() -> list[str]:
    """Return the names of the platforms whose binaries are not installed."""
    return [p.tuple3 for p in PLATFORMS.values() if _path(p, "all") is None]


def binaries(fmi: Fmi, name: str, which: Literal["host", "all"]) -> dict[str, Deflated]:
    """Return the binaries of an FMU by their paths in its folder `binaries`.

    Raises
    ------
    ImportError
        The binary of this computer is not installed.
    InputError
        All platforms are requested, and the binary of a platform is not installed.
    """
    if _path(host(), which) is None:
        raise ImportError("the compiled FMU binary is missing: install the package with 'pip install .'")
    if which == "all" and (absent := missing()):
        raise InputError(
            f"an FMU for all platforms cannot be written: no binary is installed for {', '.join(absent)}."
            " 'make platforms' in the sources of HystFMU builds them; --platforms host uses that of this computer."
        )
    found = {}
    for p in PLATFORMS.values() if which == "all" else [host()]:
        path = _path(p, which)
        both = _installed(f"{p.folder2}.{p.suffix}")  # universal binary for all processors of this folder
        if which == "all" and fmi == 2 and both.exists():
            path = both
        if path is not None:
            found[f"{p.folder(fmi)}/{name}.{p.suffix}"] = _deflated(path)
    return found
