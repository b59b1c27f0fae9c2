"""Reports about the limits of a network: rows at which they act, coverage of the input space by the training rows."""

import json
import re

import numpy as np
import plants
import pytest
from click.testing import CliRunner
from invoked import invoked

from hystfmu import Dataset, Graph, Node, signals
from hystfmu.cli import main
from hystfmu.identify import fit
from hystfmu.identify.excitation import minor_loops, not_shown
from hystfmu.model import accuracy
from hystfmu.model.coverage import clamped, coverage

QUICK = {"iterations": 20, "starts": 1}


def data(u):
    return Dataset.from_signal(u, plants.prandtl_ishlinskii(u), 1e-3)


@pytest.fixture(scope="module")
def model():
    u = signals.training(40, 3)[::2]
    return fit(data(u), "play_bank_mlp", N=4, **QUICK)


def test_rows_outside_the_limits_are_counted(model):
    """The margin is 5 % of the range [-1, 1]; the plays of half-width r follow u within it, less r."""
    u = signals.ramps([0.0, 2.0, 0.0], 0.01)
    assert not clamped(model.graph, u[u <= 1.1], 1e-3)[:100].any()
    outside = clamped(model.graph, u, 1e-3)
    r = model.graph.node("bank").value("r")
    z = plants.plays(u, r)
    lo, hi = model.graph.node("features").value("lo"), model.graph.node("features").value("hi")
    features = np.column_stack([u, z])
    np.testing.assert_array_equal(outside, ((features < lo) | (features > hi)).any(axis=1))
    assert outside[np.argmax(u)]
    assert abs(hi[0] - 1.1) < 1e-9


def test_a_model_without_limits_cuts_nothing():
    u = signals.training(40, 3)[::2]
    m = fit(data(u), "prandtl_ishlinskii")
    assert not clamped(m.graph, 100 * u, 1e-3).any()
    assert coverage(m.graph, data(u)) is None
    assert "coverage_percent" not in m.fit


@pytest.mark.turn("records of a fit")
def test_coverage_tells_what_a_record_leaves_out():
    def covered(u, key, **options):
        return fit(data(u), key, hidden=3, **options, **QUICK).fit["coverage_percent"]

    sine, nested = signals.decaying_sine(10, 0.1), signals.training(200, 5)
    assert covered(sine, "zhao_tan_mlp", range=2.0) == 100
    assert covered(sine, "play_bank_mlp") < covered(nested, "play_bank_mlp") - 20


def test_coverage_of_a_signal_whose_rows_can_be_counted():
    """One limited signal, the input itself, from 0 to 1, not between 0.3 and 0.7: covered are all but 0.4..0.6."""
    low, high = np.linspace(0, 0.3, 400), np.linspace(0.7, 1, 400)
    u = np.concatenate([low, high])
    graph = Graph.single(Node("s", "scaling", {"n": 1}, {"lo": 0.0, "hi": 1.0}))
    assert coverage(graph, Dataset.from_signal(np.linspace(0, 1, 500), np.zeros(500))) == 100
    v = 0.5 + 0.5 * signals.training(200, 4242, np.sqrt(np.mean(np.diff(u) ** 2)) / 0.5)
    left = np.mean((v > 0.4) & (v < 0.6))
    assert abs(coverage(graph, Dataset.from_signal(u, u)) - 100 * (1 - left)) < 2


def test_held_out_tables_say_it(model):
    table = accuracy.held_out_table(
        model,
        plants.prandtl_ishlinskii,
        1.0,
        {"inside": signals.decaying_sine(3, 0.3), "outside": 2 * signals.ramps([0.0, 1.0])},
    )
    assert table["inside"]["clamped_percent"] == 0
    assert 40 < table["outside"]["clamped_percent"] < 50  # of 0..2, what is above 1.1


@pytest.mark.turn("records of a fit")
def test_fit_and_predict_print_it(tmp_path):
    u = signals.training(12, 3)[::2]
    data(u).to_csv(tmp_path / "a.csv")
    Dataset.from_signal(1.5 * u, u, 1e-3).to_csv(tmp_path / "b.csv")
    a, b, out = str(tmp_path / "a.csv"), str(tmp_path / "b.csv"), str(tmp_path / "m.model.toml")
    command = ["fit", a, "--model", "zhao_tan_mlp", "-o", out, "--set", "iterations=5", "--set", "starts=1"]
    done = invoked(command)
    assert "coverage %" in done.output
    inside = CliRunner().invoke(main, ["predict", out, a, "-o", str(tmp_path / "p.csv"), "--json"])
    assert (inside.stderr, json.loads(inside.stdout)["clamped_percent"]) == ("", 0.0)
    outside = CliRunner().invoke(main, ["predict", out, b, "-o", str(tmp_path / "q.csv"), "--json"])
    share = json.loads(outside.stdout)["clamped_percent"]
    assert 5 < share < 60
    assert re.match(
        rf"warning: {re.escape(str(b))}: line \d+ and {share:.3g} % of all rows lie outside", outside.stderr
    )
    assert outside.stderr.count("\n") == 1


# ---- signals that a record does not show -----------------------------------------------------------------------------
def test_the_share_of_states_that_a_record_has_not():
    u = np.sin(2 * np.pi * np.arange(600) / 150) * np.linspace(0.4, 1.0, 600)
    record = data(np.r_[u, 3.0]).with_train((20, 580))
    span = np.ptp(u[20:580])

    def states(v):
        z, r, found = np.full(2, v[0]), span / 2 * np.array([1, 2]) / 3, []
        for x in v:
            z = np.clip(z, x - r, x + r)
            found.append([x, *z])
        return np.array(found) / (span * np.sqrt(3))

    for asked, first in ((0.5 * np.roll(u, 40), 0), (1.05 * u, 30), (np.full(9, 1.1), 0), (u[30:], 10)):
        apart = np.linalg.norm(states(asked)[first:, None] - states(record.u)[None, 20:580], axis=2).min(axis=1)
        assert not_shown.new_states(record, asked, first) == np.mean(apart > 0.05)


def test_kinds_of_signals_that_a_record_does_not_show():
    every = ("decaying oscillations", "sums of tones", "nested reversals", "minor loops at several levels")
    assert not_shown.kinds_not_shown(data(np.sin(2 * np.pi * np.arange(600) / 150))) == every
    rich = data(5 + 3 * np.concatenate([signals.training(200, 4), signals.minor_loops(9, 0.2)]))
    assert not_shown.kinds_not_shown(rich) == ()


def test_a_record_of_one_speed_or_of_one_frequency():
    t = np.arange(1200)
    decay = np.exp(-t / 300) * np.sin(2 * np.pi * t / 100)
    chirp = np.sin(2 * np.pi * np.cumsum(np.linspace(0.002, 0.02, 1200)))
    ramps = signals.ramps([0, 1, -0.5, 0.8, -1, 0.2, -0.1, 1], 0.02)
    for u, one in ((decay, True), (ramps, True), (np.linspace(0.2, 1, 1200) * chirp, False), (chirp, False)):
        assert not_shown.one_speed(data(u)) is one
    records = [np.sin(2 * np.pi * t / period) for period in (400, 100, 25)]  # each of one frequency
    for parts, one in ((records, False), (records[:2], False), (records[1:2] * 2, True)):
        several = Dataset(
            np.arange(1200 * len(parts)), *[np.concatenate(parts)] * 2, starts=range(0, 1200 * len(parts), 1200)
        )
        assert not_shown.one_speed(several) is one
        assert minor_loops.several_speeds(several.u, several.records, several.train) is not one
