"""Confine foreign native code on Linux to the files that it needs, without network and other processes.

Landlock and seccomp need no privileges. They do not affect files that are already open, such as results and output of
the process. Neither the process nor its child processes can regain the rights that the process has given up.

Landlock: https://docs.kernel.org/userspace-api/landlock.html. This module imports only the standard library, because it
runs before anything else is loaded.
"""

from __future__ import annotations

import ctypes as C
import os
import re
import site
import stat
import struct
import sys
from collections.abc import Iterable, Mapping
from contextlib import suppress
from dataclasses import dataclass

from hystfmu.base.system_calls import call, can_refuse, drop_capabilities, libc, refuse_calls

# others may be keys and passwords; SECURITY.md has the same list
_KNOWN = re.compile(
    r"""
      PATH | HOME | USER | LOGNAME | SHELL | TZ | TMPDIR | TMP | TEMP
    | LANG | LANGUAGE | LC_\w+
    | LD_LIBRARY_PATH | LD_PRELOAD | DYLD_\w+
    | PYTHON[A-Z_]+ | VIRTUAL_ENV | CONDA_PREFIX | JAVA_HOME
    | OMP_(NUM_THREADS|STACKSIZE) | (OPENBLAS|MKL|NPY|NUMEXPR|VECLIB)_\w+
    | HYSTFMU_\w+
    # of Windows
    | SYSTEMROOT | SYSTEMDRIVE | WINDIR | COMSPEC | PATHEXT | OS | NUMBER_OF_PROCESSORS | PROCESSOR_\w+
    | USERPROFILE | HOMEDRIVE | HOMEPATH | APPDATA | LOCALAPPDATA | PROGRAMDATA | PROGRAMFILES(\(X86\))?
    """,
    re.VERBOSE,
)


def known(variables: Mapping[str, str]) -> dict[str, str]:
    """Return the variables that foreign code may see."""
    return {name: value for name, value in variables.items() if _KNOWN.fullmatch(name)}


_CREATE_RULESET, _ADD_RULE, _RESTRICT_SELF = 444, 445, 446  # on every architecture
_EXECUTE, _WRITE_FILE, _READ_FILE, _READ_DIR, _TRUNCATE, _IOCTL = 1, 1 << 1, 1 << 2, 1 << 3, 1 << 14, 1 << 15
_READ = _EXECUTE | _READ_FILE | _READ_DIR
_OF_A_FILE = _EXECUTE | _WRITE_FILE | _READ_FILE | _TRUNCATE | _IOCTL
_RIGHTS = {1: (1 << 13) - 1, 2: (1 << 14) - 1, 3: (1 << 15) - 1, 5: (1 << 16) - 1}  # by version of Landlock
_TCP = 3  # bind, connect; from version 4
_SCOPES, _SCOPED = 3, 6  # abstract sockets, signals to other processes; from this version
_NO_NEW_PRIVILEGES = 38
CANNOT = 125  # status of a process that could not be confined

# programs, libraries and their settings; neither homes nor /tmp, /var, /srv, /mnt and the like
_SYSTEM = ("/usr", "/lib", "/lib32", "/lib64", "/bin", "/sbin", "/etc", "/opt", "/nix", "/gnu", "/proc", "/sys")
_DEVICES = ("/dev/null", "/dev/zero", "/dev/full", "/dev/random", "/dev/urandom")
_TEMPORARY = ("TMPDIR", "TMP", "TEMP")


@dataclass(frozen=True)
class Box:
    """Resources of confined code besides system folders and Python.

    Parameters
    ----------
    folder : str
        Own folder of the code, as an absolute path. The code may write only into this folder.
    read : tuple of str
        Further files and folders that the code may read.
    """

    folder: str
    read: tuple[str, ...] = ()

    @classmethod
    def of(cls, folder: str | os.PathLike[str], *read: str | os.PathLike[str]) -> Box:
        """Return a box in which this Python can run."""
        python = [sys.prefix, sys.base_prefix, sys.exec_prefix, os.path.realpath(sys.executable), *_packages()]
        libraries = os.environ.get("LD_LIBRARY_PATH", "").split(os.pathsep)
        paths = dict.fromkeys(os.path.abspath(p) for p in (*python, *libraries, *read) if p)
        return cls(os.path.abspath(folder), tuple(paths))


def _packages() -> list[str]:
    here = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
    given = os.environ.get("PYTHONPATH", "").split(os.pathsep)
    return [here, *site.getsitepackages(), site.getusersitepackages(), *given]


def _landlock() -> int:
    """Return the version of Landlock of the running kernel; 0 without Landlock."""
    if sys.platform != "linux":
        return 0
    return max(0, int(libc().syscall(_CREATE_RULESET, None, C.c_size_t(0), C.c_uint32(1))))


def unconfined() -> str:
    """Return the protections that this system lacks; an empty string if it lacks none."""
    version = _landlock()
    may = ["truncate your files" if version else "read and write your files"] if version < 3 else []
    return " and ".join(may if can_refuse() else [*may, "use the network", "act on your other processes"])


def confine(box: Box) -> None:
    """Confine this single-threaded process as far as the system can.

    The own folder of the process becomes its current and its temporary folder. The process loses capabilities and
    unknown environment variables.

    Raises
    ------
    OSError
        The system supports confinement but refuses it.
    """
    os.chdir(box.folder)
    variables = known(os.environ)
    os.environ.clear()
    os.environ.update(variables | dict.fromkeys(_TEMPORARY, box.folder))
    if sys.platform != "linux":
        return
    version = _landlock()
    call("prctl", _NO_NEW_PRIVILEGES, 1, 0, 0, 0)
    if version:
        _confine_files(box, version)
    drop_capabilities()
    if can_refuse():
        refuse_calls(signals=version < _SCOPED)


def _confine_files(box: Box, version: int) -> None:
    rights = _RIGHTS[max(v for v in _RIGHTS if v <= version)]
    attributes = [rights, *[_TCP] * (version >= 4), *[_SCOPES] * (version >= _SCOPED)]
    packed = struct.pack(f"={len(attributes)}Q", *attributes)
    rules = call("syscall", _CREATE_RULESET, packed, len(packed), 0)
    try:
        _allow(rules, (*_SYSTEM, *box.read), rights & _READ)
        _allow(rules, _DEVICES, rights & (_READ | _WRITE_FILE | _TRUNCATE))
        _allow(rules, [box.folder], rights)
        call("syscall", _RESTRICT_SELF, rules, 0)
    finally:
        os.close(rules)


def _allow(rules: int, paths: Iterable[str], rights: int) -> None:
    for path in paths:
        with suppress(FileNotFoundError, NotADirectoryError, PermissionError):
            handle = os.open(path, os.O_PATH | os.O_CLOEXEC)
            try:
                file = not stat.S_ISDIR(os.fstat(handle).st_mode)
                rule = struct.pack("=Qi", rights & _OF_A_FILE if file else rights, handle)
                call("syscall", _ADD_RULE, rules, 1, rule, 0)
            finally:
                os.close(handle)
