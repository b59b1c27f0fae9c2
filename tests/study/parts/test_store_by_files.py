"""The table on disk by its files: lines with sums, two copies of columns and seed, parts, what a full disk says."""

from __future__ import annotations

import json
import os
import zlib
from pathlib import Path
from typing import Any

import pyarrow.parquet as pq
import pytest

from hystfmu.base.errors import InputError
from hystfmu.studies import store
from hystfmu.studies.store import Store, close_locked, open_locked


def row(k: int, **more: Any) -> dict[str, Any]:
    return {
        "index": k, "variation": k, "case": "one", "id": f"id{k}", "status": "ok", "reason": "",
        "values": {"a": 1.0 * k}, "metrics": {"m": 2.0 * k}, **more,
    }  # fmt: skip


@pytest.fixture
def made(tmp_path: Path) -> Any:
    opened: list[Store] = []

    def make(parameters: Any = ("a",), metrics: Any = ("m",)) -> Store:
        while opened:
            opened.pop().close()
        opened.append(Store(tmp_path / "out", parameters, metrics))
        return opened[0]

    yield make
    while opened:
        opened.pop().close()


def by_id(rows: Any) -> dict[str, dict[str, Any]]:
    return {r["id"]: r for r in rows}


def test_a_line_is_a_sum_and_json(made: Any, tmp_path: Path) -> None:
    made().append(row(3))
    content = json.dumps(row(3)).encode()
    line = b"%08x\t" % zlib.crc32(content) + content + b"\n"
    assert (tmp_path / "out" / "journal.jsonl").read_bytes() == line
    assert store._row(line) == row(3)
    for damaged in (
        line[:-1],
        b"0" + line[1:] if line[:1] != b"0" else b"1" + line[1:],
        line.replace(b"one", b"two"),
        b"",
    ):
        assert store._row(damaged) is None


def test_rows_survive_a_new_start_and_the_later_one_counts(made: Any) -> None:
    s = made()
    for k in range(3):
        s.append(row(k))
    s.append(row(1, status="timeout"))
    again = made()
    assert by_id(again.rows()) == {"id0": row(0), "id1": row(1, status="timeout"), "id2": row(2)}
    assert again._in_journal == 4
    again.append(row(7))
    assert again._in_journal == 5
    assert again._safe == "5 rows are safe: free some space and run the study again"


def test_damaged_lines_are_blanked_in_place(made: Any, tmp_path: Path) -> None:
    s = made()
    for k in range(3):
        s.append(row(k))
    journal = tmp_path / "out" / "journal.jsonl"
    lines = journal.read_bytes().splitlines(keepends=True)
    wrong = lines[1].replace(b"one", b"two")
    journal.write_bytes(lines[0] + wrong + lines[2] + b"torn")
    assert set(by_id(made().rows())) == {"id0", "id2"}
    assert (tmp_path / "out" / "damaged.jsonl").read_bytes() == wrong + b"torn"
    assert journal.read_bytes() == lines[0] + b" " * (len(wrong) - 1) + b"\n" + lines[2] + b"   \n"
    assert made()._in_journal == 2
    assert (tmp_path / "out" / "damaged.jsonl").read_bytes() == wrong + b"torn"  # blanks are no damage


@pytest.mark.parametrize("before", [19_998, 19_999])
def test_a_full_journal_becomes_a_part(made: Any, tmp_path: Path, before: int) -> None:
    s, folder = made(), tmp_path / "out"
    s._in_journal = before
    s.append(row(0, status="timeout", limits={"timeout": 5.0, "memory": 2.0}, metrics={}))
    parts = sorted(folder.glob("part-*.parquet"))
    assert len(parts) == (before == 19_999)
    if parts:
        content = parts[0].read_bytes()
        assert parts[0].name == f"part-000000-{zlib.crc32(content):08x}.parquet"
        assert (folder / "journal.jsonl").read_bytes() == b""
        assert s._in_journal == 0
        assert next(iter(s.rows())) == row(0, status="timeout", limits={"timeout": 5.0, "memory": 2.0}, metrics={})
        s.append(row(1))
        s._roll()
        assert sorted(p.name[:11] for p in folder.glob("part-*.parquet")) == ["part-000000", "part-000001"]
        assert by_id(s.rows())["id1"] == row(1)
        assert "limits" not in by_id(s.rows())["id1"]


def test_the_final_table_has_typed_columns(made: Any) -> None:
    path = made().finish([row(0), row(1, metrics={}, values={})])
    table = pq.read_table(path)
    assert table.column_names == ["index", "variation", "case", "id", "status", "reason", "a", "metric:m"]
    assert [str(t) for t in table.schema.types] == ["int64", "int64", *["string"] * 4, "double", "double"]
    assert list(table.to_pylist()[1].values()) == [1, 1, "one", "id1", "ok", "", None, None]
    assert path.name == "results.parquet"


def test_columns_and_seed_are_kept_twice(made: Any, tmp_path: Path) -> None:
    seed = made().seed()
    assert 0 <= seed < 2**31
    folder = tmp_path / "out"
    sealed = json.loads((folder / "seed.json").read_bytes())
    assert sealed == {"crc32": zlib.crc32(json.dumps(seed).encode()), "value": seed}
    assert (folder / "seed.json").read_bytes() == (folder / "seed.copy.json").read_bytes()
    (folder / "seed.json").write_text('{"crc32": 1, "value": 5}')
    assert made().seed() == seed
    assert json.loads((folder / "seed.json").read_bytes()) == sealed  # mended
    (folder / "seed.copy.json").unlink()
    assert made().seed() == seed
    assert (folder / "seed.copy.json").exists()
    for name in ("seed.json", "seed.copy.json"):
        (folder / name).write_text('{"value": 5}')
    with pytest.raises(InputError, match=r"seed\.json: The file and its copy are damaged\. Remove them"):
        made().seed()
    with pytest.raises(InputError, match="holds the table of a study with other parameters or metrics"):
        made(("b",))
    made()


def test_a_disk_that_fills_up_keeps_the_earlier_rows(made: Any, tmp_path: Path, monkeypatch: Any) -> None:
    s = made()
    s.append(row(0))
    whole = (tmp_path / "out" / "journal.jsonl").read_bytes()
    write = os.write
    monkeypatch.setattr(store.os, "write", lambda handle, content: write(handle, content[: len(content) // 2]))
    with pytest.raises(InputError, match="No space left on device; 1 rows are safe: free some space and run"):
        s.append(row(1))
    monkeypatch.undo()
    assert (tmp_path / "out" / "journal.jsonl").read_bytes() == whole

    def full(path: Path, content: bytes) -> None:
        raise InputError("full")

    monkeypatch.setattr(store, "write_bytes", full)
    with pytest.raises(InputError, match="full; 1 rows are safe"):
        s._roll()


def test_a_file_and_a_folder_are_synchronised_and_closed(tmp_path: Path, monkeypatch: Any) -> None:
    synced: list[int] = []
    monkeypatch.setattr(store.os, "fsync", synced.append)
    (tmp_path / "file").write_text("x")
    store._sync(tmp_path / "file")
    store._sync(tmp_path)
    assert len(synced) == 2
    for handle in synced:
        with pytest.raises(OSError, match="Bad file descriptor"):
            os.fstat(handle)


def test_files_that_are_read_only_stay_as_they_are(made: Any, tmp_path: Path) -> None:
    made().append(row(0))
    out = tmp_path / "out"
    (out / "journal.jsonl").write_bytes(b"torn")
    (out / "damaged.jsonl").write_bytes(b"before")
    (out / "damaged.jsonl").chmod(0o444)
    with pytest.raises(InputError, match=r"damaged\.jsonl: cannot be written: it is read-only"):
        made()
    with pytest.raises(InputError, match=r"damaged\.jsonl: cannot be written: it is read-only"):
        open_locked(out / "damaged.jsonl")
    assert (out / "damaged.jsonl").read_bytes() == b"before"


# ---- the lock -------------------------------------------------------------------------------------------------------
def test_a_lock_that_fails_leaves_no_handle_open(tmp_path: Path, monkeypatch: Any) -> None:
    handles: list[int] = []
    held = dict(store._HELD)  # of other tests

    def lock(error: OSError) -> Any:
        def fail(handle: int) -> None:
            handles.append(handle)
            raise error

        return fail

    for error, caught in (
        (BlockingIOError(), InputError), (PermissionError(), InputError), (OSError("no locks"), OSError),
    ):  # fmt: skip
        monkeypatch.setattr(store, "_lock", lock(error))
        with pytest.raises(caught):
            open_locked(tmp_path / "file")
        with pytest.raises(OSError, match="Bad file descriptor"):
            os.fstat(handles[-1])
    assert held == store._HELD
    monkeypatch.undo()
    handle = open_locked(tmp_path / "file")
    with pytest.raises(InputError, match="another study is writing into this folder"):
        open_locked(tmp_path / "file")
    os.write(handle, b"ab")
    os.lseek(handle, 0, os.SEEK_SET)
    assert os.read(handle, 2) == b"ab"
    assert (tmp_path / "file").stat().st_mode & 0o700 == 0o600
    close_locked(handle)
    close_locked(open_locked(tmp_path / "file"))
