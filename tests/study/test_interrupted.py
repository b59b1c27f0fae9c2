"""Interrupted studies: killed workers, a killed parent, a full disk.  The final table is that of an undisturbed run."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import pytest

import hystfmu as hy
from hystfmu.studies.pool import Pool

pytest.importorskip("pyarrow")
if sys.platform == "win32":
    pytest.skip("signals and limits of POSIX", allow_module_level=True)

# slow enough to be interrupted
LONG: dict[str, Any] = {"method": "sobol", "n": 96, "engine": "native", "of_scenario": {"step": 1e-5}}
RUN = "import sys; import hystfmu as hy; hy.study(sys.argv[1], sys.argv[2], workers=2)"
SPAWNED = "from hystfmu.studies import pool; pool._forked = lambda systems, run: False; "


_QUIET: list[bytes] = []


@pytest.fixture(params=["forked", pytest.param("spawned", marks=pytest.mark.stress)])
def program(request: pytest.FixtureRequest) -> str:
    """Runs the long study with workers of one kind."""
    return RUN if request.param == "forked" else SPAWNED + RUN


@pytest.fixture
def quiet(write: Any, tmp_path: Path) -> bytes:
    """The table of an uninterrupted run, made once."""
    if not _QUIET:
        _QUIET.append(hy.study(write(**LONG), tmp_path / "quiet", workers=2).table.read_bytes())
    return _QUIET[0]


def start(program: str, path: Path, folder: Path, **more: Any) -> subprocess.Popen[str]:
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}
    return subprocess.Popen(
        [sys.executable, "-c", program, str(path), str(folder)],
        env=environment,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
        **more,
    )


def rows(folder: Path) -> int:
    journal = folder / "journal.jsonl"
    return journal.read_bytes().count(b"\n") if journal.exists() else 0


def wait_for(folder: Path, n: int, process: subprocess.Popen[str]) -> None:
    end = time.monotonic() + 60
    while rows(folder) < n:
        assert process.poll() is None, process.stderr and process.stderr.read()
        assert time.monotonic() < end
        time.sleep(0.005)


def children(pid: int) -> list[int]:
    """Return the worker processes of a parent."""
    found = []
    for entry in Path("/proc").glob("[0-9]*/stat"):
        try:
            text = entry.read_text()
            command = (entry.parent / "cmdline").read_bytes()
        except OSError:
            continue
        if int(text.rsplit(")", 1)[1].split()[1]) == pid and b"resource_tracker" not in command:
            found.append(int(entry.parent.name))
    return found


@pytest.mark.skipif(not Path("/proc").exists(), reason="needs /proc")
def test_killed_workers(write: Any, tmp_path: Path, program: str, quiet: bytes) -> None:
    folder = tmp_path / "out"
    process = start(program, write(**LONG), folder)
    for n in (5, 50, 100):
        wait_for(folder, n, process)
        os.kill(children(process.pid)[0], signal.SIGKILL)
    assert process.wait(120) == 0, process.stderr and process.stderr.read()
    assert (folder / "results.parquet").read_bytes() == quiet


@pytest.mark.skipif(not Path("/proc").exists(), reason="needs /proc")
def test_a_killed_parent(write: Any, tmp_path: Path, program: str, quiet: bytes) -> None:
    folder = tmp_path / "out"
    path = write(**LONG)
    process = start(program, path, folder)
    wait_for(folder, 40, process)
    workers = children(process.pid)
    process.kill()
    process.wait()
    kept = rows(folder)
    end = time.monotonic() + 20
    while any(Path(f"/proc/{w}/cmdline").exists() and Path(f"/proc/{w}/cmdline").read_bytes() for w in workers):
        assert time.monotonic() < end, "workers without a parent must end"
        time.sleep(0.05)
    outcome = hy.study(path, folder, workers=2)
    assert outcome.ran == len(outcome.rows) - kept  # finished runs are not repeated
    assert outcome.table.read_bytes() == quiet


def test_a_full_disk(write: Any, tmp_path: Path, program: str, quiet: bytes) -> None:
    """Emulate a full disk by a limit on file sizes, which raises the same error at the same call."""
    import resource

    folder, path = tmp_path / "out", write(**LONG)
    process = start(
        program, path, folder, preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (20_000, 20_000))
    )
    assert process.wait(120) != 0
    assert process.stderr is not None
    assert "rows are safe: free some space and run the study again" in process.stderr.read().splitlines()[-1]
    kept = rows(folder)
    assert 0 < kept < 192
    outcome = hy.study(path, folder, workers=2)
    assert outcome.ran == len(outcome.rows) - kept
    assert outcome.table.read_bytes() == quiet


def test_a_torn_line_does_not_count(write: Any, tmp_path: Path) -> None:
    path = write()
    whole = hy.study(path, tmp_path / "out", workers=1).table.read_bytes()
    journal = tmp_path / "out" / "journal.jsonl"
    journal.write_bytes(journal.read_bytes()[:-30])
    outcome = hy.study(path, tmp_path / "out", workers=1)
    assert outcome.ran == 1
    assert outcome.table.read_bytes() == whole


def test_full_journals_become_parts(write: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = write()
    whole = hy.study(path, tmp_path / "a", workers=1).table.read_bytes()
    monkeypatch.setattr("hystfmu.studies.store.PART_ROWS", 10)
    outcome = hy.study(path, tmp_path / "b", workers=1)
    assert len(list((tmp_path / "b").glob("part-*.parquet"))) == 2
    assert outcome.table.read_bytes() == whole
    assert hy.study(path, tmp_path / "b", workers=1).ran == 0


def test_workers_that_cannot_start_end_the_study_with_one_line(write: Any, tmp_path: Path) -> None:
    """A script from standard input has no file for a worker to import."""
    path = write(engine="fmpy")
    script = f"import hystfmu as hy\nhy.study({str(path)!r}, {str(tmp_path / 'out')!r}, workers=1)\n"
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}
    done = subprocess.run(
        [sys.executable], input=script, env=environment, capture_output=True, text=True, timeout=100, cwd=tmp_path
    )
    assert done.returncode == 1
    assert "before they begin; a script that runs a study must be a file" in done.stderr.splitlines()[-1]


def test_workers_end_with_the_pool(write: Any) -> None:
    from hystfmu.scenario import Run, build
    from hystfmu.studies import Study

    study = Study(write())
    with Pool([build(c) for c in study.cases], Run("native", seconds=10.0), 2) as pool:
        assert list(pool.run([], 5)) == []
