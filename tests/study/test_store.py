"""The table of a study on disk: one study at a time; a damaged journal costs the runs of its damaged lines only."""

from __future__ import annotations

import json
import os
import sys
from pathlib import Path
from typing import Any

import pytest

import hystfmu as hy
from hystfmu.base.errors import InputError
from hystfmu.studies.store import Store


@pytest.mark.skipif(sys.platform == "win32", reason="locks of POSIX")
def test_a_folder_belongs_to_one_study_at_a_time(tmp_path: Path) -> None:
    store = Store(tmp_path, ["a"], ["m"])
    list(store.rows())  # reading keeps the lock
    assert elsewhere(tmp_path) == f"{tmp_path}: another study is writing into this folder"
    store.close()
    assert elsewhere(tmp_path) == "free"


def elsewhere(folder: Path) -> str:
    """What another process is told that opens the folder."""
    ours, theirs = os.pipe()
    if (child := os.fork()) == 0:
        try:
            Store(folder, ["a"], ["m"])
            os.write(theirs, b"free")
        except InputError as e:
            os.write(theirs, str(e).encode())
        finally:
            os._exit(0)
    os.waitpid(child, 0)
    os.close(theirs)
    with open(ours) as told:
        return told.read()


@pytest.mark.parametrize("damage", ["zero byte", "changed digit", "torn in the middle", "not UTF-8", "old without sum"])
def test_damaged_lines_are_set_aside_and_run_again(damage: str, write: Any, tmp_path: Path) -> None:
    path, folder = write(), tmp_path / "out"
    whole = hy.study(path, folder, workers=1).table.read_bytes()
    journal = folder / "journal.jsonl"
    lines = journal.read_bytes().splitlines(keepends=True)
    middle = lines[7]
    at = middle.index(b'"last":') + 9  # in a value
    lines[7] = {
        "zero byte": middle[:at] + b"\0" + middle[at:],
        "changed digit": middle[:at] + (b"1" if middle[at : at + 1] != b"1" else b"2") + middle[at + 1 :],
        "torn in the middle": middle[:at],
        "not UTF-8": middle[:at] + b"\xff" + middle[at:],
        "old without sum": middle.partition(b"\t")[2],
    }[damage]
    torn = lines[7] + lines[8] if damage == "torn in the middle" else lines[7]
    journal.write_bytes(b"".join(lines))
    outcome = hy.study(path, folder, workers=1)
    assert outcome.ran == (2 if damage == "torn in the middle" else 1)
    assert outcome.table.read_bytes() == whole
    assert (folder / "damaged.jsonl").read_bytes() == torn
    assert hy.study(path, folder, workers=1).ran == 0


@pytest.mark.parametrize("content", [b"", b"\0", b"[1"])
@pytest.mark.parametrize("name", ["columns", "seed"])
def test_columns_or_seed_damaged_with_their_copy_are_one_line(name: str, content: bytes, tmp_path: Path) -> None:
    def opened() -> int:
        store = Store(tmp_path, ["a"], ["m"])
        try:
            return store.seed()
        finally:
            store.close()

    seed = opened()
    for file in (f"{name}.json", f"{name}.copy.json"):
        (tmp_path / file).write_bytes(content)
    for _ in range(2):  # the lock is free again
        with pytest.raises(InputError, match=rf"{name}\.json: The file and its copy are damaged"):
            opened()
    for file in (f"{name}.json", f"{name}.copy.json"):
        (tmp_path / file).unlink()
    assert (opened() == seed) == (name == "columns")


def test_a_folder_of_an_older_version_is_refused(tmp_path: Path) -> None:
    """It kept columns and seed without a checksum."""
    Store(tmp_path, ["a"], ["m"]).close()
    file = tmp_path / "columns.json"
    file.write_text(json.dumps(json.loads(file.read_text())["value"]))
    with pytest.raises(InputError, match=r"columns\.json: HystFMU before 0\.1 wrote this folder\. Choose another one"):
        Store(tmp_path, ["a"], ["m"])
