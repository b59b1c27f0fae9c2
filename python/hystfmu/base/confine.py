"""Confine foreign native code on Linux to the files that it needs, without access to network or other processes.

The module uses Landlock, filters of seccomp(2), and the removal of capabilities(7). None of them needs privileges. They
do not affect files that are already open, such as the result and output files of the process. Neither the process nor
its child processes can regain the rights that the process has given up.

Landlock: https://docs.kernel.org/userspace-api/landlock.html. Filters: linux/filter.h, linux/seccomp.h. This module
imports only the standard library, because it runs before anything else is loaded.
"""

import ctypes as C
import os
import platform
import re
import site
import stat
import struct
import sys
from collections.abc import Iterable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from itertools import count

_READ_BOUND, _DROP_BOUND = 23, 24  # options of prctl(2) for the bounding set of capabilities
_VERSION_3 = 0x20080522  # version of capset(2) with three sets of 64 bits


def libc() -> C.CDLL:
    """Return the C library of this process."""
    return C.CDLL(None, use_errno=True)


def call(name: str, *arguments: object) -> int:
    """Call a function of the C library that returns a negative number on failure; return its result.

    Raises
    ------
    OSError
        The function failed.
    """
    result: int = getattr(libc(), name)(*[C.c_ulong(a) if isinstance(a, int) else a for a in arguments])
    if result < 0:
        number = C.get_errno()
        raise OSError(number, os.strerror(number))
    return result


def drop_capabilities() -> None:
    """Remove all capabilities of this thread.

    Programs that the thread starts cannot regain capabilities. The bounding set is emptied if the system permits this,
    and the process has already given up the right to gain privileges.

    Raises
    ------
    OSError
        The system does not permit the removal.
    """
    with suppress(OSError):  # EINVAL: all capabilities of this kernel are removed; EPERM: no right to remove them
        for number in count():
            if call("prctl", _READ_BOUND, number):
                call("prctl", _DROP_BOUND, number)
    # also empties the ambient set, which never exceeds the others
    call("capset", struct.pack("=Ii", _VERSION_3, 0), bytes(24))


_GET_SECCOMP, _SET_SECCOMP, _FILTER = 21, 22, 2
_X32 = 0x40000000
_AUDIT = {"x86_64": 0xC000003E, "aarch64": 0xC00000B7}
# numbers of system calls on x86_64 and aarch64
_REFUSED = {
    # a socket to a local service would bypass all other limits; io_uring opens sockets without the system call `socket`
    "socket": (41, 198),
    "io_uring_setup": (425, 425),
    # access to keys of the user, and to memory and queues that other processes share
    "add_key": (248, 217),
    "request_key": (249, 218),
    "keyctl": (250, 219),
    "shmget": (29, 194),
    "semget": (64, 190),
    "msgget": (68, 186),
    "mq_open": (240, 180),
    # access to memory, files and counters of another process
    "ptrace": (101, 117),
    "pidfd_getfd": (438, 438),
    "kcmp": (312, 272),
    "process_madvise": (440, 440),
    "process_mrelease": (448, 448),
    "perf_event_open": (298, 241),
}
# the first argument of these calls is a process number; 0 is the calling process
_OF_A_PROCESS = {
    "prlimit64": (302, 261),
    "sched_setparam": (142, 118),
    "sched_setscheduler": (144, 119),
    "sched_setaffinity": (203, 122),
    "sched_setattr": (314, 274),
    "migrate_pages": (256, 238),
    "move_pages": (279, 239),
    "process_vm_readv": (310, 270),
    "process_vm_writev": (311, 271),
}
# the second argument of these calls is a process, a group or a user, as stated by the first argument
_OF_A_KIND = {"setpriority": (0, 141, 140), "ioprio_set": (1, 251, 30)}
# calls that send signals; needed for versions of Landlock that do not refuse signals to processes outside the box
_SIGNALS = {
    "kill": (62, 129),
    "tkill": (200, 130),
    "tgkill": (234, 131),
    "rt_sigqueueinfo": (129, 138),
    "rt_tgsigqueueinfo": (297, 240),
}
_PIDFD_SEND_SIGNAL, _FCNTL, _IOCTL_CALL = (424, 424), (72, 25), (16, 29)
_OWNERS = (8, 15)  # F_SETOWN, F_SETOWN_EX: choose the process that gets the signals of a file
# TIOCSTI and TIOCLINUX enter text in the terminal of the user; FIOSETOWN and SIOCSPGRP have the effect of F_SETOWN
_CONTROLS = (0x5412, 0x541C, 0x8901, 0x8902)

_LOAD, _JUMP, _EQUAL, _LEAST, _END = 0x20, 0x05, 0x15, 0x35, 0x06
_ALLOW, _REFUSE, _KILL = 0x7FFF0000, 0x00050000 | 13, 0x80000000  # 13: EACCES
_Line = tuple[int, ...]  # filter instruction: code, of comparisons the lines to skip if true and if false, value


def can_refuse() -> bool:
    """Return whether the running system supports filters of system calls."""
    if sys.platform != "linux" or platform.machine() not in _AUDIT or sys.maxsize < 2**32:
        return False
    return int(libc().prctl(_GET_SECCOMP)) >= 0


def refuse_calls(signals: bool) -> None:
    """Install a filter that refuses system calls that affect services or other processes of the user.

    Calls that act on the calling process itself are permitted. A filter knows only process numbers, so it treats
    another thread as another process. A program for another processor architecture uses other call numbers, so the
    filter kills this program. With `signals`, the filter also refuses signals to all other processes, including
    processes that this process starts. Raises OSError if the system refuses the filter.
    """
    machine = list(_AUDIT).index(platform.machine())
    me = os.getpid()
    rules = [_rule(numbers[machine]) for numbers in _REFUSED.values()]
    rules += [_rule(numbers[machine], _among(0, 0, me)) for numbers in _OF_A_PROCESS.values()]
    for kind, *numbers in _OF_A_KIND.values():
        rules.append(_rule(numbers[machine], _among(0, kind), _among(1, 0, me)))
    rules.append(_rule(_IOCTL_CALL[machine], _not_among(1, *_CONTROLS)))
    if signals:
        rules += [_rule(numbers[machine], _among(0, me)) for numbers in _SIGNALS.values()]
        rules += [_rule(_PIDFD_SEND_SIGNAL[machine]), _rule(_FCNTL[machine], _not_among(1, *_OWNERS))]
    program = [
        (_LOAD, 4),  # load the architecture of the calling program
        (_EQUAL, 1, 0, _AUDIT[platform.machine()]),
        (_END, _KILL),
        (_LOAD, 0),  # load the number of the system call
        (_LEAST, 0, 1, _X32),
        (_END, _REFUSE),
        *[line for rule in rules for line in rule],
        (_END, _ALLOW),
    ]
    code = C.create_string_buffer(
        b"".join(struct.pack("=HxxI" if len(line) == 2 else "=HBBI", *line) for line in program)
    )
    filter_ = C.create_string_buffer(struct.pack("@HP", len(program), C.addressof(code)))
    call("prctl", _SET_SECCOMP, _FILTER, filter_)


def _rule(number: int, *tests: list[_Line]) -> list[_Line]:
    """Return the filter instructions for a system call.

    A call without tests is always refused. A call with tests is permitted only if it passes all tests.
    """
    lines = [line for test in tests for line in test]
    lines.append((_END, _ALLOW if tests else _REFUSE))
    return [(_EQUAL, 0, len(lines), number), *lines]


def _among(argument: int, *values: int) -> list[_Line]:
    return [*_compared(argument, values), (_END, _REFUSE)]


def _not_among(argument: int, *values: int) -> list[_Line]:
    return [*_compared(argument, values), (_JUMP, 1), (_END, _REFUSE)]


def _compared(argument: int, values: tuple[int, ...]) -> list[_Line]:
    """Return instructions that skip one instruction if the lower 32 bits of an argument equal one of the values.

    The upper 32 bits are ignored.
    """
    lines = [(_EQUAL, len(values) - k, 0, value) for k, value in enumerate(values)]
    return [(_LOAD, 16 + 8 * argument), *lines]


# environment variables for foreign code; others may contain keys and passwords; SECURITY.md has the same list
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
    """Return those of the given environment variables that foreign code may read."""
    return {name: value for name, value in variables.items() if _KNOWN.fullmatch(name)}


_CREATE_RULESET, _ADD_RULE, _RESTRICT_SELF = 444, 445, 446  # numbers of system calls, equal on all architectures
_EXECUTE, _WRITE_FILE, _READ_FILE, _READ_DIR, _TRUNCATE, _IOCTL = 1, 1 << 1, 1 << 2, 1 << 3, 1 << 14, 1 << 15
_READ = _EXECUTE | _READ_FILE | _READ_DIR
_OF_A_FILE = _EXECUTE | _WRITE_FILE | _READ_FILE | _TRUNCATE | _IOCTL
_RIGHTS = {1: (1 << 13) - 1, 2: (1 << 14) - 1, 3: (1 << 15) - 1, 5: (1 << 16) - 1}  # file rights of a version
_TCP = 3  # rights to bind and to connect, from version 4
_SCOPES, _SCOPED = 3, 6  # scopes for abstract sockets and for signals to other processes, from version 6
_NO_NEW_PRIVILEGES = 38
CANNOT = 125  # exit status of a process that could not be confined

# folders of programs, libraries and their settings; no home folders, and not /tmp, /var, /srv, /mnt
_SYSTEM = ("/usr", "/lib", "/lib32", "/lib64", "/bin", "/sbin", "/etc", "/opt", "/nix", "/gnu", "/proc", "/sys")
_DEVICES = ("/dev/null", "/dev/zero", "/dev/full", "/dev/random", "/dev/urandom")
_TEMPORARY = ("TMPDIR", "TMP", "TEMP")


@dataclass(frozen=True)
class Box:
    """Files and folders that confined code may use in addition to system folders and Python.

    Parameters
    ----------
    folder : str
        Absolute path of the only folder into which the code may write.
    read : tuple of str
        Further files and folders that the code may read.
    """

    folder: str
    read: tuple[str, ...] = ()

    @classmethod
    def of(cls, folder: str | os.PathLike[str], *read: str | os.PathLike[str]) -> "Box":
        """Return a box with the given paths, in which code may also read the files of this Python installation."""
        python = [sys.prefix, sys.base_prefix, sys.exec_prefix, os.path.realpath(sys.executable), *_packages()]
        libraries = os.environ.get("LD_LIBRARY_PATH", "").split(os.pathsep)
        paths = dict.fromkeys(os.path.abspath(p) for p in (*python, *libraries, *read) if p)
        return cls(os.path.abspath(folder), tuple(paths))


def _packages() -> list[str]:
    here = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
    given = os.environ.get("PYTHONPATH", "").split(os.pathsep)
    return [here, *site.getsitepackages(), site.getusersitepackages(), *given]


def _landlock() -> int:
    """Return the version of Landlock in the running kernel; 0 without Landlock."""
    if sys.platform != "linux":
        return 0
    return max(0, int(libc().syscall(_CREATE_RULESET, None, C.c_size_t(0), C.c_uint32(1))))


def unconfined() -> str:
    """Return what unconfined code may do on this system, as a text; empty if the system offers all protections."""
    version = _landlock()
    may = ["truncate your files" if version else "read and write your files"] if version < 3 else []
    return " and ".join(may if can_refuse() else [*may, "use the network", "act on your other processes"])


def confine(box: Box) -> None:
    """Confine this single-threaded process to a box, as far as the system supports it.

    The folder of the box becomes the current folder and the folder of temporary files. The process loses its
    capabilities, and all environment variables that `known` does not return.

    Raises
    ------
    OSError
        The system supports confinement, but the confinement fails.
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


def _attributes(version: int) -> list[int]:
    """Return what a version of Landlock can refuse: rights to files, to the network, and scopes."""
    rights = _RIGHTS[max(v for v in _RIGHTS if v <= version)]
    return [rights, *[_TCP] * (version >= 4), *[_SCOPES] * (version >= _SCOPED)]


def _confine_files(box: Box, version: int) -> None:
    attributes = _attributes(version)
    packed = struct.pack(f"={len(attributes)}Q", *attributes)
    rights, rules = attributes[0], call("syscall", _CREATE_RULESET, packed, len(packed), 0)
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
