"""The commands of python/docs/howto/cluster.md start a scheduler and workers, and the study gives the local table."""

from __future__ import annotations

import contextlib
import os
import re
import shlex
import socket
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from click.testing import CliRunner

from hystfmu.cli import main

pytest.importorskip("distributed", reason="the page needs Dask: pip install 'hystfmu[study]'")
pytest.importorskip("pyarrow")

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "python" / "docs" / "howto" / "cluster.md").read_text()
SCHEDULER, WORKER, STUDY = re.findall(r"^```sh\n(.*?)\n```$", PAGE, re.MULTILINE | re.DOTALL)
SECONDS = 120.0  # until the workers have started on a loaded machine


@contextlib.contextmanager
def running(command: str, folder: Path) -> Iterator[subprocess.Popen[bytes]]:
    """Run a command of the page with the `dask` of this environment until the block ends."""
    program, *words = shlex.split(command)
    assert program == "dask"
    process = subprocess.Popen(
        [str(Path(sys.executable).parent / "dask"), *words],
        cwd=folder,
        env={**os.environ, "DASK_TEMPORARY_DIRECTORY": str(folder)},
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    try:
        yield process
    finally:
        process.terminate()
        with contextlib.suppress(subprocess.TimeoutExpired):
            process.wait(20)
        process.kill()


def test_the_two_commands_and_the_study_of_the_page(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from distributed import Client

    monkeypatch.chdir(tmp_path)
    (tmp_path / "scenarios").symlink_to(ROOT / "scenarios")
    (toml,) = re.findall(r"^```toml\n(.*?)^```$", PAGE, re.MULTILINE | re.DOTALL)
    (tmp_path / "gain.study.toml").write_text(toml)
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = str(free.getsockname()[1])
    scheduler, worker, study = (text.replace("8786", port) for text in (SCHEDULER, WORKER, STUDY))
    with running(scheduler, tmp_path), running(worker, tmp_path):
        with Client(f"tcp://127.0.0.1:{port}", timeout=SECONDS) as client:
            client.wait_for_workers(2, timeout=SECONDS)
        remote = CliRunner().invoke(main, shlex.split(study)[1:])
    local = CliRunner().invoke(main, ["study", "gain.study.toml", "-o", "local"])
    assert remote.exit_code == local.exit_code == 0, remote.output
    tables = [(tmp_path / folder / "results.parquet").read_bytes() for folder in ("out", "local")]
    assert tables[0] == tables[1]
