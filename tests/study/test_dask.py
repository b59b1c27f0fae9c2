"""Studies with Dask: workers, and the page of a cluster."""

import contextlib
import os
import re
import shlex
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner

import hystfmu as hy
from hystfmu.base.errors import InputError
from hystfmu.cli import main

pytestmark = pytest.mark.skipif(find_spec("distributed") is None, reason="Dask is not installed")


@pytest.fixture(scope="module")
def scratch(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The only folder that workers write to."""
    return tmp_path_factory.mktemp("scratch")


@pytest.fixture(scope="module")
def address(scratch: Path) -> Iterator[str]:
    """Two workers that run two tasks at a time."""
    import distributed

    with pytest.MonkeyPatch.context() as m:
        m.setenv("TMPDIR", str(scratch))
        sizes = {"n_workers": 2, "threads_per_worker": 2}
        with distributed.LocalCluster(**sizes, dashboard_address=None, local_directory=str(scratch)) as cluster:
            yield cluster.scheduler_address.replace("tcp://", "dask://")


@pytest.mark.turn("interrupted studies")
def test_the_same_table_on_a_cluster(write: Any, tmp_path: Path, address: str) -> None:
    path = write(method="sobol", n=40)
    local = hy.study(path, tmp_path / "local", workers=2)
    remote = hy.study(path, tmp_path / "remote", on=address)
    assert remote.ran == 80
    assert remote.table.read_bytes() == local.table.read_bytes()


def units_of(scratch: Path) -> list[Path]:
    """The folders of unpacked FMUs, found without a look into them, because a worker may remove one at this moment."""
    return list(scratch.glob("*/worker-*/hystfmu_run_*"))


@pytest.mark.stress
@pytest.mark.parametrize("interrupted", [False, True])
def test_workers_keep_nothing_of_a_study(
    write: Any, tmp_path: Path, scratch: Path, address: str, interrupted: bool
) -> None:
    """The unpacked FMUs exist while the study runs and are removed at its end; the cluster goes on."""
    path = write(engine="fmpy", parameters={"command.step": {"range": [1.0, 2.0], "steps": 40}})
    seen = []

    def progress(done: int, total: int, rate: float) -> None:
        seen.append(len(units_of(scratch)))
        if interrupted and len(seen) == 20:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt) if interrupted else contextlib.nullcontext():
        hy.study(path, tmp_path / "out", on=address, progress=progress)
    assert max(seen) > 0
    end = time.monotonic() + 20
    while interrupted and units_of(scratch) and time.monotonic() < end:
        time.sleep(0.05)  # a worker finishes its current run
    assert units_of(scratch) == []


@pytest.mark.parametrize(
    "address", ["dask://localhost", *(pytest.param(a, marks=pytest.mark.stress) for a in ("localhost:1", "tcp://h:1"))]
)
def test_a_wrong_address_is_one_line(write: Any, tmp_path: Path, address: str) -> None:
    with pytest.raises(InputError, match="must read dask://HOST:PORT"):
        hy.study(write(), tmp_path / "out", on=address)


# ---- page ------------------------------------------------------------------------------------------------------------

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


@pytest.mark.stress
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
