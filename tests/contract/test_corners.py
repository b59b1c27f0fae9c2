"""Corner cases of the blocks and of the reader that ordinary runs miss, each against its closed form or rule.

MC/DC listed their conditions as not covered (tests/stress)."""

import ctypes as C
import locale
import math
import os
import shutil
import struct
import subprocess
from pathlib import Path

import numpy as np
import pytest
from block_files import input_between_outputs, patched, raw_bytes
from raw import Raw, function

from hystfmu import Graph, Input, InputError, Node, Output, Unit
from hystfmu.core.executor import ContinuousExecutor, Executor
from hystfmu.core.library import RawVar, library


def wrong(block: str, h: float = 0.0, dims: dict[str, int] | None = None, **values: object) -> str | None:
    """What prepare() of the block says about these parameters."""
    return Raw(Node("b", block, dims or {}, values)).prepare(h)


# ---- values against their rows --------------------------------------------------------------------------------------
@pytest.mark.parametrize(("kind", "good", "bad"), [
    ("real", [0.0, 0.5, -1e300], [np.nan, np.inf, -np.inf]),
    ("int", [2147483647.0, -2147483648.0, 0.0], [2147483648.0, -2147483649.0, 0.5, np.nan]),
    ("bool", [0.0, 1.0], [-1.0, 2.0, 0.5, np.inf]),
    ("zoh|foh|none", [0.0, 1.0, 2.0], [-1.0, 3.0, 1.5]),
])  # fmt: skip
def test_a_value_is_checked_by_its_type(kind: str, good: list[float], bad: list[float]) -> None:
    row = RawVar(name=b"v", type=kind.encode(), lo=-np.inf, hi=np.inf)
    check = function("hyst_check", C.POINTER(RawVar), C.c_double)
    assert [check(row, v) for v in good] == [0] * len(good)
    assert all(check(row, v) for v in bad)


def test_messages_name_the_kind_of_value(tmp_path: Path) -> None:
    row = RawVar(name=b"flag", type=b"bool", hi=1.0)
    with pytest.raises(InputError) as e:
        Executor(patched(Graph.single(Node("c", "creep")).to_bytes(), 60, struct.pack("<d", np.inf)))
    assert "step" in str(e.value)
    text = C.create_string_buffer(100)
    library().hyst_interval(row, text, 100)
    assert text.value == b"a bool (0 or 1)"


@pytest.mark.turn("a decimal comma")
def test_messages_keep_the_point_in_a_locale_with_a_comma(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    if not shutil.which("localedef"):
        pytest.skip("no localedef")
    made = tmp_path / "de_DE.UTF-8"
    subprocess.run(["localedef", "-i", "de_DE", "-f", "UTF-8", str(made)], capture_output=True, timeout=60)
    if not made.is_dir():
        pytest.skip("localedef knows no de_DE")
    monkeypatch.setitem(os.environ, "LOCPATH", str(tmp_path))
    before = locale.setlocale(locale.LC_NUMERIC)
    number = function("hyst_number", C.c_char_p, C.c_size_t, C.c_double, result=C.c_char_p)
    try:
        locale.setlocale(locale.LC_NUMERIC, "de_DE.UTF-8")
        assert locale.localeconv()["decimal_point"] == ","
        assert number(C.create_string_buffer(32), 32, 0.5) == b"0.5"
    finally:
        locale.setlocale(locale.LC_NUMERIC, before)


def test_a_long_name_is_cut_in_the_message() -> None:
    with pytest.raises(InputError, match=r"at a{63}: gain must not be 0"):
        Executor(raw_bytes(Node("a" * 200, "feedforward", {}, {"gain": 0.0})))


# ---- parameters that do not fit together ----------------------------------------------------------------------------
def test_parameters_that_do_not_fit_together() -> None:
    assert "beta + gamma" in (wrong("bouc_wen", gamma=-1.0) or "")  # below 0
    assert "beta + gamma" in (wrong("bouc_wen", gamma=-0.5) or "")  # 0
    assert "T_p is too small" in (wrong("lead_lag", T_z=1e300, T_p=1e-300) or "")
    assert "gain" in (wrong("disturbance_observer", gain=0.0) or "")
    # rates that no matrix of doubles holds; poles that the sampled plant does not let move
    for values in ({"zeta": 1e308}, {"f_n": 1e5}, {"f_n": 1e-150}):
        assert "the step is too long" in (wrong("disturbance_observer", h=1.0, **values) or "")
    inverse = Raw(Node("b", "prandtl_ishlinskii_inverse"))
    inverse.p[inverse.places["w0"]] = 0.0  # the table excludes this value; prepare() checks it all the same
    assert "no continuous inverse exists" in (inverse.prepare(0.0) or "")
    first = {"na": 1, "nb": 0}
    for a in ([1.0, 1.7e308], [1.0, 5e307]):  # time constants that no double can scale
        assert "differ too much" in (wrong("transfer_function", dims=first, a=a, b=[1.0]) or "")
    assert wrong("transfer_function", dims=first, a=[1.0, 2e307], b=[1.0]) is None
    assert "differ too much" in (wrong("transfer_function", dims=first, a=[1e-300, 1e-300], b=[1e300]) or "")


# ---- blocks ---------------------------------------------------------------------------------------------------------
def test_bouc_wen_follows_a_bound_that_shrinks() -> None:
    unit = Unit(Graph.single(Node("b", "bouc_wen", {}, {"alpha": 0.0})))
    unit.initialize(0.0, u=0.0)
    for k in range(40):
        unit.set("u", 0.5 * (k + 1))
        unit.do_step(k * 0.1, 0.1)
    assert unit.get("z") == pytest.approx(1.0, abs=1e-6)  # (A / (beta + gamma))^(1/n)
    unit.set("gamma", 3.5)
    unit.do_step(4.0, 0.1)  # the input stands
    saved = unit.state
    unit.set("u", 20.5)
    unit.do_step(4.1, 0.1)
    assert unit.get("z") == pytest.approx(0.25, abs=1e-12)
    unit.state = saved
    unit.set("u", 20.0 - 1e-6)  # back: it leaves the new bound, not the old one
    unit.do_step(4.1, 0.1)
    assert unit.get("z") == pytest.approx(0.25, abs=1e-5)


def test_bouc_wen_at_its_bound_stays_there_without_beta() -> None:
    """beta = 0: z' = (A - gamma |z|^n) u' is 0 at the bound, whichever way the input goes."""
    for n in (2.0, 1.0):
        raw = Raw(Node("b", "bouc_wen", {}, {"beta": 0.0, "gamma": 1.0, "n": n, "z0": 1.0, "alpha": 0.0}))
        assert [row[0] for row in raw.run(np.array([[0.0], [-0.25], [-4.0], [3.0]]), 0.1)] == [1.0] * 4


def test_constraint_factor_inverse_on_a_branch_that_is_nearly_level() -> None:
    """The polynomial has the slope (1 - d^2/900)^8: around d = 30 rounding hides where the branch goes, Newton's steps
    lead anywhere, and the bracket has to close."""
    a = [math.comb(8, j) * (-1 / 900) ** j / (2 * j + 1) for j in range(9)]
    raw = Raw(Node("b", "constraint_factor_inverse", {"m": 9}, {"a0": 0.0, "a": a, "d_max": 35.0}))
    assert raw.prepare(0.0) is None

    def branch(d: float) -> float:
        return float(-np.expm1(-d) * d * np.polynomial.Polynomial(a)(d * d))

    for d in np.linspace(28.0, 32.0, 81):
        raw.init()
        raw.set_inputs(np.array([0.5 * branch(d)]), 0.0)  # virgin: x = g^-1(2 h) / 2
        assert branch(2 * raw.output()[0]) == pytest.approx(branch(d), rel=1e-12)


def test_duhem_whose_step_to_zero_is_longer_than_the_step() -> None:
    """dw/du = 1 + 0.9 w from -1: the step of 2.8 leads over 0, that in w says 3.04 to get there; the former stays."""
    values = {"a_rise": [1.0], "b_rise": [0.9], "c_rise": [0.0], "k": 0.0, "du_max": 4.0, "w0": -1.0, "w_max": 2.0}
    raw = Raw(Node("b", "duhem", {"m": 0, "q": 1}, values))
    raw.prepare(0.0), raw.init()
    raw.set_inputs(np.array([2.8]), 0.0)
    z = 0.9 * 2.8
    assert raw.output() == pytest.approx([(1 + z + z**2 / 2 + z**3 / 6 + z**4 / 24) / 9 - 10 / 9], rel=1e-14)
    assert raw.tangent(np.array([1.0]), np.zeros(0))[0] == pytest.approx(
        [0.1 * (1 + z + z**2 / 2 + z**3 / 6)], rel=1e-14
    )


def test_narx_with_feed_through_and_no_auxiliary_function() -> None:
    """y_k = theta_1 u_k + theta_2 y_(k-1) + theta_3 u_k^2 + theta_4 u_k y_(k-1) + theta_5 y_(k-1)^2 + theta_6."""
    theta = np.array([0.5, 0.25, -0.75, 0.125, 0.5, 1.0])
    dims = {"n_u": 1, "n_f": 0, "n_y": 1, "q": 2, "n_k": 0}
    raw = Raw(Node("b", "polynomial_narx", dims, {"theta": theta, "y0": 0.5}))
    raw.prepare(0.0), raw.init()
    raw.set_inputs(np.array([0.75, 9.0]), 0.0)
    raw.update(0.0)
    u, y = 0.75, 0.5
    assert raw.output() == pytest.approx([theta @ [u, y, u * u, u * y, y * y, 1.0]], abs=1e-15)
    for s_u, s_f in ((1.0, 0.0), (0.0, 1.0), (-2.0, 3.0)):
        slope = (theta[0] + 2 * theta[2] * u + theta[3] * y) * s_u  # the second input is not read
        assert raw.tangent(np.array([s_u, s_f]), np.zeros(0))[0] == pytest.approx([slope], abs=1e-15)


def test_a_trial_on_the_virgin_curve_of_the_other_side() -> None:
    """After 0 -> 1 the input -1 closes the outermost loop: by Masing's rule both branches have one slope there."""
    raw = Raw(Node("b", "zhao_tan"))
    raw.run(np.array([[0.0], [1.0]]), 0.1)
    raw.set_inputs(np.array([-1.0]), 0.0)
    slope = 1 - np.exp(-2.0) + 2 * np.exp(-2.0)  # g'(2), g(d) = (1 - e^-d) d
    for seed in (1.0, -1.0):
        assert raw.tangent(np.array([seed]), np.zeros(0))[0] == pytest.approx([slope * seed], rel=1e-14)


def test_oscillator_at_rest_has_the_tangent_of_its_springs() -> None:
    raw = Raw(Node("b", "bouc_wen_oscillator"))
    raw.prepare(0.0), raw.init()
    raw.set_inputs(np.zeros(1), 0.0)
    for s_v in (2.0, -3.0):  # beta and gamma vanish with z: dz/dt = alpha v
        _, ddx = raw.tangent(np.array([0.0]), np.array([0.0, s_v, 0.0]))
        assert ddx == pytest.approx([s_v, -10.0 * s_v / 2.0, 5e4 * s_v])


def test_dead_zone_on_its_corner_has_two_slopes() -> None:
    raw = Raw(Node("b", "dead_zones", {"n": 2}, {"w0": 1.0, "r": [0.5, -0.25], "w": [4.0, 7.0]}))
    for u, seed, slope in ((0.5, 1.0, 5.0), (0.5, -1.0, 1.0), (-0.25, -1.0, 8.0), (-0.25, 1.0, 1.0)):
        raw.set_inputs(np.array([u]), 0.0)
        assert raw.tangent(np.array([seed]), np.zeros(0))[0] == pytest.approx([slope * seed])


@pytest.mark.parametrize("activation", ["sigmoid", "tanh", "relu"])
def test_network_wider_than_one_pass(activation: str) -> None:
    rng = np.random.default_rng(1)
    W1, b1, W2, b2 = rng.normal(size=(301, 2)), rng.normal(size=301), rng.normal(size=(3, 301)), rng.normal(size=3)
    dims = {"n_in": 2, "n_hidden": 301, "n_out": 3}
    values = {"W1": W1.ravel(), "b1": b1, "W2": W2.ravel(), "b2": b2, "activation": activation}
    raw, u = Raw(Node("b", "mlp", dims, values)), np.array([0.3, -0.8])
    raw.set_inputs(u, 0.0)
    f = {"sigmoid": lambda a: 1 / (1 + np.exp(-a)), "tanh": np.tanh, "relu": lambda a: np.maximum(a, 0)}[activation]
    assert raw.output() == pytest.approx(b2 + W2 @ f(b1 + W1 @ u), rel=1e-12)


def test_relu_on_its_corner_has_two_slopes() -> None:
    raw = Raw(Node("b", "mlp", {"n_hidden": 1}, {"W1": [2.0], "W2": [3.0], "activation": "relu"}))
    raw.set_inputs(np.zeros(1), 0.0)
    for seed, slope in ((1.0, 6.0), (-1.0, 0.0)):
        assert raw.tangent(np.array([seed]), np.zeros(0))[0] == pytest.approx([slope * seed])


def test_noise_stops_counting_where_doubles_do() -> None:
    raw = Raw(Node("b", "noise"))
    raw.prepare(0.1), raw.init()
    for start, after in ((2.0**52 - 1, 2.0**52), (2.0**52, 2.0**52)):
        raw.x[:] = start
        raw.update(0.1)
        assert raw.x[0] == after
        assert np.isfinite(raw.output()).all()


@pytest.mark.parametrize("count", [-1.0, np.nan, 1e300, 0.5])
def test_an_impossible_count_is_harmless(count: float) -> None:
    for name in ("noise", "zhao_tan"):
        raw = Raw(Node("b", name))
        raw.prepare(0.1), raw.init()
        raw.x[0] = count
        raw.set_inputs(np.full(len(raw.u), 0.5), 0.0)
        raw.update(0.1)
        assert np.isfinite(raw.output()).all()
        raw.check_guards()


def test_differentiator_before_its_first_step_has_no_slope() -> None:
    raw = Raw(Node("b", "differentiator"))
    raw.prepare(0.0), raw.init()
    assert raw.tangent(np.array([1.0]), np.zeros(0))[0].tolist() == [0.0]


def test_last_extremum_has_the_slope_of_its_branch() -> None:
    """g(d) = (1 - e^-d) d from the origin and from the last reversal."""

    def slope(d: float) -> float:
        return 1 - np.exp(-d) + d * np.exp(-d)

    raw = Raw(Node("b", "zhao_tan", {}, {"memory": "last"}))
    raw.run(np.array([[0.0], [0.4]]), 0.1)
    assert raw.tangent(np.array([0.0]), np.zeros(0))[0].tolist() == [0.0]
    assert raw.tangent(np.array([1.0]), np.zeros(0))[0] == pytest.approx([slope(0.4)])
    raw.run(np.array([[0.0], [1.0], [0.3]]), 0.1)
    assert raw.tangent(np.array([-1.0]), np.zeros(0))[0] == pytest.approx([-slope(0.7)])


@pytest.mark.parametrize("place", [-0.7, -0.35, 0.0, 0.35, 0.2])
def test_duhem_oscillator_on_a_point_of_its_stiffness_has_two_slopes(place: float) -> None:
    """The stiffness is a polygon: at its points a state that moves up or down meets another piece."""
    values = {"f": [9e4, 7e4, 4e4, 3e4, 1e4], "z_max": 0.7}
    raw, e, sides = Raw(Node("b", "duhem_oscillator", {}, values)), 1e-7, set()
    raw.prepare(0.0), raw.init()
    n = raw.n_cstates
    for direction in (*np.eye(n), *-np.eye(n)):
        for x in np.array(np.meshgrid(*[[place, 0.11]] * n)).T.reshape(-1, n):
            raw.set_inputs(np.array([0.3]), 0.0)
            raw.x[:n] = x
            before = raw.deriv()
            found = raw.tangent(np.array([0.0]), direction)[1]
            raw.x[:n] = x + e * direction
            want = (raw.deriv() - before) / e
            assert found == pytest.approx(want, rel=1e-4, abs=1e-4 * np.abs(before).max())
            sides.add(round(float(np.abs(found).sum())))
    assert len(sides) > 2


# ---- Corner cases of the reader of block files, and of graphs that only hand-made files contain
def test_a_port_of_an_internal_row_is_refused() -> None:
    node = Node("c", "creep")
    file = Graph.single(node).to_bytes()  # the last port: kind, block, row, place, elements
    rows = [v.name for v in node.block.vars]
    for kind, name in ((2, None), (6, "q"), (7, None)):
        row = rows.index(name) if name else len(rows) - 1
        with pytest.raises(InputError):
            Executor(patched(file, -20, struct.pack("<III", kind, 0, row)))
    with pytest.raises(InputError):  # an output with more elements than its row
        Executor(patched(file, -4, struct.pack("<I", 2)))


def test_a_file_that_asks_for_too_much_memory_is_refused() -> None:
    wide = Node("n", "mlp", {"n_in": 1, "n_hidden": 1})
    file = Graph.single(wide).to_bytes()
    at = 68 + 4 + 4 + 1 + 4 + 3 + 4
    most = [d.hi for d in wide.block.dims]
    with pytest.raises(InputError, match=r"too many values|number of values"):
        Executor(patched(file, at, struct.pack(f"<{len(most)}I", *most)))


def test_what_is_no_output_is_left_out_of_the_row_of_outputs() -> None:
    u = np.array([[1.0], [-2.0]])
    assert Executor(input_between_outputs()[0]).run(u, 2, 0.1).tolist() == [[2.0, 3.0], [-4.0, -6.0]]


def test_blocks_that_together_ask_for_too_much_memory_are_refused() -> None:
    deep = [Node(f"z{k}", "zhao_tan", {"depth": 100000}) for k in range(90)]
    wires = [(f"z{k}.h", f"z{k + 1}.x") for k in range(89)]
    with pytest.raises(InputError, match="too many values"):
        Graph(deep, wires, [Input("x", ("z0.x",))], [Output("h", "z89.h")]).executor()


def test_the_tangent_leaves_out_what_is_no_output() -> None:
    e = Executor(input_between_outputs()[0])
    e.start(0.0)
    dy, none = (C.c_double * 2)(), (C.c_double * 1)()
    tangent = function("hyst_graph_tangent", C.c_void_p, *[C.POINTER(C.c_double)] * 4, result=None)
    tangent(e.handle, (C.c_double * 1)(0.5), none, dy, none)
    assert list(dy) == [1.0, 1.5]


@pytest.mark.parametrize(("y", "u"), [(0.0, 0.0), (-2e299, -0.5)], ids=["near end first", "far end first"])
def test_a_root_beside_a_cliff(y: float, u: float) -> None:
    """Where the outputs at the ends of a bracket are 1e600 : 1 a secant fails: bisection finds the root."""
    nodes = [
        Node("inverse", "implicit_inverse", {}, {"lo": -1.0, "hi": 1.0}),
        Node("cliff", "dead_zones", {"n": 1}, {"w0": 1e-300, "r": [-0.3], "w": [1e300]}),
    ]
    wires = [("inverse.u", "cliff.u"), ("cliff.y", "inverse.h")]
    graph = Graph(nodes, wires, [Input("y", ("inverse.y",))], [Output("u", "inverse.u")])
    assert graph.run(np.array([[y], [-2.7e-301]])) == pytest.approx([u, -0.27], abs=1e-12)


def test_argument_types_of_a_test_do_not_reach_the_binding() -> None:
    """They belong to the process: once `hyst_graph_tangent` took arrays here, addresses failed in other modules."""
    graph = Graph.single(Node("s", "scaling"))
    c = ContinuousExecutor(graph.to_bytes())
    c.start(0.0)
    test_the_tangent_leaves_out_what_is_no_output()
    assert c.tangent(np.array([1.0]), np.zeros(0), 1)[0].tolist() == [1.0]
