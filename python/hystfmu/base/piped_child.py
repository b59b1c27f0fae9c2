"""A child process for foreign native code, with a pipe for calls; not on Windows.

It inherits less than a child of `multiprocessing`: neither the terminal and the main module, nor the helper that
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
    """A number in a file that two processes share; its content is not trusted."""

    def __init__(self, handle: int) -> None:
        self._handle = handle

    @property
    def value(self) -> int:
        """The number; 0 if there is none."""
        return int.from_bytes(os.pread(self._handle, 8, 0), "little")

    @value.setter
    def value(self, number: int) -> None:
        os.pwrite(self._handle, number.to_bytes(8, "little"), 0)


class PipedChild:
    """A process with the methods of `multiprocessing.Process` that a pool uses.

    Parameters
    ----------
    target : function
        Function of a module of this package that it runs: takes a pipe, a `Count`, the process number of its parent and
        the arguments.
    folder : str
        Its own folder.
    words : tuple
        Arguments that can be pickled.
    box : Box or None
        Confines it.
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
        """The lines of its output, at its end."""

    @property
    def exitcode(self) -> int | None:
        """Status with which it ended, or None."""
        return self._child.poll() if self.said is None else self._child.status

    def terminate(self) -> None:
        """Begin to end it with all that it has started."""
        self._child.terminate()

    def join(self, seconds: float | None = None) -> None:
        """Wait for its end."""
        self._child.wait(seconds)

    def kill(self) -> None:
        """End it and all that it has started."""
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
