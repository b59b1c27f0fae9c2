"""Store the table of a study on disk.  Every finished run is stored at once and survives an interruption.

A row is one line of `journal.jsonl`, appended when its run ends.  A line cut off by a crash or a full disk is dropped.
Full journals become Parquet parts by atomic renames.  The final table is `results.parquet`, sorted by row.  The table
does not depend on when, where or in which order the runs were made.
"""

from __future__ import annotations

import json
import os
import secrets
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from hystfmu.base.errors import InputError
from hystfmu.base.extras import extras
from hystfmu.base.files import write_bytes

PART_ROWS = 20_000
COLUMNS = ("index", "variation", "case", "id", "status", "reason")


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
        If the folder holds the table of another study or cannot be written, or the extra 'study' is not installed.
    """

    def __init__(self, folder: Path, parameters: Sequence[str], metrics: Sequence[str]) -> None:
        with extras("a study"):
            import pyarrow  # noqa: F401
        self.folder, self._parameters, self._metrics = folder, list(parameters), list(metrics)
        try:
            folder.mkdir(parents=True, exist_ok=True)
            self._check_owner()
            self._journal = os.open(folder / "journal.jsonl", os.O_RDWR | os.O_CREAT, 0o644)
            self._mend()
        except OSError as e:
            raise InputError(f"{folder}: {e.strerror or e}") from None

    def _check_owner(self) -> None:
        path, mine = self.folder / "columns.json", {"parameters": self._parameters, "metrics": self._metrics}
        if path.exists():
            if json.loads(path.read_text()) != mine:
                raise InputError(f"{self.folder}: holds the table of a study with other parameters or metrics")
        else:
            write_bytes(path, json.dumps(mine).encode())

    def seed(self) -> int:
        """Return the seed of this study: drawn at its first run, kept beside its table."""
        path = self.folder / "seed.json"
        if not path.exists():
            write_bytes(path, json.dumps(secrets.randbelow(2**31)).encode())
        return int(json.loads(path.read_text()))

    def _mend(self) -> None:
        """Truncate the journal after its last whole line."""
        with os.fdopen(os.dup(self._journal), "rb") as f:
            content = f.read()
        whole = content.rfind(b"\n") + 1
        os.ftruncate(self._journal, whole)
        os.lseek(self._journal, whole, os.SEEK_SET)
        self._in_journal = content.count(b"\n")

    def append(self, row: dict[str, Any]) -> None:
        """Add a finished run.

        Raises
        ------
        InputError
            If the disk is full.  Earlier rows stay intact, and the study can be resumed.
        """
        line = (json.dumps(row, allow_nan=True) + "\n").encode()
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
        for line in (self.folder / "journal.jsonl").read_bytes().splitlines():
            row = json.loads(line)
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

    def _parts(self) -> list[Path]:
        return sorted(self.folder.glob("part-*.parquet"))

    def _roll(self) -> None:
        lines = (self.folder / "journal.jsonl").read_bytes().splitlines()
        self._write(self.folder / f"part-{len(self._parts()):06d}.parquet", [json.loads(line) for line in lines])
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
