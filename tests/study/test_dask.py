"""A study on a local Dask cluster of two workers gives the table of local processes."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from hystfmu.errors import InputError
from hystfmu.study import run_study

distributed = pytest.importorskip("distributed")


def test_the_same_table_on_a_cluster(write: Any, tmp_path: Path) -> None:
    path = write(method="sobol", n=40)
    local = run_study(path, tmp_path / "local", workers=2)
    with distributed.LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as cluster:
        address = cluster.scheduler_address.replace("tcp://", "dask://")
        remote = run_study(path, tmp_path / "remote", on=address)
    assert remote.ran == 80
    assert remote.table.read_bytes() == local.table.read_bytes()


@pytest.mark.parametrize("address", ["localhost:1", "tcp://localhost:1", "dask://localhost"])
def test_a_wrong_address_is_one_line(write: Any, tmp_path: Path, address: str) -> None:
    with pytest.raises(InputError, match="must read dask://HOST:PORT"):
        run_study(write(), tmp_path / "out", on=address)
