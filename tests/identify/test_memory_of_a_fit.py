"""A fit that would take more than half of the memory is refused before it starts; long records take little more."""

import os
import tracemalloc

import numpy as np
import pytest
from click.testing import CliRunner

import hystfmu as hy
from hystfmu.cli import main
from hystfmu.identify.solvers import nonnegative as solver

pytestmark = pytest.mark.skipif(not hasattr(os, "sysconf"), reason="the system does not tell its memory")


def machine(monkeypatch: pytest.MonkeyPatch, megabytes: float) -> None:
    real = os.sysconf
    pages = int(megabytes * 2**20 / real("SC_PAGE_SIZE"))
    monkeypatch.setattr(os, "sysconf", lambda name: pages if name == "SC_PHYS_PAGES" else real(name))


@pytest.mark.parametrize("words", ["--model prandtl_ishlinskii", "--model preisach", ""])
def test_a_fit_that_takes_too_much_is_refused(words, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    hy.synthetic.piezo(20, 500.0).to_csv("a.csv")
    machine(monkeypatch, 0.5)
    done = CliRunner().invoke(main, ["fit", "a.csv", *words.split(), "-o", "m.toml"])
    assert done.exit_code == 2
    line = done.stderr.splitlines()[-1]
    assert line.startswith("hystfmu: a.csv: A fit must take at most half of the memory, 0.000244 GiB. Got ")
    assert "resample the record to a lower rate (--resample HZ), or fit fewer rows." in line
    assert os.listdir() == ["a.csv"]


def test_more_plays_take_more(monkeypatch):
    data = hy.synthetic.piezo(20, 500.0)
    machine(monkeypatch, 4e-3 * len(data.t))
    assert hy.fit(data, "prandtl_ishlinskii").key == "prandtl_ishlinskii"
    with pytest.raises(hy.InputError, match="at most half of the memory"):
        hy.fit(data, "prandtl_ishlinskii", N=400)


@pytest.mark.stress
def test_auto_leaves_out_what_takes_too_much(monkeypatch):
    data = hy.synthetic.piezo(20, 500.0)
    machine(monkeypatch, 2.5e-3 * len(data.t))
    reasons = hy.fit(data).provenance["auto_left_out"]
    assert any("at most half of the memory" in why for why in reasons.values())


def test_rows_in_parts_give_the_same_solution_in_less_memory(monkeypatch):
    rng = np.random.default_rng(0)
    columns = np.cumsum(rng.normal(size=(6000, 40)), axis=0)
    b = columns @ np.abs(rng.normal(size=40)) + rng.normal(size=6000)
    found, peaks = [], []
    for many in (10**6, 500):
        monkeypatch.setattr(solver, "MANY", many)
        tracemalloc.start()
        found.append(np.concatenate(solver.nonnegative(columns, b, np.ones((6000, 1)))))
        peaks.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
    np.testing.assert_allclose(found[1], found[0], rtol=1e-9, atol=1e-9)
    assert peaks[1] < peaks[0] / 3
