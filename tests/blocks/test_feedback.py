"""Controllers and feed-forward against their definitions in numpy, closed forms, and the exact ultimate bound."""

from typing import Any

import numpy as np
import pytest
import scipy.linalg
import scipy.signal
from numpy.typing import NDArray
from scipy.linalg import expm

from hystfmu import Graph, Input, InputError, Node, Output, Unit

Array = NDArray[np.float64]


W_N, ZETA = 2 * np.pi * 500, 0.7
G0 = ([W_N**2], [1, 2 * ZETA * W_N, W_N**2])


def rng(seed: int = 0) -> np.random.Generator:
    return np.random.default_rng(seed)


def controller_rows(n: int = 200) -> Array:
    return np.cumsum(rng(4).normal(size=(n, 3)), axis=0) * 0.1


SLIDING: dict[str, Any] = {"eta": 1e-3, "rho": 0.01}
TWISTING: dict[str, Any] = {"k_1": 0.01, "k_2": 0.1}


@pytest.mark.parametrize(("name", "values", "in_metres"), [
    ("sliding_mode", SLIDING, {"eta": 1e3}),
    ("sliding_mode", {**SLIDING, "switching": "saturation", "k_i": 3000.0}, {"eta": 1e3}),
    ("super_twisting", TWISTING, {"k_1": 10.0}),
    ("super_twisting", {**TWISTING, "mu": 0.3}, {"k_1": 10.0, "mu": 300.0}),
])  # fmt: skip
def test_a_layer_without_a_width_does_not_depend_on_the_unit_of_measure(
    name: str, values: dict[str, Any], in_metres: dict[str, float]
) -> None:
    """Errors in metres instead of micrometres, gains of s to match: the same command."""
    rows, h = controller_rows() * [1e-3, 1e-3, 1], 1e-4
    u, s = Graph.single(Node("c", name, {}, values)).run(rows, h).T
    small, small_s = Graph.single(Node("c", name, {}, {**values, **in_metres})).run(rows * [1e-6, 1e-6, 1], h).T
    assert np.abs(small - u).max() <= 1e-9 * np.abs(u).max()
    assert np.abs(small_s - 1e-6 * s).max() <= 1e-9 * np.abs(small_s).max()
    wide = Graph.single(Node("c", name, {}, {**values, "epsilon": 10.0})).run(rows, h)[:, 0]
    assert np.abs(wide - u).max() > 1e-4 * np.abs(u).max(), "the layer acts on this signal"


def test_the_layer_follows_the_gains() -> None:
    rows, h = controller_rows(), 1e-4
    for name, values, epsilon in (
        ("sliding_mode", {"eta": 2e-3, "rho": 0.3}, 15.0),
        ("super_twisting", {"lam": 50.0, "k_1": 0.02, "k_2": 0.3}, 9.0),
    ):
        given = Graph.single(Node("c", name, {}, {**values, "epsilon": epsilon})).run(rows, h)
        np.testing.assert_allclose(Graph.single(Node("c", name, {}, values)).run(rows, h), given, rtol=1e-12)


@pytest.mark.parametrize(("name", "values", "sentence"), [
    ("sliding_mode", {**SLIDING, "eta": 0.0}, "epsilon must be greater than 0 if eta is 0"),
    ("sliding_mode", {"eta": 1e300, "rho": 1e-300}, "epsilon must be greater than 0"),  # the width is below all
    *(("super_twisting", {**TWISTING, k: 0.0}, "if lam, k_1 or k_2 is 0") for k in ("lam", "k_1", "k_2")),
])  # fmt: skip
def test_gains_without_a_scale_need_a_width(name: str, values: dict[str, float], sentence: str) -> None:
    with pytest.raises(InputError, match=sentence):
        Graph.single(Node("c", name, {}, values)).executor()
    Graph.single(Node("c", name, {}, {**values, "epsilon": 0.1})).executor()


@pytest.mark.some(8)
@pytest.mark.parametrize(
    "name", ["pid", "lead_lag", "sliding_mode", "super_twisting", "iterative_learning", "repetitive"]
)
@pytest.mark.parametrize(("f_n", "zeta"), [(0.0, 1.0), (45.0, 0.1), (700.0, 0.02), (1000.0, 0.7)])
def test_a_controller_without_gains_leaves_a_loop_stable(name: str, f_n: float, zeta: float) -> None:
    """A plant of gain 1 with one or two steps of delay: what is not given adds nothing to the feed-forward."""
    n, h = 2000, 1e-4
    unit = Unit(Graph.single(Node("c", name, {"n": 50} if name in ("iterative_learning", "repetitive") else {}, {})))
    ports = {v.name for v in Node("c", name, {}, {}).block.of("input")}
    unit.initialize(0.0, **{k: 1.0 if k == "active" else 0.0 for k in ports})
    w, x, late, y = 2 * np.pi * f_n, np.zeros(2), [0.0, 0.0], []
    A = expm(np.array([[0, 1, 0], [-(w**2), -2 * zeta * w, w**2], [0, 0, 0]]) * h)
    for k in range(n):
        x = A[:2, :2] @ x + A[:2, 2] * late.pop(0)
        y.append(x[0] if f_n else late[0])
        r = np.sin(2 * np.pi * k / 50)
        for port, value in (("y_d", r), ("y", y[-1]), ("u_ff", r)):
            unit.set(port, value) if port in ports else None
        unit.do_step(k * h, h)
        late.append(unit.get("r" if name == "repetitive" else "u"))
    peak = max(1 / (2 * zeta), 1.0) + 1
    assert np.abs(y).max() <= 2 * peak


CONTROLLERS = {
    "pid": {"Kp": 1.0, "Ki": 50.0, "Kd": 0.0},
    "sliding_mode": {"lam": 100.0, "eta": 0.01, "rho": 0.01, "epsilon": 1.0, "k_i": 5000.0},
}


@pytest.mark.parametrize("name", CONTROLLERS)
def test_no_kick_at_the_start(name: str) -> None:
    """The first error is not a discontinuity: with a huge derivative gain, u has no derivative term at the start."""
    strong = {"Kp": 0.0, "Kd": 1e6} if name == "pid" else {"lam": 0.0, "eta": 1e6}
    unit = Unit(Graph.single(Node(name, name, {}, strong)))
    unit.initialize(0.0, y_d=5.0, y=-3.0, u_ff=0.25)
    assert unit.get("u") == 0.25
    unit.do_step(0.0, 1e-6)  # the same error again: still no derivative
    assert abs(unit.get("u") - 0.25) <= 1e-9


@pytest.mark.parametrize("name", CONTROLLERS)
def test_limits_and_anti_windup(name: str) -> None:
    """After ten seconds at the limit there is no windup: u leaves it as soon as the error changes its sign."""
    h = 1e-3
    rows = np.zeros((10_200, 3))
    rows[:10_000, 0], rows[10_000:, 0] = 1.0, -0.02
    limited = {**CONTROLLERS[name], "u_min": -0.6, "u_max": 0.5}
    u = Graph.single(Node(name, name, {}, limited)).run(rows, h).reshape(len(rows), -1)[:, 0]
    assert u.max() <= 0.5
    assert u.min() >= -0.6
    assert u[9_999] == 0.5
    assert u[10_001] < 0.5
    free = Graph.single(Node(name, name, {}, CONTROLLERS[name])).run(rows, h).reshape(len(rows), -1)[:, 0]
    assert free[10_150] > 100  # the same controller without limits has wound up


@pytest.mark.parametrize("name", CONTROLLERS)
def test_limits_must_be_in_order(name: str) -> None:
    graph = Graph.single(Node(name, name, {}, {"u_min": 1.0}))
    unit = Unit(graph)
    unit.set("u_max", 0.5)
    with pytest.raises(InputError, match="u_min must not be greater than u_max"):
        unit.initialize(0.0)


@pytest.mark.parametrize("name", CONTROLLERS)
def test_integral_action_removes_a_constant_disturbance(name: str) -> None:
    """A first-order plant pushed by 0.3: the error ends at 0 with the integral and does not without it."""
    errors = []
    for gains in (CONTROLLERS[name], {**CONTROLLERS[name], "Ki" if name == "pid" else "k_i": 0.0}):
        nodes = [
            Node("plant", "transfer_function", {}, {"b": [1.0], "a": [0.05, 1.0]}),
            Node("control", name, {}, gains),
            Node("push", "sum", {"n": 1}, {"offset": 0.3}),
        ]
        wires = [("plant.y", "control.y"), ("control.u", "push.u"), ("push.y", "plant.u")]
        graph = Graph(nodes, wires, [Input("r", ("control.y_d", "control.u_ff"))], [Output("y", "plant.y")])
        errors.append(abs(graph.run(np.full(5000, 0.5), 1e-3)[-1] - 0.5))
    assert errors[0] <= 1e-12
    assert errors[1] >= 0.01


def test_sliding_mode_meets_the_exact_ultimate_bound() -> None:
    """s' = -eta s - rho s/(|s| + eps) + d, |d| <= D: the worst d holds s at the exact bound, not at eps/(eta - 1).

    A plant 1/s^2 with lam = 0 has s' = u + d.  The exact bound is the root of eta s + rho s/(s + eps) = D.
    """
    eta, rho, epsilon, D = 5.0, 1.0, 0.01, 1.0
    q = eta * epsilon + rho - D
    exact = (-q + np.sqrt(q * q + 4 * eta * D * epsilon)) / (2 * eta)
    printed = epsilon / (eta - 1)
    assert exact == pytest.approx(0.0400, abs=5e-5)
    assert printed == pytest.approx(0.0025)
    nodes = [
        Node("plant", "transfer_function", {}, {"b": [1.0], "a": [1.0, 0.0, 0.0]}),
        Node("control", "sliding_mode", {}, {"lam": 0.0, "eta": eta, "rho": rho, "epsilon": epsilon}),
    ]
    wires = [("plant.y", "control.y"), ("control.u", "plant.u")]
    graph = Graph(nodes, wires, [Input("d", ("control.u_ff",))], [Output("s", "control.s")])
    s = graph.run(np.full(60_000, D), 1e-4)
    assert abs(s[-1] - exact) <= 1e-6
    assert s.max() <= exact * (1 + 1e-3)
    assert s[-1] > 10 * printed
    switching = np.sign(np.sin(2 * np.pi * 0.7 * np.arange(60_000) * 1e-4)) * D  # any other d stays inside
    assert np.abs(graph.run(switching, 1e-4)).max() <= exact * (1 + 1e-3)


def test_feedforward_through_g0_gives_the_reference() -> None:
    """v drives G0 (foh, a fine step): the output is the reference once the start has decayed."""
    h = 1e-5
    nodes = [
        Node("r", "reference", {"m": 1}, {"amplitude": 2.0, "frequency": 50.0, "phase": 0.4}),
        Node("ff", "feedforward", {}, {"f_n": 500.0, "zeta": 0.7, "gain": 3.0}),
        Node("g0", "transfer_function", {}, {"b": [3 * W_N**2], "a": G0[1], "hold": "foh", "start": "steady"}),
    ]
    wires = [("r.r_lead", "ff.r"), ("r.dr_lead", "ff.dr"), ("r.ddr_lead", "ff.ddr"), ("ff.v", "g0.u")]
    graph = Graph(nodes, wires, (), [Output("r", "r.r"), Output("y", "g0.y")])
    y = graph.run(np.zeros((4000, 0)), h)
    settled = y[1000:]
    assert np.abs(settled[:, 0] - settled[:, 1]).max() <= 3e-6  # the ramps of the hold: (2 pi 50 h)^2 / 12


def test_preview_of_half_a_sample_makes_up_for_the_hold() -> None:
    """At 10 kHz and 100 Hz a zero-order hold costs 2-3 % of amplitude; taken at t + h/2, less than a tenth of that."""
    errors = []
    for lead in (0.0, 0.5e-4):
        nodes = [
            Node("r", "reference", {"m": 1}, {"frequency": 100.0, "lead": lead}),
            Node("ff", "feedforward"),
            Node("g0", "transfer_function", {}, {"b": G0[0], "a": G0[1]}),
        ]
        wires = [("r.r_lead", "ff.r"), ("r.dr_lead", "ff.dr"), ("r.ddr_lead", "ff.ddr"), ("ff.v", "g0.u")]
        graph = Graph([nodes[2], *nodes[:2]], wires, (), [Output("r", "r.r"), Output("y", "g0.y")], sort=False)
        y = graph.run(np.zeros((2000, 0)), 1e-4)[500:]
        errors.append(np.abs(y[:, 0] - y[:, 1]).max())
    assert 0.01 <= errors[0] <= 0.04
    assert errors[1] <= 0.1 * errors[0]


# ---- Properties of the controllers: frequency response, observer transfer, convergence of learning and sliding
H = 1e-4


def run(block: str, u: np.ndarray, values: dict[str, object], dims: dict[str, int] | None = None) -> np.ndarray:
    return Graph.single(Node(block, block, dims or {}, values)).run(u, H)


def test_lead_lag_is_scipys_bilinear_rule_and_keeps_the_phase() -> None:
    T_z, T_p, K = [2e-3, 1e-4], [3e-4, 2e-2], 0.7
    b, a = [K], [1.0]
    for z, p in zip(T_z, T_p, strict=True):
        b, a = np.polymul(b, [z, 1]), np.polymul(a, [p, 1])
    e = np.random.default_rng(0).normal(size=400)
    e[0] = 0
    bz, az = scipy.signal.bilinear(b, a, 1 / H)
    got = run("lead_lag", np.column_stack([e, 0 * e, 0 * e]), {"K": K, "T_z": T_z, "T_p": T_p}, {"n": 2})
    assert np.abs(got - scipy.signal.lfilter(bz, az, e)).max() < 1e-12
    w = 2 * np.pi * 500  # a twentieth of the sampling frequency
    continuous = np.polyval(b, 1j * w) / np.polyval(a, 1j * w)
    z = np.exp(1j * w * H)
    assert abs(np.angle(np.polyval(bz, z) / np.polyval(az, z) / continuous)) < np.deg2rad(1)


def plant(u: np.ndarray) -> np.ndarray:
    """500 Hz, damping 0.7, held input: y_k is what the commands before k led to."""
    w = 2 * np.pi * 500
    E = scipy.linalg.expm(H * np.array([[0, 1, 0], [-w * w, -1.4 * w, w * w], [0, 0, 0]]))
    x, y = np.zeros(2), [0.0]
    for v in u[:-1]:
        x = E[:2, :2] @ x + E[:2, 2] * v
        y.append(x[0])
    return np.array(y)


OBSERVER = {"f_n": 500.0, "zeta": 0.7, "f_o": 100.0}


@pytest.mark.parametrize("n", [1, 2, 4])
def test_observer_sees_nothing_in_the_nominal_plant(n: int) -> None:
    """The command passes unchanged, because no disturbance is found; y is late by n - 1 steps that it knows of."""
    u = np.random.default_rng(1).normal(size=500)
    y = np.concatenate([np.zeros(n - 1), plant(u)[: len(u) - n + 1]])
    out = run("disturbance_observer", np.column_stack([u, y]), OBSERVER, {"n": n})
    assert np.abs(out[:, 1]).max() < 1e-10


def test_observer_has_three_poles_where_it_says() -> None:
    """A step of d under its own compensation: the error (c_0 + c_1 k + c_2 k^2) z^k, z = exp(-2 pi f_o h), no more."""
    w, z = 2 * np.pi * 500, np.exp(-2 * np.pi * OBSERVER["f_o"] * H)
    E = scipy.linalg.expm(H * np.array([[0, 1, 0], [-w * w, -1.4 * w, w * w], [0, 0, 0]]))
    unit, x, error = Unit(Graph.single(Node("b", "disturbance_observer", {}, OBSERVER))), np.zeros(2), [1.0]
    unit.initialize(0.0, y=0.0, u_c=0.0)
    for k in range(400):
        x = E[:2, :2] @ x + E[:2, 2] * (unit.get("u") + 1.0)
        unit.set("y", x[0])
        unit.do_step(k * H, H)
        error.append(1.0 - unit.get("d_hat"))
    left = scipy.signal.lfilter([1, -3 * z, 3 * z**2, -(z**3)], [1], error)
    assert np.abs(left[4:]).max() < 1e-12 < np.abs(left[:3]).max()
    assert abs(error[-1]) < 1e-6


def test_observer_without_gain_or_with_a_step_too_long_is_refused() -> None:
    for values, words in (({"gain": 0.0}, "gain must not be 0"), ({"f_n": 1e9}, "the step is too long")):
        with pytest.raises(InputError, match=words):
            run("disturbance_observer", np.zeros((3, 2)), values)


def test_learning_of_a_static_plant_shrinks_the_error_by_one_minus_gain_g() -> None:
    n, g, gain = 50, 0.8, 0.9
    unit = Unit(Graph.single(Node("b", "iterative_learning", {"n": n}, {"gain": gain, "lead": 1})))
    unit.initialize(0.0, y_d=0.0, y=0.0, u_ff=0.0)
    r = np.sin(2 * np.pi * np.arange(8 * n) / n)
    e = [0.0]
    for k in range(1, len(r)):
        y = g * unit.get("u")  # of the command a step ago
        e.append(r[k] - y)
        unit.set("y_d", r[k]), unit.set("y", y)
        unit.do_step((k - 1) * H, H)
    periods = np.array(e).reshape(-1, n)
    for j in range(1, len(periods)):
        gap = periods[j, 1:] - (1 - gain * g) ** j * r[1:n]
        assert np.abs(gap).max() < 1e-14, j


def test_repetitive_error_shrinks_by_one_minus_gain_g_and_rests_while_inactive() -> None:
    """Plant y_k = g u_(k-1), so that T = g / z; with L = gain z and Q = 1, Q - L T = 1 - gain g."""
    n, g, gain, rest = 50, 0.8, 0.9, 3
    unit = Unit(Graph.single(Node("b", "repetitive", {"n": n, "n_q": 0}, {"q": [1.0], "l": [0.0, 0.0, gain]})))
    unit.initialize(0.0, y_d=0.0, y=0.0)
    r = np.sin(2 * np.pi * np.arange(8 * n) / n)
    e = [0.0]
    for k in range(1, len(r)):
        y = g * unit.get("r")
        e.append(r[k] - y)
        unit.set("y_d", r[k]), unit.set("y", y), unit.set("active", float(k // n != rest))
        unit.do_step((k - 1) * H, H)
    periods = np.array(e).reshape(-1, n)
    unlearnt = (r[1:] - g * r[:-1])[: n - 1]  # the error of the first period
    for j in range(1, len(periods)):
        learnt = j - (j > rest)  # steps of the memory that this period has seen
        gap = periods[j, 2:] - (1 - gain * g) ** learnt * unlearnt[1:]
        assert np.abs(gap).max() < 1e-13, j


@pytest.mark.parametrize("size", ["n_q", "n_l"])
def test_repetitive_filters_longer_than_a_period_are_refused(size: str) -> None:
    with pytest.raises(InputError, match="must be below n"):
        Unit(Graph.single(Node("b", "repetitive", {"n": 4, size: 4}, {})))


def slide(block: str, values: dict[str, float], h: float, lam: float) -> tuple[float, float]:
    """Largest |s| after 1 s, and total variation of the command, on y'' = u + 0.7 sin 5 t: (s, variation)."""
    unit = Unit(Graph.single(Node("b", block, {}, {"lam": lam, **values})))
    unit.initialize(0.0, y_d=0.0, y=0.0, u_ff=0.0)
    x, s, u = np.zeros(2), [], []
    for k in range(round(3 / h)):
        a = unit.get("u") + 0.7 * np.sin(5 * k * h)
        x = np.array([x[0] + h * x[1] + h * h / 2 * a, x[1] + h * a])
        unit.set("y", x[0])
        unit.do_step(k * h, h)
        s.append(unit.get("s")), u.append(unit.get("u"))
    late = len(s) // 3
    return float(np.abs(s[late:]).max()), float(np.abs(np.diff(u[late:])).sum())


def test_super_twisting_slides_closer_and_without_chattering() -> None:
    """|d'| <= L = 3.5; gains 1.5 sqrt(L) and 1.1 L of Levant (k_2 counts half).  The relay needs rho > 0.7."""
    L = 3.5
    twisting = {"k_1": 1.5 * L**0.5, "k_2": 2 * 1.1 * L, "epsilon": 1e-9}
    relay = {"eta": 0.0, "rho": 1.0, "epsilon": 1e-9}
    fine, coarse = slide("super_twisting", twisting, 5e-4, 2.0), slide("super_twisting", twisting, 2e-3, 2.0)
    plain = slide("sliding_mode", relay, 2e-3, 2.0)
    print(fine, coarse, plain)
    assert coarse[0] < 0.5 * plain[0]
    assert coarse[1] < 0.1 * plain[1]
    assert fine[0] < coarse[0] / 4
