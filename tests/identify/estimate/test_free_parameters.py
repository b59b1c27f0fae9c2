"""Graphs with free parameters: names, bounds, ties, start states, refusals; drawn devices; files and the command."""

from pathlib import Path

import numpy as np
import pytest
from invoked import invoked
from numpy_devices import H, bouc_wen, g0, multisine, noisy, plays, second_order, within
from series import series

import hystfmu as hy

R = [0.1, 0.3, 0.6]
W = [0.5, 0.3, 0.2]


def bank(**values):
    return hy.Node("plays", "backlash_sum", {}, {"r": R, "w": [0.1, 0.1, 0.1], "z0": np.zeros(3), **values})


def record(seed=0, first=(0.0, 0.0, 0.0), rows=800, share=1e-3):
    rng = np.random.default_rng(seed)
    t, u = multisine(rng, rows, 12.0)
    return hy.Dataset(t, u, noisy(rng, 2 * plays(u, R, W, 0.7, first) + 1, share))


def graph(gain=1.0, **values):
    return series(bank(**values), hy.Node("out", "scaling", {}, {"gain": [gain]}))


LINEAR = {"plays.w0": True, "plays.w": True, "out.offset": True}


def test_what_is_linear_needs_no_search_and_no_start():
    model = hy.fit(record(), graph(), free=LINEAR, starts=1)
    found = model.fit["free"]
    assert [found[f"plays.w[{k}]"]["value"] for k in (1, 2, 3)] == pytest.approx([1.0, 0.6, 0.4], abs=0.02)
    far = hy.fit(record(), graph(w=[1e3, -1e3, 5.0]), free=LINEAR, starts=1)
    assert far.graph.run(record().u) == pytest.approx(model.graph.run(record().u), abs=1e-9)


def test_a_lower_bound_of_0_keeps_weights_from_below():
    rng = np.random.default_rng(1)
    t, u = multisine(rng, 800, 12.0)
    data = hy.Dataset(t, u, noisy(rng, plays(u, R, [0.5, -0.2, 0.4], 1.0, np.zeros(3))))
    bound = hy.fit(data, graph(), free={**LINEAR, "plays.w": (0.0, np.inf)}).fit["free"]
    assert bound["plays.w[2]"] == {"value": 0.0, "known": "at a bound"}
    assert hy.fit(data, graph(), free=LINEAR).fit["free"]["plays.w[2]"]["value"] == pytest.approx(-0.2, abs=0.02)


def test_one_element_is_free_and_the_others_hold():
    model = hy.fit(record(), graph(2.0, w=[0.5, 0.3, 0.9], w0=0.7), free={"plays.w[3]": True, "out.offset": True})
    assert model.graph.node("plays").value("w").tolist() == [0.5, 0.3, pytest.approx(0.2, abs=0.01)]
    assert set(model.fit["free"]) == {"plays.w[3]", "out.offset"}


def test_thresholds_that_rise_and_weights_with_a_sum():
    start = graph(2.0, r=[0.2, 0.4, 0.5], w=[0.3, 0.3, 0.4], w0=0.7)
    free = {"plays.r": {"lower": 0.0, "upper": 1.0, "rising": True}, "plays.w": {"sum": 1.0}, "out.offset": True}
    model = hy.fit(record(), start, free=free)
    r, w = (model.graph.node("plays").value(k) for k in "rw")
    assert r == pytest.approx(R, abs=0.01)
    assert w == pytest.approx(W, abs=0.02)
    assert w.sum() == pytest.approx(1.0, abs=1e-12)
    assert all(of["standard_error"] < 0.01 for of in model.fit["free"].values())


def test_memory_before_row_0_is_found_where_it_is_free():
    u = np.concatenate([np.linspace(0, 1, 400), np.linspace(1, 0, 400)])  # the third play moves from 0.9 on
    data = hy.Dataset(H * np.arange(800), u, 2 * plays(u, R, W, 0.7, (0.0, 0.1, 0.3)) + 1)
    start = graph(2.0, w=W, w0=0.7, z0=[0.0, 0.1, 0.0])
    model = hy.fit(data, start, free={"plays.z0[3]": (-0.5, 0.5), "out.offset": True}, starts=3)
    assert model.graph.node("plays").value("z0")[2] == pytest.approx(0.3, abs=1e-6)
    assert start.node("plays").value("z0")[2] == 0.0  # the graph that was given is as it was


def test_every_record_starts_afresh():
    parts = [record(seed, rows=400) for seed in (1, 2, 3)]
    model = hy.fit(hy.Dataset.joined(parts), graph(), free=LINEAR)
    assert model.fit["rms_percent"] < 0.11
    assert model.fit["free"]["plays.w0"]["value"] == pytest.approx(1.4, abs=0.01)


def test_a_covariate_drives_an_input_of_its_name():
    plain = record()
    load = np.sin(np.arange(800) / 50)
    data = hy.Dataset(plain.t, plain.u, plain.y + 0.3 * load, covariates={"load [N]": load})
    nodes = [bank(), hy.Node("mix", "sum", {"n": 2})]
    made = hy.Graph(
        nodes,
        [("plays.y", "mix.u[1]")],
        [hy.Input("u", ("plays.u",)), hy.Input("load", ("mix.u[2]",))],
        [hy.Output("y", "mix.y")],
    )
    model = hy.fit(data, made, free={"plays.w0": True, "plays.w": True, "mix.k[2]": True, "mix.offset": True})
    assert model.fit["free"]["mix.k[2]"]["value"] == pytest.approx(0.3, abs=0.01)
    with pytest.raises(hy.InputError, match=r"an input for each covariate of the data\. Got no 'load'"):
        hy.fit(data, graph(), free=LINEAR)


def test_what_the_record_does_not_tell_apart_is_warned_of():
    model = hy.fit(record(), graph(), free={**LINEAR, "out.gain": True}, starts=1)
    assert any("only together" in w and "out.gain" in w for w in model.fit["warnings"])
    assert model.fit["free"]["plays.w0"] == {
        "value": pytest.approx(model.fit["free"]["plays.w0"]["value"]),
        "known": "no",
    }
    wide = graph(r=[0.1, 0.3, 5.0])  # wider than the record: it never moves
    model = hy.fit(record(), wide, free={"plays.r[3]": (4.0, 6.0), "out.offset": True}, starts=1)
    assert any("does not determine plays.r[3]" in w for w in model.fit["warnings"])


@pytest.mark.parametrize(("free", "wrong"), [
    ({}, "must be at least one"),
    ({"play.w": True}, "with a node of plays, out. Got 'play.w' instead. Did you mean"),
    ({"plays.weight": True}, "must be one of w0, r, w, z0. Got 'weight' instead"),
    ({"plays.n": True}, "must not be a size. Got 'plays.n'"),
    ({"plays.w[4]": True}, r"must be in 1\.\.3. Got 4 instead"),
    ({"plays.w": True, "plays.w[1]": True}, "must be named once"),
    ({"plays.w": (0.2, 1.0)}, r"must contain its value in the graph, 0.1. Got 0.2 to 1"),
    ({"plays.w": (1.0, 1.0)}, "must be below the upper bound. Got 1 and 1"),
    ({"plays.w": False}, "must be true, .lower, upper. or a table. Got False"),
    ({"plays.w": {"least": 0.0}}, "must be one of lower, upper, scale, rising, sum. Got 'least'"),
    ({"plays.w": {"scale": "sqrt"}}, "must be 'linear' or 'log'. Got 'sqrt'"),
    ({"plays.w": {"lower": "0"}}, "must be a number. Got '0'"),
    ({"plays.z0": {"scale": "log"}}, "must be positive for the scale 'log'. Got 0"),
    ({"plays.w": {"sum": 1.0}}, "with the sum 1. Got 0.3"),
])  # fmt: skip
def test_what_is_refused(free, wrong):
    with pytest.raises(hy.InputError, match=wrong) as e:
        hy.fit(record(), graph(), free=free)
    assert "\n" not in str(e.value)


def test_what_else_is_refused():
    data = record()
    with pytest.raises(hy.InputError, match="free parameters of a graph must be named"):
        hy.fit(data, graph())
    with pytest.raises(hy.InputError, match=r"must be those of a graph\. Got the kind 'preisach'"):
        hy.fit(data, "preisach", free=LINEAR)
    made = series(bank(), hy.Node("g0", "transfer_function"))
    with pytest.raises(hy.InputError, match=r"Got 'g0\.hold', which is a choice of zoh, foh"):
        hy.fit(data, made, free={"g0.hold": True})
    with pytest.raises(hy.InputError, match=r"must have one input and an output\. Got sum"):
        hy.fit(data, hy.blocks.Sum())
    with pytest.raises(hy.InputError, match="u of the training rows must vary"):
        hy.fit(hy.Dataset(data.t, np.ones(800), data.y), graph(), free=LINEAR)
    with pytest.raises(hy.InputError, match="option of a graph must be one of: starts"):
        hy.fit(data, graph(), free=LINEAR, N=4)


@pytest.mark.turn("free parameters")
def test_the_same_seed_gives_the_same_model_and_time_ends_a_search():
    free = {**LINEAR, "plays.r": {"lower": 0.0, "upper": 1.0}}
    a, b = (hy.fit(record(), graph(), free=free, seed=4).graph.run(record().u) for _ in range(2))
    assert (a == b).all()
    model = hy.fit(record(rows=4000), graph(), free=free, starts=1000, seconds=0.02)
    assert any("limit of 0.02 s" in w for w in model.fit["warnings"])


def test_a_fitted_graph_is_a_model_like_any_other(tmp_path):
    node = hy.Node("plays", "prandtl_ishlinskii", {}, {"r": R, "w0": 1.0})
    made = series(node, hy.Node("out", "scaling"))
    model = hy.fit(record(), made, free={"plays.w0": (0.0, np.inf), "plays.w": (0.0, np.inf), "out.offset": True})
    model.save(tmp_path / "a.model.toml")
    again = hy.Model.load(tmp_path / "a.model.toml")
    assert again.fit["free"] == model.fit["free"]
    assert "free parameter" in str(again)
    assert "plays.w[2]" in str(again)
    u = record(7).u
    assert (again.predict(u) == model.predict(u)).all()
    assert model.predict(model.inverse().predict(model.predict(u))) == pytest.approx(model.predict(u), abs=1e-9)
    assert model.export(tmp_path / "a.fmu").exists()
    assert model.export_modelica(tmp_path / "Mine").exists()
    assert "free parameter" in model.report(record(), tmp_path / "a.html").read_text()


# ---- drawn devices ---------------------------------------------------------------------------------------------------
WIDTHS = [0.1, 0.25, 0.5, 0.8]


def sums(u0=0.0, **values):
    return hy.Node("plays", "backlash_sum", {}, {"r": WIDTHS, "z0": np.full(4, u0), **values})


@pytest.mark.some(1)
@pytest.mark.parametrize("seed", [0, 1])
def test_plays_and_a_mode(seed):
    rng = np.random.default_rng(seed)
    t, u = multisine(rng, 2000)
    w, f_n, zeta = rng.uniform(0.1, 1, 5), rng.uniform(50, 150), rng.uniform(0.05, 0.5)
    y = noisy(rng, second_order(plays(u, WIDTHS, w[1:], w[0], np.zeros(4)), f_n, zeta) + 0.4)
    graph = series(sums(), g0(90.0, 0.2), hy.Node("out", "scaling"))
    weights = {"plays.w0": (0.0, np.inf), "plays.w": (0.0, np.inf)}
    data = hy.Dataset(t, u, y, unit_u="V", unit_y="um")
    model = hy.fit(data, graph, free={**weights, "g0.a[2]": True, "g0.a[3]": True, "out.offset": True}, starts=2)
    omega, first = 2 * np.pi * f_n, 2 * np.pi * 90.0
    share = omega**2 / first**2  # b holds: the static gain is in the weights
    true = {"plays.w0": share * w[0], **{f"plays.w[{k}]": share * w[k] for k in range(1, 5)}}
    within(model, {**true, "g0.a[2]": 2 * zeta * omega, "g0.a[3]": omega**2, "out.offset": 0.4})
    assert model.fit["rms_percent"] == pytest.approx(0.1, rel=0.1)
    assert model.key == "graph"
    assert (model.graph.inputs[0].unit, model.graph.outputs[0].unit, model.step) == ("V", "um", H)


@pytest.mark.turn("free parameters")
@pytest.mark.some(1)
@pytest.mark.parametrize("seed", [0, 1])
def test_bouc_wen_and_a_mode_from_a_multisine(seed):
    rng = np.random.default_rng(seed)
    t, u = multisine(rng, 2000)
    beta, gamma, n = rng.uniform(0.5, 3), rng.uniform(-0.3, 1.5), rng.uniform(1.2, 2.5)
    f_n, zeta, k = rng.uniform(50, 150), rng.uniform(0.05, 0.5), rng.uniform(0.5, 3, 2)
    x = k[0] * u + k[1] * (bouc_wen(u, beta, gamma, n))
    y = noisy(rng, second_order(x, f_n, zeta) - 2.0)
    nodes = [
        hy.Node("h", "bouc_wen", {}, {"alpha": 0.0, "u0": u[0]}),
        hy.Node("mix", "sum", {"n": 2}),
        g0(90.0, 0.2),
        hy.Node("out", "scaling"),
    ]
    wires = [("h.z", "mix.u[2]"), ("mix.y", "g0.u"), ("g0.y", "out.u")]
    graph = hy.Graph(nodes, wires, [hy.Input("u", ("h.u", "mix.u[1]"))], [hy.Output("y", "out.y")])
    shape = {"h.beta": True, "h.gamma": True, "h.n": (1.0, 4.0)}
    free = {**shape, "g0.a[2]": True, "g0.a[3]": True, "mix.k": True, "out.offset": True}
    model = hy.fit(hy.Dataset(t, u, y), graph, free=free)
    omega, share = 2 * np.pi * f_n, f_n**2 / 90.0**2
    true = {"h.beta": beta, "h.gamma": gamma, "h.n": n, "g0.a[2]": 2 * zeta * omega, "g0.a[3]": omega**2}
    within(model, {**true, "mix.k[1]": share * k[0], "mix.k[2]": share * k[1], "out.offset": -2.0})
    assert model.fit["rms_percent"] == pytest.approx(0.1, rel=0.1)


@pytest.mark.turn("parameters of a kind")
def test_a_block_alone_has_no_name_of_a_node_and_reaches_the_noise():
    rng = np.random.default_rng(3)
    u = 40 + 30 * multisine(rng, 1500, 12.0)[1]
    x = (u - (u.max() + u.min()) / 2) / (np.ptp(u) / 2)
    y = noisy(rng, 3 * x + 2 * bouc_wen(x, 2.0, 0.8, 1.6) + 7)
    data = hy.Dataset(H * np.arange(1500), u, y)
    model = hy.fit(data, hy.blocks.BoucWen())
    assert model.fit["held"]  # gains that only repeat those of the readout
    within(model, {"bouc_wen.n": 1.6, "readout.offset": 7.0})
    assert model.fit["rms_percent"] == pytest.approx(0.1, rel=0.1)
    named = hy.fit(
        data, hy.blocks.BoucWen(alpha=0.0), free={"beta": True, "gamma": True, "n": (1.0, 4.0), "alpha": True}
    )
    assert "bouc_wen.alpha" in named.fit["free"]
    assert "bouc_wen.A" not in named.fit["free"]


@pytest.mark.stress
def test_standard_errors_hold_over_noise():
    """Nine of ten intervals of two standard errors at least hold what is true; 25 draws of noise, 6 parameters."""
    t, u = multisine(np.random.default_rng(8), 600, 12.0)
    clean = plays(u, [0.2, 0.5], [0.6, 0.3], 1.0, [0, 0]) + 0.5
    graph = series(
        hy.Node("p", "backlash_sum", {}, {"r": [0.1, 0.4], "z0": [0.0, 0.0]}), hy.Node("out", "scaling", {"n": 1})
    )
    true = {"p.w0": 1.0, "p.w[1]": 0.6, "p.w[2]": 0.3, "p.r[1]": 0.2, "p.r[2]": 0.5, "out.offset": 0.5}
    free = {"p.w0": True, "p.w": True, "p.r": {"upper": 1.0, "rising": True}, "out.offset": True}
    inside = []
    for seed in range(25):
        y = clean + 0.01 * np.ptp(clean) * np.random.default_rng(seed).normal(size=600)
        found = hy.fit(hy.Dataset(t, u, y), graph, free=free, starts=1).fit["free"]
        inside += [abs(found[k]["value"] - v) < 1.96 * found[k]["standard_error"] for k, v in true.items()]
    assert 0.9 <= np.mean(inside) <= 0.99


# ---- files -----------------------------------------------------------------------------------------------------------
GRAPH = """format = 1
wires = [["plays.y", "out.u"]]

[free]
"plays.w0" = [0.0, inf]
"plays.w" = true
"plays.r" = { lower = 0.01, upper = 1.0, rising = true }
"out.offset" = true

[[blocks]]
name = "out"
type = "scaling"

[[blocks]]
name = "plays"
type = "backlash_sum"
values = { r = [0.1, 0.4], z0 = [0.0, 0.0] }

[[inputs]]
name = "u"
to = ["plays.u"]

[[outputs]]
name = "y"
source = "out.y"
"""


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    u = np.sin(np.arange(600) / 20) * np.linspace(1, 0.2, 600)
    hy.Dataset(H * np.arange(600), u, 3 * plays(u, [0.2, 0.5], [0.5, 0.2], 1.0, [0, 0])).to_csv("d.csv")
    Path("my.graph.toml").write_text(GRAPH)
    return tmp_path


@pytest.mark.turn("free parameters")
def test_a_file_is_fitted_in_python_and_by_the_command(folder):
    model = hy.fit(hy.read("d.csv"), Path("my.graph.toml"), starts=3)
    assert model.graph.node("plays").value("r") == pytest.approx([0.2, 0.5], abs=1e-3)
    assert [n.name for n in model.graph.nodes] == ["plays", "out"]  # sorted
    told = invoked(["fit", "d.csv", "--graph", "my.graph.toml", "--set", "starts=3", "-o", "m.model.toml"])
    assert "plays.r[2]" in told.output
    assert "standard error" in told.output
    written = hy.Model.load("m.model.toml")
    assert (written.predict(hy.read("d.csv").u) == model.predict(hy.read("d.csv").u)).all()


@pytest.mark.some(0.5)
def test_a_model_file_with_a_table_of_free_parameters_is_fitted_again(folder):
    hy.fit(hy.read("d.csv"), Path("my.graph.toml"), starts=1).save("m.model.toml")
    text = Path("m.model.toml").read_text()
    Path("again.graph.toml").write_text(text + '\n[free]\n"out.offset" = true\n')
    again = hy.fit(hy.read("d.csv"), Path("again.graph.toml"))
    assert list(again.fit["free"]) == ["out.offset"]


@pytest.mark.parametrize(("old", "new", "wrong"), [
    ("format = 1\n", "", "format"),
    ('[free]\n"plays.w0" = [0.0, inf]\n', '[frees]\n"plays.w0" = [0.0, inf]\n', "frees"),
    ('"plays.w" = true', '"play.w" = true', "Did you mean"),
    ("backlash_sum", "backlash", "type of a block"),
])  # fmt: skip
def test_a_bad_file_ends_in_one_line(folder, old, new, wrong):
    Path("my.graph.toml").write_text(GRAPH.replace(old, new))
    with pytest.raises(hy.InputError, match=wrong) as e:
        hy.fit(hy.read("d.csv"), Path("my.graph.toml"))
    assert "\n" not in str(e.value)
    assert str(e.value).startswith("my.graph.toml: ")


def test_a_graph_and_a_kind_exclude_each_other(folder):
    told = invoked(["fit", "d.csv", "--graph", "my.graph.toml", "--model", "preisach"], status=2)
    assert "exclude each other" in told.output
    with pytest.raises(hy.InputError, match="must be those of the file"):
        hy.fit(hy.read("d.csv"), Path("my.graph.toml"), free={"out.offset": True})
