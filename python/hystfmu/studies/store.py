"""Store the table of a study on disk.  Finished runs are stored immediately, so an interruption does not lose them.

Each row is one line of `journal.jsonl` with CRC-32, tab and JSON. The line is appended when the run ends. If a run has
two rows, the later row is valid. A lock prevents that two studies use the folder, in this process or in another. The
names of the columns and the seed are stored in two files each.

Truncated or damaged data are found at the next start. Damaged lines are moved to `damaged.jsonl`, and their runs are
repeated. The final table is `results.parquet`, sorted by row. This table does not depend on time, machine or order of
the runs.
"""

import errno
import json
import os
import secrets
import sys
import time
import zlib
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

from hystfmu.base import InputError, check_target, extras, own, read_bytes, refuse_existing, write_bytes

_FAR = 2**30  # locked byte, beyond the end of a journal, because on Windows no other process can read a locked byte
_HELD: dict[int, tuple[int, int, int]] = {}  # process, device and file number of each locked handle


def open_locked(path: Path) -> int:
    """Open a file for reading and writing, and lock it until `close_locked`.

    The lock belongs to this process, and not to forked workers, which may end slightly later. A lock of the operating
    system has two weaknesses: it does not exclude a second study in this process, and it is lost when this process
    closes another handle of the file. Therefore this function refuses a file that this process has already locked.

    An InputError means that another study has the lock, or that the file cannot be written. An OSError means that the
    file system does not support locks.
    """
    check_target(path)
    refused = InputError(f"{path.parent}: another study is writing into this folder")
    with suppress(FileNotFoundError):
        if _mark(path.stat()) in _HELD.values():
            raise refused
    handle = os.open(path, os.O_RDWR | os.O_CREAT | getattr(os, "O_BINARY", 0), 0o666)
    try:
        _lock(handle)
    except OSError as e:
        os.close(handle)
        if isinstance(e, (BlockingIOError, PermissionError)):
            raise refused from None
        raise
    _HELD[handle] = _mark(os.fstat(handle))
    return handle


def close_locked(handle: int) -> None:
    """Close a locked file and release the lock."""
    del _HELD[handle]
    os.close(handle)


def _mark(found: os.stat_result) -> tuple[int, int, int]:
    return os.getpid(), found.st_dev, found.st_ino


def _lock(handle: int) -> None:
    if sys.platform == "win32":
        import msvcrt

        os.lseek(handle, _FAR, os.SEEK_SET)
        msvcrt.locking(handle, msvcrt.LK_NBLCK, 1)
        os.lseek(handle, 0, os.SEEK_SET)
    else:
        import fcntl

        fcntl.lockf(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)


# interval between syncs (s), whose rows a power failure may lose. 1024 short runs take 0.5 s; 5.5 s with a sync for
# each.
SYNC = 0.25
COLUMNS = ("index", "variation", "case", "id", "status", "reason")


def _line(row: dict[str, Any]) -> bytes:
    content = json.dumps(row, allow_nan=True).encode()
    return b"%08x\t%s\n" % (zlib.crc32(content), content)


def _row(line: bytes) -> dict[str, Any] | None:
    """Return the row in a line of the journal, or None if the line is damaged."""
    content = line[9:-1]
    if line != b"%08x\t%s\n" % (zlib.crc32(content), content):
        return None
    row: dict[str, Any] = json.loads(content)
    return row


def _sealed(value: Any) -> bytes:
    return json.dumps({"crc32": zlib.crc32(json.dumps(value).encode()), "value": value}).encode()


def _unsealed(path: Path) -> Any:
    """Return the value in a file with a checksum. A ValueError means that the file is damaged."""
    found = json.loads(read_bytes(path))
    if not isinstance(found, dict) or not {"crc32", "value"} & set(found):
        raise InputError(f"{path}: HystFMU before 0.1 wrote this folder. Choose another one for the study.")
    if _sealed(found.get("value")) != json.dumps(found).encode():
        raise ValueError
    return found["value"]


_MADE = ("results.parquet", "report.html", "report.json")  # files that are written at the end of a study


class Store:
    """Rows of a study, stored in a folder that belongs to this study. A missing folder is created.

    `parameters` and `metrics` are the names of columns in addition to the fixed columns. An InputError is raised if the
    folder contains the table of another study, is in use, cannot be repaired, or cannot be written.
    """

    def __init__(self, folder: Path, parameters: Sequence[str], metrics: Sequence[str], study: str = "") -> None:
        with extras("a study"):
            import pyarrow  # noqa: F401
        self.folder, self._parameters, self._metrics = folder, list(parameters), list(metrics)
        if not (folder / "columns.json").exists():
            refuse_existing(*(folder / name for name in _MADE))
        own(folder)
        try:
            folder.mkdir(parents=True, exist_ok=True)
            self._journal = open_locked(folder / "journal.jsonl")
            try:
                mine = {"parameters": self._parameters, "metrics": self._metrics}
                if self._kept("columns", lambda: mine) != mine:
                    raise InputError(f"{folder}: contains the table of a study with other parameters or metrics")
                if (known := self._kept("study", lambda: study)) != study:
                    raise InputError(f"{folder}: contains the table of the study {known}")
                self._mend()
            except BaseException:
                self.close()
                raise
        except OSError as e:
            raise InputError(f"{folder}: {e.strerror or e}") from None

    def seed(self) -> int:
        """Return the seed of this study. It is chosen at random in the first run and stored in the folder."""
        return int(self._kept("seed", lambda: secrets.randbelow(2**31)))

    def _kept(self, name: str, first: Callable[[], Any]) -> Any:
        """Return a value that is stored in two files. A missing value is created.

        If one of the files is damaged, a copy of the other file replaces it.
        """
        paths = self.folder / f"{name}.json", self.folder / f"{name}.copy.json"
        found = []
        for path in filter(Path.exists, paths):
            try:
                found.append(_unsealed(path))
            except ValueError as e:
                if isinstance(e, InputError):
                    raise
        if not found and any(map(Path.exists, paths)):
            raise InputError(
                f"{paths[0]}: The file and its copy are damaged. Remove them to go on with the rows of this folder."
            )
        value = found[0] if found else first()
        for path in paths:
            if not path.exists() or read_bytes(path) != _sealed(value):
                write_bytes(path, _sealed(value))
        return value

    def _mend(self) -> None:
        """Move damaged lines of the journal to `damaged.jsonl`.

        Blanks replace the damaged lines, so that the positions of the other lines do not change.
        """
        at, self._in_journal, damaged = 0, 0, list[tuple[int, bytes]]()
        for line in self._lines():
            if _row(line) is not None:
                self._in_journal += 1
            elif not line.isspace() or line[-1:] != b"\n":
                damaged.append((at, line))
            at += len(line)
        if damaged:
            aside = self.folder / "damaged.jsonl"
            check_target(aside)
            with open(aside, "ab") as f:
                f.writelines(line for _, line in damaged)
                f.flush()
                os.fsync(f.fileno())
            for at, line in damaged:
                os.lseek(self._journal, at, os.SEEK_SET)
                os.write(self._journal, b" " * (len(line) - 1) + b"\n")
        os.fsync(self._journal)
        self._synced = time.monotonic()

    def append(self, row: dict[str, Any]) -> None:
        """Append the row of a finished run. For a failed run, the `limits` of the run are also stored.

        An InputError means that the disk is full. Earlier rows are not lost, and the study can be resumed.
        """
        line = _line(row)
        at = os.lseek(self._journal, 0, os.SEEK_END)
        try:
            if os.write(self._journal, line) != len(line):
                raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
            if time.monotonic() - self._synced > SYNC:
                os.fsync(self._journal)
                self._synced = time.monotonic()
        except OSError as e:
            with suppress(OSError):
                os.ftruncate(self._journal, at)
            safe = f"{self._in_journal} rows are safe: free some space and run the study again"
            raise InputError(f"{self.folder}: {e.strerror or e}; {safe}") from None
        self._in_journal += 1

    def rows(self) -> Iterator[dict[str, Any]]:
        """Yield the stored row of each run, in no particular order."""
        yield from {row["id"]: row for row in map(_row, self._lines()) if row is not None}.values()

    def finish(self, rows: list[dict[str, Any]]) -> Path:
        """Write `results.parquet` with the given rows and return its path."""
        path = self.folder / "results.parquet"
        write_bytes(path, self._table(rows))
        return path

    def close(self) -> None:
        """Close the journal."""
        with suppress(OSError):
            os.fsync(self._journal)
        close_locked(self._journal)

    def _lines(self) -> list[bytes]:
        os.lseek(self._journal, 0, os.SEEK_SET)  # to close a second handle would release the lock
        content = b"".join(iter(lambda: os.read(self._journal, 2**20), b""))
        return content.splitlines(keepends=True)

    def _table(self, rows: list[dict[str, Any]]) -> bytes:
        import pyarrow as pa
        import pyarrow.parquet as pq

        columns: dict[str, Any] = {
            name: pa.array([r[name] for r in rows], pa.int64() if name in ("index", "variation") else pa.string())
            for name in COLUMNS
        }
        for name in self._parameters:
            columns[name] = pa.array([r["values"].get(name) for r in rows], pa.float64())
        for name in self._metrics:
            columns[f"metric:{name}"] = pa.array([r["metrics"].get(name) for r in rows], pa.float64())
        sink = pa.BufferOutputStream()
        pq.write_table(pa.table(columns), sink)
        content: bytes = sink.getvalue().to_pybytes()
        return content
