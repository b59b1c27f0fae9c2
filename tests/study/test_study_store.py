"""The table on disk: lines with sums, two copies; damaged and full, it resumes to the same table."""

import json
import os
import random
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

import hystfmu as hy
from hystfmu.base.errors import InputError
from hystfmu.studies.store import Store, open_locked


def test_files_that_are_read_only_stay_as_they_are(tmp_path: Path) -> None:
    Store(tmp_path, ["a"], ["m"]).close()
    (tmp_path / "journal.jsonl").write_bytes(b"torn")
    (tmp_path / "damaged.jsonl").write_bytes(b"before")
    (tmp_path / "damaged.jsonl").chmod(0o444)
    for opened in (lambda: Store(tmp_path, ["a"], ["m"]), lambda: open_locked(tmp_path / "damaged.jsonl")):
        with pytest.raises(InputError, match=r"damaged\.jsonl: cannot be written: it is read-only"):
            opened()
    assert (tmp_path / "damaged.jsonl").read_bytes() == b"before"


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


# ---- damage ----------------------------------------------------------------------------------------------------------
DRAWS: dict[str, Any] = {"method": "random", "n": 12, "seed": "run"}  # 24 rows, a seed of their own
ROWS = 96  # of a study whose journal takes 23 kB
FILES = ("journal.jsonl", "columns.json", "columns.copy.json", "seed.json", "seed.copy.json")


_MADE: list[Path] = []


@pytest.fixture
def study(write: Any, tmp_path: Path, tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path, bytes]:
    """A study file, its folder with a journal of 24 rows, made once, and its table."""
    path, folder = write(**DRAWS), tmp_path / "out"
    if not _MADE:
        _MADE.append(tmp_path_factory.mktemp("damage"))
        hy.study(path, _MADE[0], workers=1)
    shutil.copytree(_MADE[0], folder)
    return path, folder, (folder / "results.parquet").read_bytes()


def only(folder: Path, pattern: str) -> Path:
    (found,) = folder.glob(pattern)
    return found


@pytest.mark.some(2)
@pytest.mark.parametrize("pattern", FILES)
@pytest.mark.parametrize("draw", range(2))
def test_a_flipped_byte(pattern: str, draw: int, study: tuple[Path, Path, bytes]) -> None:
    path, folder, whole = study
    file, rng = only(folder, pattern), random.Random(f"{pattern} {draw}")
    content = bytearray(file.read_bytes())
    content[rng.randrange(len(content))] ^= 1 << rng.randrange(8)
    file.write_bytes(content)
    outcome = hy.study(path, folder, workers=1)
    assert outcome.table.read_bytes() == whole
    if pattern == "journal.jsonl":
        assert 1 <= outcome.ran <= 2  # two if the byte was the end of a line
    else:
        assert outcome.ran == 0
    assert hy.study(path, folder, workers=1).ran == 0


@pytest.mark.some(2)
@pytest.mark.parametrize("pattern", FILES)
@pytest.mark.parametrize("damage", ["emptied", "removed", "cut in half"])
def test_a_lost_file(pattern: str, damage: str, study: tuple[Path, Path, bytes]) -> None:
    path, folder, whole = study
    file = only(folder, pattern)
    content = file.read_bytes()
    if damage == "removed":
        file.unlink()
    else:
        file.write_bytes(b"" if damage == "emptied" else content[: len(content) // 2])
    outcome = hy.study(path, folder, workers=1)
    assert outcome.table.read_bytes() == whole
    lost = 12 if damage == "cut in half" else 24
    assert outcome.ran == (lost if pattern == "journal.jsonl" else 0)
    assert hy.study(path, folder, workers=1).ran == 0


@pytest.mark.skipif(sys.platform == "win32", reason="another program may not append to an open file there")
def test_another_program_writes_into_the_journal(write: Any, tmp_path: Path) -> None:
    """It ends a line, leaves one torn, and never asked for the lock: one row of ours is lost with the torn line."""
    path, folder = write(), tmp_path / "out"
    whole = hy.study(path, tmp_path / "whole", workers=1).table.read_bytes()

    def disturb(done: int, total: int, rate: float) -> None:
        text = {5: "whole\\n", 11: '01234567\\t{"torn"'}.get(done)
        if text:
            subprocess.run(["sh", "-c", f"printf '{text}' >> {folder}/journal.jsonl"], check=True)

    assert hy.study(path, folder, workers=1, progress=disturb).table.read_bytes() == whole
    outcome = hy.study(path, folder, workers=1)
    assert outcome.ran == 1
    assert outcome.table.read_bytes() == whole
    assert (folder / "damaged.jsonl").read_bytes().startswith(b'whole\n01234567\t{"torn"')


@pytest.mark.turn("interrupted studies")
def test_a_second_study_in_the_same_process_is_refused_and_the_lock_stays(tmp_path: Path) -> None:
    store = Store(tmp_path, ["a"], ["m"])
    list(store.rows())  # reading keeps the lock
    with pytest.raises(InputError, match="another study is writing into this folder"):
        Store(tmp_path, ["a"], ["m"])
    code = "import sys; from pathlib import Path; from hystfmu.studies.store import Store\n"
    code += "Store(Path(sys.argv[1]), ['a'], ['m'])"
    done = subprocess.run([sys.executable, "-c", code, str(tmp_path)], capture_output=True, text=True, env=paths())
    assert "another study is writing into this folder" in done.stderr
    store.close()
    Store(tmp_path, ["a"], ["m"]).close()


def test_the_lock_of_windows(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Emulated: one byte far beyond the journal is locked, a refusal is the same line, and reading starts at 0."""

    class Msvcrt:
        LK_NBLCK = 2
        taken: int | None = None

        @classmethod
        def locking(cls, handle: int, mode: int, n: int) -> None:
            assert (mode, n) == (cls.LK_NBLCK, 1)
            at = os.lseek(handle, 0, os.SEEK_CUR)
            assert 2**29 < at < 2**31  # beyond every journal; its C library seeks with 32 bits
            if at == cls.taken:
                raise PermissionError(13, "Permission denied")
            cls.taken = at

    from hystfmu.studies import store

    class Windows:
        platform = "win32"

    monkeypatch.setattr(store, "sys", Windows)
    monkeypatch.setitem(sys.modules, "msvcrt", Msvcrt)
    handle = store.open_locked(tmp_path / "journal.jsonl")
    assert os.lseek(handle, 0, os.SEEK_CUR) == 0
    monkeypatch.setattr(store, "_HELD", {})  # as in another process
    with pytest.raises(InputError, match="another study is writing into this folder"):
        store.open_locked(tmp_path / "journal.jsonl")
    os.close(handle)


def test_rows_are_on_the_disk_after_a_quarter_of_a_second(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A loss of power costs the rows that came within that time after the last sync, at any rate of rows."""
    clock, calls = [0.0], []
    monkeypatch.setattr("hystfmu.studies.store.time.monotonic", lambda: clock[0])
    monkeypatch.setattr("hystfmu.studies.store.os.fsync", lambda handle: calls.append(clock[0]))
    store = Store(tmp_path, ["a"], ["m"])
    calls.clear()
    row = {"index": 0, "variation": 0, "case": "c", "status": "ok", "reason": "", "values": {"a": 1.0}, "metrics": {}}
    for k, at in enumerate([0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 5.0, 5.1, 9.0]):
        clock[0] = at
        store.append(row | {"id": str(k)})
    assert calls == [0.3, 0.6, 5.0, 9.0]
    store.close()
    assert len(calls) == 5


def test_a_row_that_does_not_fit_leaves_the_others(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    row = {"index": 0, "variation": 0, "case": "c", "status": "ok", "reason": "", "values": {"a": 1.0}, "metrics": {}}
    for ids in ("a", "bc"):
        store = Store(tmp_path, ["a"], ["m"])
        for name in ids:
            store.append(row | {"id": name})
        if ids == "a":
            store.close()
    write, whole = os.write, (tmp_path / "journal.jsonl").read_bytes()
    monkeypatch.setattr("hystfmu.studies.store.os.write", lambda handle, line: write(handle, line[:9]))
    with pytest.raises(InputError, match=r"No space left on device; 3 rows are safe: free some space and run the st"):
        store.append(row | {"id": "d"})
    assert (tmp_path / "journal.jsonl").read_bytes() == whole
    assert [r["id"] for r in store.rows()] == ["a", "b", "c"]
    store.close()


def paths() -> dict[str, str]:
    return {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}


FULL = """
mount -t tmpfs -o size={size}k none "$1" || exit 77
$2 -m hystfmu.cli study "$3" -o "$1" -j 1; echo "status $?"
mount -o remount,size=50m "$1" && $2 -m hystfmu.cli study "$3" -o "$1" -j 1 && cp "$1/results.parquet" "$4"
"""


@pytest.mark.turn("interrupted studies")
@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="mounts a small disk")
@pytest.mark.parametrize("size", [24, *(pytest.param(n, marks=pytest.mark.stress) for n in (8, 40))])
def test_a_full_disk_resumes_to_the_same_table(size: int, write: Any, tmp_path: Path) -> None:
    """A disk of some kB is full at the first files, amid the journal, or at the table and the report."""
    path = write(**DRAWS | {"n": ROWS // 2, "seed": 1})
    whole = hy.study(path, tmp_path / "whole", workers=1).table.read_bytes()
    (tmp_path / "small").mkdir()
    space = [] if os.geteuid() == 0 else ["--user", "--map-root-user"]
    words = ["sh", "-c", FULL.format(size=size), "sh", str(tmp_path / "small"), sys.executable, str(path)]
    if not shutil.which("unshare"):
        pytest.skip("needs unshare")
    done = subprocess.run(
        ["unshare", *space, "--mount", *words, str(tmp_path / "table")], capture_output=True, text=True, env=paths()
    )
    if done.returncode == 77 or "unshare" in done.stderr:
        pytest.skip(f"cannot mount here: {done.stderr}")
    (line,) = done.stderr.splitlines()
    assert line.startswith("hystfmu: ")
    assert "No space left on device" in line
    status, resumed, *_ = done.stdout.splitlines()
    assert status == "status 2"
    assert resumed.startswith(f"{ROWS} rows")
    assert (tmp_path / "table").read_bytes() == whole
