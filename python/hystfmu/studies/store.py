"""Store the table of a study on disk.  Every finished run is stored at once and survives an interruption.

A row is one line of `journal.jsonl`, appended when its run ends: CRC-32, tab, JSON.  Lines that were cut off or damaged
are moved to `damaged.jsonl`, and their runs are made again.  A lock keeps a second study out of the folder.
Full journals become Parquet parts by atomic renames.  The final table is `results.parquet`, sorted by row.  The table
does not depend on when, where or in which order the runs were made.
"""

from __future__ import annotations

import json
import os
import secrets
import zlib
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from hystfmu.base.errors import InputError
from hystfmu.base.extras import extras
from hystfmu.base.files import read_bytes, write_bytes

PART_ROWS = 20_000
COLUMNS = ("index", "variation", "case", "id", "status", "reason")


def _line(row: dict[str, Any]) -> bytes:
    content = json.dumps(row, allow_nan=True).encode()
    return b"%08x\t%s\n" % (zlib.crc32(content), content)


def _row(line: bytes) -> dict[str, Any] | None:
    """Return the row of a line; None if the line is not as it was written."""
    content = line[9:-1]
    if line != b"%08x\t%s\n" % (zlib.crc32(content), content):
        return None
    row: dict[str, Any] = json.loads(content)
    return row


def _load(path: Path) -> Any:
    try:
        return json.loads(read_bytes(path))
    except ValueError as e:
        if isinstance(e, InputError):
            raise
        raise InputError(f"{path}: The file is damaged. Remove it to go on with the rows of this folder.") from None


class Store:
    """Rows of a study in a folder.

    Parameters
    ----------
    folder : path
        Folder of the study; created if it is missing.
    parameters, metrics : sequence of str
        Columns in addition to the fixed ones.

    Raises
    ------
    InputError
        If the folder holds the table of another study, is in use, is damaged or cannot be written, or the extra
        'study' is not installed.
    """

    def __init__(self, folder: Path, parameters: Sequence[str], metrics: Sequence[str]) -> None:
        with extras("a study"):
            import pyarrow  # noqa: F401
        self.folder, self._parameters, self._metrics = folder, list(parameters), list(metrics)
        try:
            folder.mkdir(parents=True, exist_ok=True)
            self._journal = os.open(
                folder / "journal.jsonl", os.O_RDWR | os.O_CREAT | getattr(os, "O_BINARY", 0), 0o644
            )
            try:
                self._lock()
                self._check_owner()
                self._mend()
            except BaseException:
                os.close(self._journal)
                raise
        except OSError as e:
            raise InputError(f"{folder}: {e.strerror or e}") from None

    def _lock(self) -> None:
        """Lock the journal as long as it is open; Windows has no such lock.

        The lock is that of this process: forked workers, which may outlive it for a moment, do not hold it.
        """
        try:
            import fcntl
        except ImportError:
            return
        try:
            fcntl.lockf(self._journal, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except (BlockingIOError, PermissionError):
            raise InputError(f"{self.folder}: another study is writing into this folder") from None

    def _check_owner(self) -> None:
        path, mine = self.folder / "columns.json", {"parameters": self._parameters, "metrics": self._metrics}
        if path.exists():
            if _load(path) != mine:
                raise InputError(f"{self.folder}: holds the table of a study with other parameters or metrics")
        else:
            write_bytes(path, json.dumps(mine).encode())

    def seed(self) -> int:
        """Return the seed of this study: drawn at its first run, kept beside its table."""
        path = self.folder / "seed.json"
        if not path.exists():
            write_bytes(path, json.dumps(secrets.randbelow(2**31)).encode())
        return int(_load(path))

    def _mend(self) -> None:
        """Set damaged lines of the journal aside."""
        lines = self._lines()
        good = [line for line in lines if _row(line) is not None]
        if len(good) < len(lines):
            with open(self.folder / "damaged.jsonl", "ab") as aside:
                aside.writelines(line for line in lines if _row(line) is None)
            kept = b"".join(good)
            os.lseek(self._journal, 0, os.SEEK_SET)
            os.write(self._journal, kept)
            os.ftruncate(self._journal, len(kept))
            os.fsync(self._journal)
        os.lseek(self._journal, 0, os.SEEK_END)
        self._in_journal = len(good)

    def append(self, row: dict[str, Any]) -> None:
        """Add a finished run.

        Raises
        ------
        InputError
            If the disk is full.  Earlier rows stay intact, and the study can be resumed.
        """
        line = _line(row)
        at = os.lseek(self._journal, 0, os.SEEK_CUR)
        try:
            written = os.write(self._journal, line)
            if written != len(line):
                raise OSError(28, "no space left on device")
        except OSError as e:
            os.ftruncate(self._journal, at)
            os.lseek(self._journal, at, os.SEEK_SET)
            safe = f"{self._in_journal} rows are safe: free some space and run the study again"
            raise InputError(f"{self.folder}: {e.strerror or e}; {safe}") from None
        self._in_journal += 1
        if self._in_journal >= PART_ROWS:
            self._roll()

    def rows(self) -> Iterator[dict[str, Any]]:
        """Yield all rows, one for each id, in no particular order."""
        import pyarrow.parquet as pq

        seen: set[str] = set()
        for part in self._parts():
            for row in pq.read_table(part).to_pylist():
                if row["id"] not in seen:
                    seen.add(row["id"])
                    yield self._nested(row)
        for row in self._of_journal():
            if row["id"] not in seen:
                seen.add(row["id"])
                yield row

    def finish(self, rows: list[dict[str, Any]]) -> Path:
        """Write `results.parquet` with the given rows and return its path."""
        path = self.folder / "results.parquet"
        self._write(path, rows)
        return path

    def close(self) -> None:
        """Close the journal."""
        os.close(self._journal)

    def _of_journal(self) -> list[dict[str, Any]]:
        return [row for row in map(_row, self._lines()) if row is not None]

    def _lines(self) -> list[bytes]:
        os.lseek(self._journal, 0, os.SEEK_SET)  # a second handle would free the lock when it is closed
        content = b"".join(iter(lambda: os.read(self._journal, 2**20), b""))
        return content.splitlines(keepends=True)

    def _parts(self) -> list[Path]:
        return sorted(self.folder.glob("part-*.parquet"))

    def _roll(self) -> None:
        self._write(self.folder / f"part-{len(self._parts()):06d}.parquet", self._of_journal())
        os.ftruncate(self._journal, 0)  # a crash before this line leaves duplicates, which `rows` skips by id
        os.lseek(self._journal, 0, os.SEEK_SET)
        self._in_journal = 0

    def _write(self, path: Path, rows: list[dict[str, Any]]) -> None:
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
        write_bytes(path, sink.getvalue().to_pybytes())

    def _nested(self, row: dict[str, Any]) -> dict[str, Any]:
        plain = {name: row[name] for name in COLUMNS}
        plain["values"] = {name: row[name] for name in self._parameters}
        metrics = {name: row[f"metric:{name}"] for name in self._metrics}
        plain["metrics"] = {k: v for k, v in metrics.items() if v is not None}
        return plain
