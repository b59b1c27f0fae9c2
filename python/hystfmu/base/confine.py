"""Confine native code of others to files that it needs, without network: Landlock and seccomp of Linux.

What a process has given up, no call of its own brings back, nor one of the processes that it starts.  Both need no
rights and leave what is open already: results and output of the process.

Landlock: https://docs.kernel.org/userspace-api/landlock.html; seccomp: seccomp(2), linux/filter.h, linux/seccomp.h.
This module imports the standard library alone: it runs before anything else is loaded.
"""

from __future__ import annotations

import ctypes as C
import os
import platform
import site
import stat
import struct
import sys
from collections.abc import Iterable
from contextlib import suppress
from dataclasses import dataclass

_CREATE_RULESET, _ADD_RULE, _RESTRICT_SELF = 444, 445, 446  # on every architecture
_EXECUTE, _WRITE_FILE, _READ_FILE, _READ_DIR, _TRUNCATE, _IOCTL = 1, 1 << 1, 1 << 2, 1 << 3, 1 << 14, 1 << 15
_READ = _EXECUTE | _READ_FILE | _READ_DIR
_OF_A_FILE = _EXECUTE | _WRITE_FILE | _READ_FILE | _TRUNCATE | _IOCTL
_RIGHTS = {1: (1 << 13) - 1, 2: (1 << 14) - 1, 3: (1 << 15) - 1, 5: (1 << 16) - 1}  # by version of Landlock
_TCP = 3  # bind, connect; from version 4
_SCOPES = 3  # abstract sockets, signals to other processes; from version 6
_NO_NEW_PRIVILEGES, _GET_SECCOMP, _SET_SECCOMP, _FILTER = 38, 21, 22, 2
_X32 = 0x40000000
# its number, and those of socket, add_key, request_key, keyctl, shmget, semget, msgget, mq_open, io_uring_setup
_ARCHITECTURES = {
    "x86_64": (0xC000003E, (41, 248, 249, 250, 29, 64, 68, 240, 425)),
    "aarch64": (0xC00000B7, (198, 217, 218, 219, 194, 190, 186, 180, 425)),
}
_ALLOW, _REFUSE, _KILL = 0x7FFF0000, 0x00050000 | 13, 0x80000000  # 13: EACCES
CANNOT = 125  # status of a process that could not be confined

# programs, libraries and their settings; neither homes nor /tmp, /var, /srv, /mnt and the like
_SYSTEM = ("/usr", "/lib", "/lib32", "/lib64", "/bin", "/sbin", "/etc", "/opt", "/nix", "/gnu", "/proc", "/sys")
_DEVICES = ("/dev/null", "/dev/zero", "/dev/full", "/dev/random", "/dev/urandom")
_TEMPORARY = ("TMPDIR", "TMP", "TEMP")


@dataclass(frozen=True)
class Box:
    """What confined code may use beside system folders and Python.

    Parameters
    ----------
    folder : str
        Its own folder, absolute: it may write there, and nowhere else.
    read : tuple of str
        Further files and folders that it may read.
    """

    folder: str
    read: tuple[str, ...] = ()

    @classmethod
    def of(cls, folder: str | os.PathLike[str], *read: str | os.PathLike[str]) -> Box:
        """Make a box in which this Python runs."""
        python = [sys.prefix, sys.base_prefix, sys.exec_prefix, os.path.realpath(sys.executable), *_packages()]
        libraries = os.environ.get("LD_LIBRARY_PATH", "").split(os.pathsep)
        known = dict.fromkeys(os.path.abspath(p) for p in (*python, *libraries, *read) if p)
        return cls(os.path.abspath(folder), tuple(known))


def _packages() -> list[str]:
    here = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
    given = os.environ.get("PYTHONPATH", "").split(os.pathsep)
    return [here, *site.getsitepackages(), site.getusersitepackages(), *given]


def _libc() -> C.CDLL:
    return C.CDLL(None, use_errno=True)


def _landlock() -> int:
    """Return the version of Landlock of the running kernel; 0 without."""
    if sys.platform != "linux":
        return 0
    return max(0, int(_libc().syscall(_CREATE_RULESET, None, C.c_size_t(0), C.c_uint32(1))))


def _seccomp() -> bool:
    if sys.platform != "linux" or platform.machine() not in _ARCHITECTURES or sys.maxsize < 2**32:
        return False
    return int(_libc().prctl(_GET_SECCOMP, 0, 0, 0, 0)) >= 0


def unconfined() -> str:
    """Return what this system cannot keep native code from; an empty string if it can."""
    version = _landlock()
    may = ["truncate your files" if version else "read and write your files"] if version < 3 else []
    return " and ".join(may if _seccomp() else [*may, "use the network"])


def confine(box: Box) -> None:
    """Confine this process, which has one thread, as far as the system can.

    Its own folder becomes the current and the temporary one.

    Raises
    ------
    OSError
        The system can, but refuses.
    """
    os.chdir(box.folder)
    os.environ.update(dict.fromkeys(_TEMPORARY, box.folder))
    version, filters = _landlock(), _seccomp()
    if version or filters:
        _call("prctl", _NO_NEW_PRIVILEGES, 1, 0, 0, 0)
    if version:
        _confine_files(box, version)
    if filters:
        _confine_network()


def _call(name: str, *arguments: object) -> int:
    result: int = getattr(_libc(), name)(*[C.c_ulong(a) if isinstance(a, int) else a for a in arguments])
    if result < 0:
        number = C.get_errno()
        raise OSError(number, os.strerror(number))
    return result


def _confine_files(box: Box, version: int) -> None:
    rights = _RIGHTS[max(v for v in _RIGHTS if v <= version)]
    attributes = [rights, *[_TCP] * (version >= 4), *[_SCOPES] * (version >= 6)]
    packed = struct.pack(f"={len(attributes)}Q", *attributes)
    rules = _call("syscall", _CREATE_RULESET, packed, len(packed), 0)
    try:
        _allow(rules, (*_SYSTEM, *box.read), rights & _READ)
        _allow(rules, _DEVICES, rights & (_READ | _WRITE_FILE | _TRUNCATE))
        _allow(rules, [box.folder], rights)
        _call("syscall", _RESTRICT_SELF, rules, 0)
    finally:
        os.close(rules)


def _allow(rules: int, paths: Iterable[str], rights: int) -> None:
    for path in paths:
        with suppress(FileNotFoundError, NotADirectoryError, PermissionError):
            handle = os.open(path, os.O_PATH | os.O_CLOEXEC)
            try:
                file = not stat.S_ISDIR(os.fstat(handle).st_mode)
                rule = struct.pack("=Qi", rights & _OF_A_FILE if file else rights, handle)
                _call("syscall", _ADD_RULE, rules, 1, rule, 0)
            finally:
                os.close(handle)


def _confine_network() -> None:
    """Refuse new sockets of every kind: one to a local service would undo all other limits.

    Also refused are keys of the user, and memory and queues of System V and POSIX that other processes share.  io_uring
    makes sockets without their system call.  A program of another architecture has other numbers of calls: it ends.
    """
    architecture, refused = _ARCHITECTURES[platform.machine()]
    load, equal, least, end = 0x20, 0x15, 0x35, 0x06
    program = [
        (load, 0, 0, 4),  # the architecture of the caller
        (equal, 1, 0, architecture),
        (end, 0, 0, _KILL),
        (load, 0, 0, 0),  # the number of the call
        (least, len(refused) + 1, 0, _X32),
        *[(equal, len(refused) - k, 0, call) for k, call in enumerate(refused)],
        (end, 0, 0, _ALLOW),
        (end, 0, 0, _REFUSE),
    ]
    code = C.create_string_buffer(b"".join(struct.pack("=HBBI", *line) for line in program))
    filter_ = C.create_string_buffer(struct.pack("@HP", len(program), C.addressof(code)))
    _call("prctl", _SET_SECCOMP, _FILTER, filter_, 0, 0)
