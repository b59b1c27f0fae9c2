"""Where the prebuilt binaries lie, and how the two standards call their folders."""

from __future__ import annotations

import functools
import platform
import struct
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

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


# FMI 2.0.4 section 2.3 names win64, linux64 and darwin64 without a processor: macOS takes one binary for both of its
# processors there, the others have a folder of their own
PLATFORMS = {
    p.tuple3: p
    for p in (
        Platform("x86_64-windows", "win64", "dll"),
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
def _binary(p: Platform) -> bytes | None:
    """The prebuilt binary, the same one in every FMU; None if it is not installed."""
    crossed = _PACKAGE / "_platforms" / f"{p.tuple3}.{p.suffix}"
    own = _PACKAGE / f"_fmu.{p.suffix}"
    for path in (own, crossed) if p == host() else (crossed,):
        if path.exists():
            return path.read_bytes()
    return None


def missing() -> list[str]:
    """The platforms whose binary is not installed."""
    return [p.tuple3 for p in PLATFORMS.values() if _binary(p) is None]


def _universal(parts: Sequence[bytes]) -> bytes:
    """One macOS binary for several processors: a big-endian header, then each binary at a page (mach-o/fat.h)."""
    page = 1 << 14
    head, body, at = struct.pack(">II", 0xCAFEBABE, len(parts)), b"", page
    for part in parts:
        processor, kind = struct.unpack("<II", part[4:12])
        head += struct.pack(">5I", processor, kind, at, len(part), 14)
        padded = part + bytes(-len(part) % page)
        body, at = body + padded, at + len(padded)
    return head.ljust(page, b"\0") + body


def binaries(fmi: Fmi, name: str, which: Literal["host", "all"]) -> dict[str, bytes]:
    """The binaries of an FMU by their places below `binaries`.

    Raises
    ------
    ImportError
        If not even the binary of this machine is installed.
    """
    if _binary(host()) is None:
        raise ImportError("the compiled FMU binary is missing: install the package with 'pip install .'")
    found: dict[str, list[bytes]] = {}
    for p in PLATFORMS.values() if which == "all" else [host()]:
        content = _binary(p)
        if content is not None:
            found.setdefault(f"{p.folder(fmi)}/{name}.{p.suffix}", []).append(content)
    return {path: parts[0] if len(parts) == 1 else _universal(parts) for path, parts in found.items()}
