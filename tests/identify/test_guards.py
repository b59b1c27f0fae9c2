"""Guards of every fit: runaway models and fits too large are errors; what a record does not show is a warning."""

import os
import tracemalloc
from dataclasses import replace

import numpy as np
import plants
import pytest
from invoked import invoked

import hystfmu as hy
from hystfmu import Dataset, Graph, Input, InputError, Node, Output, fit
from hystfmu.data.signals import training
from hystfmu.identify.methods.weighted_sums import KINDS
from hystfmu.identify.solvers import nonnegative as solver


def data():
    u = training(12, 1, 0.05)
    return Dataset.from_signal(u, plants.prandtl_ishlinskii(u), 1e-3, "run")


def built(monkeypatch, build):
    """Replace the fit of the kind prandtl_ishlinskii."""
    monkeypatch.setitem(KINDS, "prandtl_ishlinskii", replace(KINDS["prandtl_ishlinskii"], build=build))


def with_memory(**values):
    """Build the input plus the output of a linear block that the record hardly excites."""
    kind = "creep" if "T" in values else "transfer_function"
    nodes = [Node("slow", kind, {}, values), Node("total", "sum", {"n": 2})]
    wires = [("slow.y", "total.u[2]")]
    made = Graph(nodes, wires, [Input("u", ("total.u[1]", "slow.u"))], [Output("y", "total.y")])
    return lambda *arguments: (made, 3)


def quick():
    """Record a sine at 20 rows a cycle, 15 cycles; the output is the input."""
    u = np.sin(2 * np.pi * np.arange(300) / 20)
    return Dataset.from_signal(u, u, 1e-3, "quick")


def test_a_model_that_grows_on_another_signal_is_refused(monkeypatch):
    """A pole at +60 1/s starts at 1e-10 of the input: it stays small over the record."""
    built(monkeypatch, with_memory(b=[6e-9], a=[1.0, -60.0]))
    with pytest.raises(
        InputError, match=r"quick: A model of the kind .* must be stable on other signals .* spans of y"
    ):
        fit(quick(), "prandtl_ishlinskii")


def test_a_model_that_leaves_the_range_on_another_signal_is_warned_of(monkeypatch):
    """A lag of 0.2 s and weight 20 passes 1 % of a cycle of 20 ms, and 40 % of a step of 100 ms."""
    built(monkeypatch, with_memory(T=0.2, w=20.0))
    (warned,) = fit(quick(), "prandtl_ishlinskii").fit["warnings"][:1]
    assert "on other signals within the trained range of u the output leaves the range of y by" in warned


def test_bounds_of_a_search_arrive_in_the_warnings():
    """A knee as sharp as n = 12, where the search ends at 1.2."""
    u = training(30, 1, 0.02)
    values = {"A": 1.0, "beta": 2.0, "gamma": 1.0, "n": 12.0, "alpha": 0.0, "k": 1.0}
    y = 0.4 * u + Graph.single(Node("z", "bouc_wen", {}, values)).run(u)[:, 1]
    warned = fit(Dataset.from_signal(u, y, 1e-3, "sharp"), "bouc_wen", starts=1, n_max=1.2, dead_band=0.0).fit[
        "warnings"
    ]
    assert any("n = 1.2 is a bound of the search" in w for w in warned)


# ---- memory ----------------------------------------------------------------------------------------------------------
told = pytest.mark.skipif(not hasattr(os, "sysconf"), reason="the system does not tell its memory")


def machine(monkeypatch: pytest.MonkeyPatch, megabytes: float) -> None:
    real = os.sysconf
    pages = int(megabytes * 2**20 / real("SC_PAGE_SIZE"))
    monkeypatch.setattr(os, "sysconf", lambda name: pages if name == "SC_PHYS_PAGES" else real(name))


@told
@pytest.mark.parametrize("words", ["--model prandtl_ishlinskii", "--model preisach", ""])
def test_a_fit_that_takes_too_much_is_refused(words, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    hy.synthetic.piezo(20, 500.0).to_csv("a.csv")
    machine(monkeypatch, 0.5)
    done = invoked(["fit", "a.csv", *words.split(), "-o", "m.toml"], status=2)
    line = done.stderr.splitlines()[-1]
    assert line.startswith("hystfmu: a.csv: A fit must take at most half of the memory, 0.000244 GiB. Got ")
    assert "resample the record to a lower rate (--resample HZ), or fit fewer rows." in line
    assert os.listdir() == ["a.csv"]


@told
def test_more_plays_take_more(monkeypatch):
    data = hy.synthetic.piezo(20, 500.0)
    machine(monkeypatch, 4e-3 * len(data.t))
    assert hy.fit(data, "prandtl_ishlinskii").key == "prandtl_ishlinskii"
    with pytest.raises(hy.InputError, match="at most half of the memory"):
        hy.fit(data, "prandtl_ishlinskii", N=400)


@told
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
