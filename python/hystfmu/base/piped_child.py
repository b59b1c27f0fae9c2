"""A child process for foreign native code, with a pipe for calls; not on Windows.

The child inherits less than a child of `multiprocessing`. It inherits no terminal, no main module, and no helper that
removes shared memory. It reads its task from a file.
"""

from __future__ import annotations

import multiprocessing
import os
import pickle
import tempfile
from collections.abc import Callable
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

from hystfmu.base.child import Child
from hystfmu.base.confine import Box

_TASK = "task"


class Count:
    """A number in a file that two processes share; the content of the file is not trusted."""

    def __init__(self, handle: int) -> None:
        self._handle = handle

    @property
    def value(self) -> int:
        """The number; 0 if the file has no number."""
        return int.from_bytes(os.pread(self._handle, 8, 0), "little")

    @value.setter
    def value(self, number: int) -> None:
        os.pwrite(self._handle, number.to_bytes(8, "little"), 0)


class PipedChild:
    """A process with the methods of `multiprocessing.Process` that a pool uses.

    Parameters
    ----------
    target : function
        Function of a module of this package that the process runs. It takes a pipe, a `Count`, the process number of
        the parent and the arguments.
    folder : str
        Own folder of the process.
    words : tuple
        Arguments that can be pickled.
    box : Box or None
        Box that confines the process.
    """

    def __init__(self, target: Callable[..., None], folder: str, words: tuple[Any, ...], box: Box | None) -> None:
        (Path(folder) / _TASK).write_bytes(pickle.dumps((target, words)))
        self.pipe, theirs = multiprocessing.Pipe()
        self._file = tempfile.TemporaryFile()  # noqa: SIM115
        self.count = Count(self._file.fileno())
        keep = (theirs.fileno(), self._file.fileno())
        self._child = Child("-m", "hystfmu.base.piped_child", *map(str, keep), folder, box=box, keep=keep)
        theirs.close()
        self.said: list[str] | None = None
        """Lines at the end of the output of the process."""

    @property
    def exitcode(self) -> int | None:
        """Exit status of the process, or None while it runs."""
        return self._child.poll() if self.said is None else self._child.status

    def terminate(self) -> None:
        """Begin to end the process and all processes that it has started."""
        self._child.terminate()

    def join(self, seconds: float | None = None) -> None:
        """Wait for the end of the process."""
        self._child.wait(seconds)

    def kill(self) -> None:
        """End the process and all processes that it has started."""
        if self.said is None:
            self.said, _ = self._child.finish(0.0)
            self._file.close()


def main(pipe: int, count: int, folder: str) -> None:
    """Run the task in the child."""
    target, words = pickle.loads((Path(folder) / _TASK).read_bytes())  # our own parent wrote it
    target(Connection(pipe), Count(count), os.getppid(), *words)


if __name__ == "__main__":
    import sys

    main(int(sys.argv[1]), int(sys.argv[2]), sys.argv[3])
