"""Child processes that run foreign native code.

A crash, a hang or memory growth of this code does not affect the parent process.

The foreign code may replace a result file by a link to a file that the code itself cannot read, or by a pipe that
blocks the reader. Therefore every result file is checked when it is opened. A `PipedChild` also has a pipe for function
calls; Windows does not support this class. Unlike a process of `multiprocessing`, a `PipedChild` does not inherit the
terminal and the main module, and has no helper process that removes shared memory. It reads its task from a file.
"""

import ctypes
import json
import multiprocessing
import os
import pickle
import signal
import stat
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Collection
from contextlib import suppress
from dataclasses import asdict
from io import BufferedReader
from multiprocessing.connection import Connection
from pathlib import Path
from typing import IO, Any

from hystfmu.base import PACKAGE
from hystfmu.base.confine import Box, known, unconfined
from hystfmu.base.errors import InputError

MOST_LOG = 1 << 16
_MOST_OUTPUT = 1 << 24  # bytes of output on the disk; older output is deleted
_PUNCH_HOLE = 3  # mode of fallocate(2): free the bytes, but keep the file size
_LOOK = 0.5  # s: time between two checks of the output size
_END = 10.0  # s: time that the supervisor has to end all processes
_TOLD: set[str] = set()


def _freed(handle: int, size: int) -> bool:
    """Free the first `size` bytes of a file, if the system supports this. Later bytes are not affected."""
    if sys.platform != "linux":
        return False
    call = ctypes.CDLL(None).fallocate
    call.argtypes = [ctypes.c_int, ctypes.c_int, ctypes.c_int64, ctypes.c_int64]
    return bool(call(handle, _PUNCH_HOLE, 0, size) == 0)


def limit_memory(gigabytes: float) -> None:
    """Limit the address space of this process to its present size plus `gigabytes` (GiB); disable core dumps.

    Systems without such limits ignore the call.
    """
    try:
        import resource

        statm = Path("/proc/self/statm")  # a forked process starts with the memory size of its parent
        have = int(statm.read_text().split()[0]) * resource.getpagesize() if statm.exists() else 0
        most = have + int(gigabytes * 2**30)
        resource.setrlimit(resource.RLIMIT_AS, (most, most))
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    except (ImportError, ValueError, OSError):
        pass


def late(seconds: float) -> str:
    """Return the error message for a child process that `finish` stopped after `seconds`."""
    return f"not finished after {seconds:g} s: a unit does not end, or needs a longer time limit"


def _signal_name(number: int) -> str:
    try:
        return signal.Signals(number).name
    except ValueError:
        return f"signal {number}"


def tell_unconfined() -> None:
    """Print once, on stderr, the protections against foreign FMUs that this system does not offer."""
    may = unconfined()
    if may and may not in _TOLD:
        _TOLD.add(may)
        print(f"hystfmu: foreign FMUs are not confined on this system: they may {may}", file=sys.stderr)


class Child:
    """A Python process that can import this package, in its own session. Its output is written to a file.

    The output does not use a pipe. A pipe stays open until all processes that the child has started end, and a reader
    of the pipe would wait for them. On Linux a supervisor ends these processes together with the child. On other
    systems the process group of the child is ended. On Windows only the child is ended.

    The `arguments` are the command-line arguments of Python. A `box` confines the child as far as this system supports
    confinement. The child then gets only the environment variables that `known` returns. If `told` is true, the
    protections that this system does not offer are printed once. The file descriptors `keep` stay open in the child;
    Windows does not support this.
    """

    def __init__(self, *arguments: str, box: Box | None = None, keep: Collection[int] = (), told: bool = True) -> None:
        package = str(PACKAGE.parent)
        path = os.pathsep.join([package, *filter(None, [os.environ.get("PYTHONPATH")])])
        variables = dict(os.environ) if box is None else known(os.environ)
        command = ["-P", *arguments]  # -P: Python must not import modules from the current folder
        if box is not None and told:
            tell_unconfined()
        if sys.platform == "linux":
            inside = json.dumps(None if box is None else asdict(box))
            command = ["-S", "-P", "-m", "hystfmu.base.supervisor", str(os.getpid()), inside, *command]
        self._output: IO[bytes] = tempfile.TemporaryFile()  # noqa: SIM115
        self._dropped = b""
        self._process = subprocess.Popen(
            [sys.executable, *command],
            env=variables | {"PYTHONPATH": path},
            stdin=subprocess.DEVNULL,
            stdout=self._output,
            stderr=subprocess.STDOUT,
            start_new_session=True,
            pass_fds=tuple(keep),
        )

    @property
    def status(self) -> int:
        """Exit status of the child, or the negative number of the signal that ended the child."""
        return int(self._process.returncode)

    @property
    def ending(self) -> str:
        """Description of how the process ended, such as "crashed (SIGSEGV)" or "ended with status 1"."""
        return f"crashed ({_signal_name(-self.status)})" if self.status < 0 else f"ended with status {self.status}"

    def finish(self, seconds: float, look: Callable[[], bool] = lambda: False) -> tuple[list[str], bool]:
        """Wait at most `seconds`, then end the child and all processes that it has started.

        The function `look` is called repeatedly while the child runs. If it returns true, the time limit starts again.
        Returns the last 64 KiB of the output of the child as lines, and whether the child ended by itself.
        """
        end = time.monotonic() + seconds
        try:
            while self._process.poll() is None and (left := end - time.monotonic()) > 0:
                self.wait(min(left, _LOOK))
                self._drop_output()
                if look():
                    end = time.monotonic() + seconds
            in_time = self._process.poll() is not None
        finally:
            self._end()
        with self._output:
            return self._last_output().decode(errors="replace").strip().splitlines(), in_time

    def poll(self) -> int | None:
        """Return the exit status if the child has ended, else None. Delete old output if it exceeds the size limit."""
        self._drop_output()
        return self._process.poll()

    def wait(self, seconds: float | None = None) -> None:
        """Wait for the end of the child, at most `seconds` (s)."""
        with suppress(subprocess.TimeoutExpired):
            self._process.wait(seconds)

    def terminate(self) -> None:
        """Ask the child to end and, on Linux, all processes that it has started; do not wait for their end."""
        self._process.terminate()

    def _last_output(self) -> bytes:
        handle = self._output.fileno()
        at = max(os.fstat(handle).st_size - MOST_LOG, 0)
        if sys.platform == "win32":
            os.lseek(handle, at, os.SEEK_SET)
            content = os.read(handle, MOST_LOG)
        else:
            content = os.pread(handle, MOST_LOG, at)  # pread: the child writes at the position of this handle
        return (self._dropped + content.lstrip(b"\0"))[-MOST_LOG:]

    def _drop_output(self) -> None:
        """Delete old output of a child that prints without end, so that the output does not fill the disk.

        The file becomes sparse: it keeps its size, but the deleted part uses no space on the disk.
        """
        handle = self._output.fileno()
        found = os.fstat(handle)
        if getattr(found, "st_blocks", 0) * 512 > _MOST_OUTPUT and not _freed(handle, found.st_size - MOST_LOG):
            last = self._last_output()
            whole, newline, _ = last.rpartition(b"\n")  # the rest of a line that the child is writing is lost
            self._dropped = whole + newline or last
            os.ftruncate(handle, 0)

    def _end(self) -> None:
        if sys.platform == "linux":
            self.terminate()
            self.wait(_END)
        if hasattr(os, "killpg") and not (sys.platform == "linux" and self._process.poll() is not None):
            with suppress(ProcessLookupError, PermissionError):
                os.killpg(self._process.pid, signal.SIGKILL)
        self._process.kill()
        self._process.wait()


_FLAGS = [getattr(os, f"O_{name}", 0) for name in ("NOFOLLOW", "NONBLOCK", "BINARY")]


def open_result(path: str | Path) -> BufferedReader:
    """Open a result file for reading; refuse links, files with several hard links, and special files.

    The opened file is checked, so the foreign code cannot replace the file after the check.

    Raises
    ------
    InputError
        There is no such file, the file is a link or not regular, or it has several hard links.
    """
    try:
        handle = os.open(path, os.O_RDONLY | sum(_FLAGS))
    except OSError as e:
        raise InputError(f"{path}: {e.strerror or e}") from None
    found = os.fstat(handle)
    if not stat.S_ISREG(found.st_mode) or found.st_nlink != 1:
        os.close(handle)
        raise InputError(f"{path}: The result must be a regular file with one name.")
    return os.fdopen(handle, "rb")


def read_result(path: str | Path, most: int) -> bytes:
    """Return the content of a result file of at most `most` bytes.

    Raises
    ------
    InputError
        The file is too large, or `open_result` refuses it.
    """
    with open_result(path) as f:
        content = f.read(most + 1)
    if len(content) > most:
        raise InputError(f"{path}: The result must have at most {most} bytes.")
    return content


_TASK = "task"


class Count:
    """A number in a file that parent and child share. The child may write any content into the file."""

    def __init__(self, handle: int) -> None:
        self._handle = handle

    @property
    def value(self) -> int:
        """Number in the file; 0 if the file contains no number."""
        return int.from_bytes(os.pread(self._handle, 8, 0), "little")

    @value.setter
    def value(self, number: int) -> None:
        os.pwrite(self._handle, number.to_bytes(8, "little"), 0)


class PipedChild:
    """A process with the methods of `multiprocessing.Process` that a pool uses, in its own `folder`, confined by a box.

    The process runs `target`, a function of a module of this package. The arguments of this function are a pipe, a
    `Count`, the process number of the parent, and `words`, which pickle must support.
    """

    def __init__(self, target: Callable[..., None], folder: str, words: tuple[Any, ...], box: Box | None) -> None:
        (Path(folder) / _TASK).write_bytes(pickle.dumps((target, words)))
        self.pipe, theirs = multiprocessing.Pipe()
        self._file = tempfile.TemporaryFile()  # noqa: SIM115
        self.count = Count(self._file.fileno())
        keep = (theirs.fileno(), self._file.fileno())
        self._child = Child("-m", "hystfmu.base.child", *map(str, keep), folder, box=box, keep=keep)
        theirs.close()
        self.said: list[str] | None = None
        """Lines at the end of the output of the process."""

    @property
    def exitcode(self) -> int | None:
        """Exit status of the process, or None while it runs."""
        return self._child.poll() if self.said is None else self._child.status

    def terminate(self) -> None:
        """Ask the process and all processes that it has started to end; do not wait for their end."""
        self._child.terminate()

    def join(self, seconds: float | None = None) -> None:
        """Wait for the end of the process, at most `seconds` (s)."""
        self._child.wait(seconds)

    def kill(self) -> None:
        """End the process and all processes that it has started."""
        if self.said is None:
            self.said, _ = self._child.finish(0.0)
            self._file.close()


def main(pipe: int, count: int, folder: str) -> None:
    """Run, in the child process, the task that the parent has written to `folder`."""
    target, words = pickle.loads((Path(folder) / _TASK).read_bytes())  # safe: the parent process wrote the file
    target(Connection(pipe), Count(count), os.getppid(), *words)


if __name__ == "__main__":
    import sys

    main(int(sys.argv[1]), int(sys.argv[2]), sys.argv[3])
