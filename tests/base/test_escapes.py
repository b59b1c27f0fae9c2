"""Confined code acts on no other process, has no capability and sees no secret of the environment."""

import json
import subprocess
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from users import IS_ROOT, User, user  # noqa: F401

from hystfmu.base.confine import unconfined

if unconfined():
    pytest.skip(f"foreign FMUs may {unconfined()} here: needs Landlock and seccomp", allow_module_level=True)

HEAD = """
import ctypes, errno, json, os, subprocess, sys, time
libc = ctypes.CDLL(None, use_errno=True)
def tried(result):
    return "done" if result >= 0 else errno.errorcode[ctypes.get_errno()]
def call(name, *arguments):
    numbers = NUMBERS[name]
    return tried(libc.syscall(numbers[os.uname().machine == "aarch64"], *map(ctypes.c_long, arguments)))
def opened(path, mode="rb"):
    try:
        with open(path, mode) as f:
            f.read(1)
            return "done"
    except OSError as e:
        return errno.errorcode[e.errno]
def address(*numbers, kind=ctypes.c_uint64):
    kept.append((kind * len(numbers))(*numbers))
    return ctypes.addressof(kept[-1])
kept = []
NUMBERS = {
    "prlimit64": (302, 261), "setpriority": (141, 140), "ioprio_set": (251, 30), "sched_setaffinity": (203, 122),
    "sched_setscheduler": (144, 119), "sched_setparam": (142, 118), "sched_setattr": (314, 274), "kill": (62, 129),
    "tkill": (200, 130), "tgkill": (234, 131), "rt_sigqueueinfo": (129, 138), "pidfd_open": (434, 434),
    "pidfd_send_signal": (424, 424), "pidfd_getfd": (438, 438), "ptrace": (101, 117),
    "process_vm_readv": (310, 270), "process_vm_writev": (311, 271), "process_madvise": (440, 440),
    "ioctl": (16, 29), "fcntl": (72, 25),
    "kcmp": (312, 272), "migrate_pages": (256, 238), "move_pages": (279, 239), "perf_event_open": (298, 241),
}
"""
# on the process PID; 1 << 32 is cut off by the system
ON_ANOTHER = """
high = 1 << 32
pidfd = libc.syscall(434, PID, 0)
found = {
    "prlimit64": call("prlimit64", PID, 1, address(0, 0), 0),
    "prlimit64, high bits": call("prlimit64", PID + high, 1, address(0, 0), 0),
    "setpriority": call("setpriority", 0, PID, 19),
    "ioprio_set": call("ioprio_set", 1, PID, 3 << 13),
    "sched_setaffinity": call("sched_setaffinity", PID, 8, address(1)),
    "sched_setscheduler": call("sched_setscheduler", PID, 5, address(0)),
    "sched_setparam": call("sched_setparam", PID, address(0)),
    "sched_setattr": call("sched_setattr", PID, address(48 | 5 << 32, 0, 19, 0, 0, 0), 0),
    "migrate_pages": call("migrate_pages", PID, 2, address(1), address(1)),
    "move_pages": call("move_pages", PID, 0, 0, 0, 0, 0),
    "kill": call("kill", PID, 0),
    "tkill": call("tkill", PID, 0),
    "tgkill": call("tgkill", PID, PID, 0),
    "pidfd_send_signal": call("pidfd_send_signal", pidfd, 0, 0, 0),
    "pidfd_getfd": call("pidfd_getfd", pidfd, 0, 0),
    "ptrace": call("ptrace", 16, PID, 0, 0),
    "process_vm_readv": call("process_vm_readv", PID, 0, 0, 0, 0, 0),
    "process_vm_writev": call("process_vm_writev", PID, 0, 0, 0, 0, 0),
    "process_madvise": call("process_madvise", pidfd, 0, 0, 20, 0),
    "kcmp": call("kcmp", PID, PID, 0, 0, 0),
    "environ": opened(f"/proc/{PID}/environ"),
    "mem": opened(f"/proc/{PID}/mem"),
}
"""
# on all processes of the user: the values change nothing, should they be let through
ON_ALL = """
found = {
    "setpriority of a group": call("setpriority", 1, 0, 0),
    "setpriority of a user": call("setpriority", 2, 0, 0),
    "ioprio_set of a group": call("ioprio_set", 2, 0, 0),
    "ioprio_set of a user": call("ioprio_set", 3, os.getuid(), 0),
}
"""
AS_ROOT = """
name, now = os.uname().nodename.encode(), time.time_ns()
timespec = address(now // 10**9, now % 10**9)  # what is tried changes nothing, should it be let through
found = {
    "sethostname": tried(libc.sethostname(name, len(name))),
    "clock_settime": tried(libc.clock_settime(0, ctypes.c_void_p(timespec))),
    "chown": tried(libc.chown(b"own", 1, 1)),
    "setuid": tried(libc.setuid(1)),
    "mknod": tried(libc.mknod(b"null", 0o20666, 0x103)),
    "chroot": tried(libc.chroot(b".")),
    "environ": opened("/proc/1/environ"),
    "environ of the maker": opened(f"/proc/{os.getppid()}/environ"),
    "kernel log": tried(libc.klogctl(3, ctypes.create_string_buffer(100), 100)),
}
reads = "print(open('/proc/self/status').read())"
texts = [open("/proc/self/status").read(), subprocess.check_output([sys.executable, "-c", reads], text=True)]
found["sets"] = [[line.split()[1] for line in t.splitlines() if line.startswith("Cap")] for t in texts]
"""
# what works: a process limits and slows itself, has threads, and ends what it has started
ON_ITSELF = """
import signal, threading
def threaded():
    done = []
    thread = threading.Thread(target=lambda: done.append(call("sched_setaffinity", 0, 8, address(1))))
    thread.start()
    thread.join()
    return done[0]
def ended():
    with subprocess.Popen([sys.executable, "-c", "import time; time.sleep(600)"]) as made:
        made.terminate()
    return made.returncode
found = {
    "prlimit64": call("prlimit64", 0, 1, 0, address(0, 0)),
    "prlimit64 by number": call("prlimit64", os.getpid(), 1, 0, address(0, 0)),
    "setpriority": call("setpriority", 0, 0, 5),
    "setpriority by number": call("setpriority", 0, os.getpid(), 5),
    "ioprio_set": call("ioprio_set", 1, 0, 2 << 13 | 7),
    "sched_setaffinity": call("sched_setaffinity", os.getpid(), 8, address(1)),
    "sched_setscheduler": call("sched_setscheduler", 0, 3, address(0)),
    "thread": threaded(),
    "signal": call("tgkill", os.getpid(), threading.get_native_id(), 0),
    "terminal": call("ioctl", 0, 0x5401, 0),
    "typed": call("ioctl", 0, 0x5412, address(0)),
    "typed, high bits": call("ioctl", 0, 0x5412 + (1 << 32), address(0)),
}
if ENDS:
    found["ended"] = ended()
aborted = subprocess.run([sys.executable, "-c", "import os; os.abort()"], stderr=subprocess.DEVNULL).returncode
found["aborted"] = aborted < 0
"""
# of a system whose Landlock knows no signals
SIGNALS = """
from hystfmu.base import confine
confine._landlock = lambda: 5
confine.confine(confine.Box.of("."))
found = {
    "kill": call("kill", PID, 0),
    "kill, high bits": call("kill", PID + (1 << 32), 0),
    "kill of a group": call("kill", 0, 0),
    "tkill": call("tkill", PID, 0),
    "tgkill": call("tgkill", PID, PID, 0),
    "rt_sigqueueinfo": call("rt_sigqueueinfo", PID, 0, address(*[0] * 16)),
    "pidfd_send_signal": call("pidfd_send_signal", libc.syscall(434, PID, 0), 0, 0, 0),
    "owner of a file": call("fcntl", os.pipe()[0], 8, PID),
}
"""
ENVIRONMENT = """
found = {
    "variables": dict(os.environ),
    "native": libc.getenv(b"TOKEN") != 0,
    "first": open("/proc/self/environ").read(),
}
"""
START = """
import json, sys
from hystfmu.base.child import Child
from hystfmu.base.confine import Box
code, folder, confined = json.loads(sys.argv[1])
lines, _ = Child("-c", code, box=Box.of(folder) if confined else None).finish(60.0)
print("\\n".join(lines))
"""


def said(user: User, code: str, confined: bool = True, **variables: str) -> dict[str, object]:  # noqa: F811
    """What code finds in a child of the user."""
    given = json.dumps([f"{HEAD}{code}\nprint(json.dumps(found))", str(user.folder), confined])
    told = user.python("-c", START, given, **variables)
    assert told.returncode == 0, told.stderr
    found: dict[str, object] = json.loads(next(x for x in told.stdout.splitlines() if x.startswith("{")))
    return found


@pytest.fixture
def victim(user: User) -> Iterator[int]:  # noqa: F811
    """A process of the user."""
    options = {} if user.root or not IS_ROOT else {"user": 65534, "group": 65534, "extra_groups": []}
    with subprocess.Popen(["sleep", "600"], **options) as other:  # type: ignore[call-overload]
        yield other.pid
        other.kill()


def state(pid: int) -> list[str]:
    """Limits, priority, policy and processors of a process."""
    limits = Path(f"/proc/{pid}/limits").read_text()
    allowed = [line for line in Path(f"/proc/{pid}/status").read_text().splitlines() if line.startswith("Cpus_allowed")]
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return [limits, *allowed, *(fields[k] for k in (15, 16, 37, 38))]


def test_nothing_is_done_to_another_process_of_the_user(user: User, victim: int) -> None:  # noqa: F811
    before = state(victim)
    found = said(user, ON_ANOTHER.replace("PID", str(victim))) | said(user, ON_ALL)
    assert {name: how for name, how in found.items() if how not in ("EACCES", "EPERM")} == {}
    assert state(victim) == before


def test_the_attempts_are_real(user: User, victim: int) -> None:  # noqa: F811
    """Most succeed without confinement."""
    found = said(user, ON_ANOTHER.replace("PID", str(victim)), confined=False)
    failed = {name for name, how in found.items() if how in ("EACCES", "EPERM")}
    assert failed <= {"process_madvise", "kcmp"}
    assert "Max file size             0" in state(victim)[0]


def test_root_keeps_no_capability(user: User) -> None:  # noqa: F811
    (user.folder / "own").touch()
    user.give(user.folder)
    found = said(user, AS_ROOT)
    sets: Any = found.pop("sets")
    none = ["0" * 16] * 5
    assert [s if user.root else s[:3] + s[4:] for s in sets] == [none if user.root else none[:4]] * 2
    assert {name: how for name, how in found.items() if how not in ("EACCES", "EPERM")} == {}


@pytest.mark.some(1)
@pytest.mark.parametrize("signals", [False, True], ids=["Landlock", "Landlock without signals"])
def test_what_a_process_does_to_itself_works(signals: bool, user: User) -> None:  # noqa: F811
    """Without the help of Landlock it may not end what it has started; the supervisor does that."""
    older = 'from hystfmu.base import confine\nconfine._landlock = lambda: 5\nconfine.confine(confine.Box.of("."))\n'
    found = said(user, (older if signals else "") + ON_ITSELF.replace("ENDS", str(not signals)), not signals)
    assert (found.pop("typed"), found.pop("typed, high bits"), found.pop("terminal")) == ("EACCES", "EACCES", "ENOTTY")
    assert found.pop("ended", -15) == -15
    assert found.pop("aborted") is True
    assert set(found.values()) == {"done"}, found


def test_signals_where_landlock_knows_none(user: User, victim: int) -> None:  # noqa: F811
    found = said(user, SIGNALS.replace("PID", str(victim)), confined=False)
    assert set(found.values()) == {"EACCES"}, found


def test_secrets_of_the_environment_stay_outside(user: User) -> None:  # noqa: F811
    given = {"TOKEN": "secret", "AWS_SECRET_ACCESS_KEY": "secret", "LANG": "C.UTF-8", "HYSTFMU_CACHE": "cache"}
    found = said(user, ENVIRONMENT, **given)
    assert "secret" not in json.dumps(found)
    assert found["native"] is False
    variables = found["variables"]
    assert isinstance(variables, dict)
    assert (variables["LANG"], variables["HYSTFMU_CACHE"]) == ("C.UTF-8", "cache")
    assert {"PATH", "HOME", "PYTHONPATH"} <= set(variables)
    assert "secret" in json.dumps(said(user, ENVIRONMENT, confined=False, **given))
