"""Graphs: order, wires, algebraic loops, dependencies, the block file."""

import numpy as np
import plants
import pytest
from scipy.signal import cont2discrete, lfilter

from hystfmu import Graph, Input, InputError, Model, Node, Output, Unit
from hystfmu.base.arrays import Array
from hystfmu.graph.recursion import Recursion, discretised, parallel_lags

PLAYS = {"r": [0.1, 0.2, 0.3], "w": [1.0, 2.0, 0.5], "w0": 0.7}


def chain(*order):
    nodes = {"a": Node("a", "backlash_sum", values=PLAYS), "b": Node("b", "prandtl_ishlinskii", values=PLAYS)}
    return Graph([nodes[k] for k in order], [("a.y", "b.u")], [Input("u", ("a.u",))], [Output("y", "b.y")])


def test_a_chain_is_evaluated_from_input_to_output_in_whatever_order_it_is_listed():
    u = np.random.default_rng(1).uniform(-1, 1, 500)
    r, w = np.array(PLAYS["r"]), np.array(PLAYS["w"])
    expected = u
    for _ in range(2):
        expected = 0.7 * expected + plants.plays(expected, r) @ w
    for order in ("ab", "ba"):
        assert np.abs(chain(*order).run(u) - expected).max() < 1e-13


def test_a_loop_of_blocks_with_feedthrough_is_refused_with_the_names_along_it():
    a, b = Node("first", "backlash_sum"), Node("second", "backlash_sum")
    with pytest.raises(InputError, match=r"algebraic loop: (first <- second <- first|second <- first <- second)"):
        Graph([a, b], [("first.y", "second.u"), ("second.y", "first.u")])


def test_the_core_refuses_an_algebraic_loop_by_itself(monkeypatch):
    a, b = Node("first", "backlash_sum"), Node("second", "backlash_sum")
    monkeypatch.setattr("hystfmu.graph.graph.evaluation_order", lambda nodes, links: [0, 1])
    with pytest.raises(InputError, match=r"algebraic loop: .*first.* <- .*second"):
        Graph([a, b], [("first.y", "second.u"), ("second.y", "first.u")]).executor()


def test_a_loop_with_a_delay_reads_the_held_value():
    # y_k = u_k + 0.5 y_{k-1}: a geometric series
    g = Graph(
        [Node("add", "sum", {"n": 2}, {"k": [1.0, 0.5]}), Node("z", "delay", {"n": 1})],
        [("add.y", "z.u"), ("z.y", "add.u[2]")],
        [Input("u", ("add.u[1]",))],
        [Output("y", "add.y")],
    )
    # the delay goes first: after its update with the held y_{k-1} it gives y_{k-2}; so y_k = 1 + 0.5 y_{k-2}
    y = g.run(np.ones(9))
    expected = [1.0, 1.0]
    for k in range(2, 9):
        expected.append(1 + 0.5 * expected[k - 2])
    assert y.tolist() == expected


@pytest.mark.parametrize(("wires", "message"), [
    ([("a.y", "c.u")], r"The block of a connection end must be one of \['a', 'b'\]. Got 'c.u' instead."),
    ([("a.q", "b.u")], r"The output of backlash_sum at a connection end must be one of \['y'\]. Got 'a.q' instead."),
    ([("a.y", "b.w")], r"The input of backlash_sum at a connection end must be one of \['u'\]. Got 'b.w' instead."),
    ([("a.y", "b.u"), ("a.y", "b.u")], "An input of 'b' must have one source. Got two connections."),
    ([("a.y[2]", "b.u")], r"must be in 1\.\.1. Got 2 instead."),
])  # fmt: skip
def test_bad_wires_are_refused(wires, message):
    with pytest.raises(InputError, match=message):
        Graph([Node("a", "backlash_sum"), Node("b", "backlash_sum")], wires)


@pytest.mark.parametrize(("dims", "values", "message"), [
    ({}, {"q": 1.0}, "A parameter of backlash_sum must be one of .*. Got 'q' instead."),
    ({"m": 3}, {}, r"A size of backlash_sum must be one of \['n'\]. Got 'm' instead."),
    ({"n": 0}, {}, "The 'n' size of b must be an int in .*. Got 0 instead."),
    ({"n": 3}, {"w": [1.0, 2.0]}, "must have 3 values. Got 2"),
    ({}, {"r": [-0.1]}, r"The 'r' parameter of b must be a float in \[0, inf\). Got -0.1 instead."),
    ({}, {"w0": float("nan")}, r"The 'w0' parameter of b must be a float in \(-inf, inf\). Got nan instead."),
    ({}, {"w0": "x"}, "must be a number. Got 'x'"),
])  # fmt: skip
def test_bad_values_are_refused(dims, values, message):
    with pytest.raises(InputError, match=message):
        Node("b", "backlash_sum", dims, values)


@pytest.mark.parametrize("name", ["", "Größe", "a\nb", "x" * 256])
def test_names_that_a_block_file_cannot_have_are_refused(name):
    ends = [Input(name, ("plays.u",))], [Output("y", "plays.y")]
    with pytest.raises(
        InputError, match=r"The name of a block or a port must have 1 to 255 printable ASCII characters"
    ):
        Graph([Node("plays", "backlash_sum")], (), *ends)
    Graph([Node("x" * 255, "backlash_sum")], (), [Input("a, b", ("x" * 255 + ".u",))])


def test_dependencies_follow_the_wires():
    g = Graph(
        [Node("a", "backlash_sum"), Node("b", "backlash_sum"), Node("z", "delay", {"n": 1})],
        [("a.y", "z.u")],
        [Input("u", ("a.u",)), Input("v", ("b.u",))],
        [Output("y", "a.y"), Output("q", "b.y"), Output("d", "z.y")],
    )
    assert g.dependencies() == {"y": ("u",), "q": ("v",), "d": ()}


def test_unit_refuses_what_an_fmu_refuses():
    unit = Unit(chain("a", "b"))
    with pytest.raises(InputError, match="before initialize"):
        unit.do_step(0.0, 1e-3)
    with pytest.raises(InputError, match=r"The start time must be finite\. Got nan instead\."):
        unit.initialize(float("nan"))
    unit.initialize(0.0, u=0.3)
    for h in (0.0, -1.0, float("nan"), float("inf")):
        with pytest.raises(InputError, match="finite and greater than 0"):
            unit.do_step(0.0, h)
    with pytest.raises(InputError, match=r"The variable must be one of .*\. Got 'x' instead."):
        unit.get("x")
    with pytest.raises(InputError, match="is an output"):
        unit.set("y", 1.0)
    with pytest.raises(InputError, match="fixed"):
        unit.set("b_w0", 1.0)
    with pytest.raises(InputError, match=r"Got nan instead\."):
        unit.set("u", float("nan"))


def test_a_step_that_differs_by_rounding_is_the_same_step():
    # a master that steps from t_k to t_{k+1} and passes the difference
    g = Graph.single(Node("g0", "transfer_function", values={"b": [1.0], "a": [1e-7, 4e-4, 1.0]}))
    even, jitter = Unit(g), Unit(g)
    t = 1e4 + 1e-4 * np.arange(300)
    assert len(set(np.diff(t))) > 1
    for unit in (even, jitter):
        unit.initialize(t[0])
        unit.set("u", 1.0)
    for k in range(len(t) - 1):
        even.do_step(t[k], t[1] - t[0])
        jitter.do_step(t[k], t[k + 1] - t[k])
        assert even.get("y") == jitter.get("y")


# ---- The recursion over many columns against the block in the executor, against scipy, and on picked rows
SEED = int(np.random.default_rng().integers(2**31))
H = 1e-3


@pytest.mark.parametrize("hold", ["foh", "zoh"])
@pytest.mark.parametrize("p", [1, 2, 7, 40])
def test_each_column_is_what_the_block_steps(hold: str, p: int) -> None:
    rng = np.random.default_rng(SEED)
    w, zeta = 2 * np.pi * rng.uniform(2, 400), rng.uniform(0.05, 2)
    a = np.polymul([1.0, 2 * zeta * w, w * w], [1.0, rng.uniform(5, 500)])
    node = Node("g", "transfer_function", {}, {"b": rng.normal(size=3), "a": a, "hold": hold, "start": "steady"})
    u = rng.normal(size=(300, p)).cumsum(axis=0)
    executor = Graph.single(node).executor()
    want = np.column_stack([executor.run(c[:, None], 1, H)[:, 0] for c in u.T])
    assert discretised(node, H).run(u) == pytest.approx(want, rel=1e-12, abs=1e-13 * np.abs(want).max()), SEED


@pytest.mark.parametrize("hold", ["foh", "zoh"])
def test_the_fraction_in_z_is_that_of_scipy(hold: str) -> None:
    rng = np.random.default_rng(SEED)
    w, zeta = 2 * np.pi * rng.uniform(20, 400), rng.uniform(0.05, 2)
    b, a = rng.normal(size=2), np.array([1.0, 2 * zeta * w, w * w])
    top, bottom = discretised(Node("g", "transfer_function", {}, {"b": b, "a": a, "hold": hold}), H).fraction()
    want, poles, _ = cont2discrete((b, a), H, hold)
    z = np.exp(1j * np.array([0.01, 0.3, 2.0]))
    early = z if hold == "zoh" else 1.0  # the block holds the new value, scipy the old one
    found = np.polyval(top, z) / np.polyval(bottom, z)
    assert found == pytest.approx(early * np.polyval(want[0], z) / np.polyval(poles, z), rel=1e-7), SEED


def test_lags_are_those_of_scipy_and_start_at_rest() -> None:
    rng = np.random.default_rng(SEED)
    shares, weights, u = rng.uniform(0.001, 0.9, 4), rng.uniform(0, 1, 4), rng.normal(size=(500, 3)) + 5
    lags: list[Array] = [lfilter([s], [1, s - 1], u - u[0], axis=0) + u[0] for s in shares]
    want = u + sum(k * q for k, q in zip(weights, lags, strict=True))
    assert parallel_lags(shares, weights).run(u) == pytest.approx(want, rel=1e-11), SEED
    assert parallel_lags(shares, weights, 0.0).run(u)[0] == pytest.approx(weights.sum() * u[0])


def test_picked_rows_are_those_of_the_whole_output() -> None:
    rng = np.random.default_rng(SEED)
    u = rng.normal(size=(200, 5))
    r = Recursion(0.3 * rng.normal(size=(3, 3)), *rng.normal(size=(4, 3)), d=0.7)
    rows = np.sort(rng.integers(0, 200, 60))  # with repetitions
    assert (r.run(u, rows) == r.run(u)[rows]).all(), SEED
    assert r.run(u, rows[:0]).shape == (0, 5)
    assert r.run(u[:, :0]).shape == (200, 0)
    assert (r.run(np.asfortranarray(u)) == r.run(u)).all()


def test_what_the_block_refuses_is_refused() -> None:
    fast = Node("g", "transfer_function", {}, {"b": [1.0], "a": [1e-30, 1.0]})
    with pytest.raises(InputError, match=r"g: The last coefficient of a must not be 0"):
        discretised(Node("g", "transfer_function", {}, {"b": [1.0], "a": [1.0, 0.0]}), H)
    with pytest.raises(InputError, match=r"g: the step is too long"):
        discretised(fast, H)


# ---- Model files: a round trip keeps every bit; errors are one line that names the file and the key
def model():
    rng = np.random.default_rng(0)
    node = Node(
        "pi", "prandtl_ishlinskii", {}, {"r": np.sort(rng.uniform(0, 1, 7)), "w": rng.normal(size=7), "w0": 1 / 3}
    )
    return Model("prandtl_ishlinskii", Graph.single(node), 1e-3, "text", {"rms": 0.1}, {"data": "x.csv"})


def test_round_trip_keeps_every_bit(tmp_path):
    first = model()
    first.save(tmp_path / "m.model.toml")
    second = Model.load(tmp_path / "m.model.toml")
    assert second.graph.to_bytes() == first.graph.to_bytes()
    assert (second.key, second.step, second.text, second.fit, second.provenance) == (
        first.key, first.step, first.text, first.fit, first.provenance,
    )  # fmt: skip
    assert not list(tmp_path.glob(".*")), "a temporary file was left"


def test_a_byte_order_mark_is_no_text(tmp_path):
    path = tmp_path / "m.model.toml"
    model().save(path)
    path.write_bytes(b"\xef\xbb\xbf" + path.read_bytes())
    assert Model.load(path).graph.to_bytes() == model().graph.to_bytes()


@pytest.mark.parametrize(("old", "new", "message"), [
    ("format = 1", "format = 9",
     "format: The format must be 1. Got 9 of a newer version .*: pip install --upgrade hystfmu"),
    ("format = 1", "format = 2\nkeys_to_come = 3", "format: The format must be 1. Got 2"),
    ("format = 1", "format = 0",
     "format: The format must be 1. Got 0 of an older version of HystFMU: create the file again"),
    ("format = 1\n", "", "format: The format must be 1. Got none, as in older versions of HystFMU: create the file"),
    ("format = 1", "format = 'x'", "format: The value must be 1. Got 'x' instead."),
    ('type = "prandtl_ishlinskii"', 'type = "preisach2"', "Got 'preisach2' instead"),
    ("w0 = 0.333", 'w0 = "a"\nw9 = 0.333', "A parameter of .* must be one of .*. Got 'w9' instead."),
    ("step = 0.001", "step = -1.0", "step: The value must be greater than 0. Got -1.0 instead."),
    ("step = 0.001", "step = 'x'", "step"),
    ("[provenance]", "[provenance", "must be valid TOML"),
    ("wires = []", 'wires = [["a", "b", "c"]]', "wires"),
])  # fmt: skip
def test_what_is_wrong_is_named(tmp_path, old, new, message):
    path = tmp_path / "m.model.toml"
    model().save(path)
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new))
    with pytest.raises(InputError, match=message) as e:
        Model.load(path)
    assert str(path) in str(e.value)
    assert "\n" not in str(e.value)


def test_a_missing_file_is_one_line(tmp_path):
    with pytest.raises(InputError, match="No such file"):
        Model.load(tmp_path / "none.model.toml")


def test_nothing_is_written_where_it_cannot_be(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match="cannot be written"):
        model().save(tmp_path / "file" / "m.model.toml")
