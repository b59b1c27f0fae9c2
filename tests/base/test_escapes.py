"""Confined code acts on no other process, has no capability and sees no secret of the environment.

All that is tried in one way runs in one process: the start of a process takes longer than the attempts.
"""

import functools
import json
import subprocess
from collections.abc import Callable, Iterator
from contextlib import closing
from pathlib import Path
from typing import Any

import pytest
from users import IS_ROOT, User

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
def opened(path, flags=os.O_RDONLY):
    try:
        os.close(os.open(path, flags))
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
    "io_uring_setup": (425, 425),
}
"""
# on the process PID, and on what processes share; 1 << 32 is cut off by the system
ON_ANOTHER = """
high = 1 << 32
pidfd = libc.syscall(434, PID, 0)
def in_a_session():
    reads, writes = os.pipe()
    if not os.fork():
        os.setsid()
        os.write(writes, tried(libc.socket(2, 1, 0)).encode())
        os._exit(0)
    return os.read(reads, 99).decode()
def shared(make, remove, *arguments):
    made = make(0, *arguments, 0o600)
    said = tried(made)
    remove(made, 0, None)
    return said
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
    "queue": shared(libc.msgget, libc.msgctl),
    "shared memory": shared(libc.shmget, libc.shmctl, 4096),
    "ring that makes sockets": call("io_uring_setup", 1, address(*[0] * 15)),
    "socket in a session": in_a_session(),
    "device": opened("/dev/ptmx", os.O_RDWR),
    "file to read": opened("../given/file", os.O_RDWR),
    "file of the user": opened("../file"),
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
    "file to read": opened("../given/file"),
    "file of a library": opened("../libraries/file"),
    "file of its own": opened("new", os.O_CREAT | os.O_WRONLY),
    "device": opened("/dev/null", os.O_RDWR),
    "terminal": call("ioctl", 0, 0x5401, 0),
    "typed": call("ioctl", 0, 0x5412, address(0)),
    "typed, high bits": call("ioctl", 0, 0x5412 + (1 << 32), address(0)),
}
if CONFINED:
    found["ended"] = ended()
aborted = subprocess.run([sys.executable, "-c", "import os; os.abort()"], stderr=subprocess.DEVNULL).returncode
found["aborted"] = aborted < 0
"""
# of a system whose Landlock knows no signals
SIGNALS = """
from hystfmu.base import confine
handles = os.listdir("/proc/self/fd")
confine._landlock = lambda: 5
confine.confine(confine.Box.of(".", "../given"))
assert os.listdir("/proc/self/fd") == handles
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
    "folder": os.getcwd(),
    "native": libc.getenv(b"TOKEN") != 0,
    "first": open("/proc/self/environ").read(),
}
"""
START = """
import json, sys
from hystfmu.base.child import Child
from hystfmu.base.confine import Box
code, confined = json.loads(sys.argv[1])
lines, _ = Child("-c", code, box=Box.of("own", "given") if confined else None).finish(60.0)
print("\\n".join(lines))
"""
WAYS = {  # what is tried in a process: confined, free, and confined with an older Landlock
    "confined": {"another": ON_ANOTHER, "all": ON_ALL, "root": AS_ROOT, "outside": ENVIRONMENT, "itself": ON_ITSELF},
    "free": {"another": ON_ANOTHER, "outside": ENVIRONMENT},
    "older": {"signals": SIGNALS, "itself": ON_ITSELF},
}
GIVEN = {"TOKEN": "secret", "AWS_SECRET_ACCESS_KEY": "secret", "LANG": "C.UTF-8", "HYSTFMU_CACHE": "cache"}
REFUSED = ("EACCES", "EPERM")
Said = Callable[[str], dict[str, Any]]


@pytest.fixture(scope="module", params=[pytest.param("root", marks=pytest.mark.stress), "user"])
def user(request: pytest.FixtureRequest) -> Iterator[User]:
    with closing(User(request.param)) as made:
        for name in ("file", "own/own", "given/file", "libraries/file"):
            path = made.folder / name
            path.parent.mkdir(exist_ok=True)
            path.write_text("text")
        made.give(made.folder)
        yield made


@pytest.fixture(scope="module")
def victim(user: User) -> Iterator[int]:
    """A process of the user."""
    options = {} if user.root or not IS_ROOT else {"user": 65534, "group": 65534, "extra_groups": []}
    with subprocess.Popen(["sleep", "600"], **options) as other:  # type: ignore[call-overload]
        yield other.pid
        other.kill()


@pytest.fixture(scope="module")
def said(user: User, victim: int) -> Said:
    """What the attempts of a way find in a child of the user, with the state of the victim before and after."""

    @functools.cache
    def tried(way: str) -> dict[str, Any]:
        parts = "".join(f"{part}\nall_[{name!r}] = found\n" for name, part in WAYS[way].items())
        parts = parts.replace("PID", str(victim)).replace("CONFINED", str(way == "confined"))
        code = f"{HEAD}os.chdir({str(user.folder / 'own')!r})\nall_ = {{}}\n{parts}\nprint(json.dumps(all_))"
        before = state(victim)
        libraries = {"LD_LIBRARY_PATH": str(user.folder / "libraries")}
        told = user.python("-c", START, json.dumps([code, way == "confined"]), **GIVEN, **libraries)
        assert told.returncode == 0, told.stderr
        assert told.stdout.startswith("{"), told.stdout
        return json.loads(told.stdout.splitlines()[0]) | {"states": [before, state(victim)]}

    return tried


def state(pid: int) -> list[str]:
    """Limits, priority, policy and processors of a process."""
    limits = Path(f"/proc/{pid}/limits").read_text()
    allowed = [line for line in Path(f"/proc/{pid}/status").read_text().splitlines() if line.startswith("Cpus_allowed")]
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return [limits, *allowed, *(fields[k] for k in (15, 16, 37, 38))]


def test_nothing_is_done_to_another_process_of_the_user(said: Said) -> None:
    found = said("confined")
    tried = found["another"] | found["all"]
    assert {name: how for name, how in tried.items() if how not in REFUSED} == {}
    assert found["states"][0] == found["states"][1]


def test_the_attempts_are_real(said: Said) -> None:
    """Most succeed without confinement."""
    found = said("free")
    assert {name for name, how in found["another"].items() if how in REFUSED} <= {"process_madvise", "kcmp"}
    assert "Max file size             0" in found["states"][1][0]


def test_root_keeps_no_capability(said: Said, user: User) -> None:
    found = said("confined")["root"]
    none = ["0" * 16] * 5
    assert [s if user.root else s[:3] + s[4:] for s in found["sets"]] == [none if user.root else none[:4]] * 2
    assert {name: how for name, how in found.items() if name != "sets" and how not in REFUSED} == {}


@pytest.mark.parametrize("way", ["confined", "older"])
def test_what_a_process_does_to_itself_works(way: str, said: Said) -> None:
    """Without the help of Landlock it may not end what it has started; the supervisor does that."""
    other = {"typed": "EACCES", "typed, high bits": "EACCES", "terminal": "ENOTTY", "aborted": True, "ended": -15}
    found = said(way)["itself"]
    assert found == {name: other.get(name, "done") for name in found}
    assert ("ended" in found) == (way == "confined")


def test_signals_where_landlock_knows_none(said: Said) -> None:
    found = said("older")["signals"]
    assert set(found.values()) == {"EACCES"}, found


def test_secrets_of_the_environment_stay_outside(said: Said) -> None:
    found = said("confined")["outside"]
    assert "secret" not in json.dumps(found)
    assert found["native"] is False
    variables = found["variables"]
    assert (variables["LANG"], variables["HYSTFMU_CACHE"]) == ("C.UTF-8", "cache")
    assert {"PATH", "HOME", "PYTHONPATH"} <= set(variables)
    assert {variables[name] for name in ("TMPDIR", "TMP", "TEMP")} == {found["folder"]}
    assert "secret" in json.dumps(said("free")["outside"])
