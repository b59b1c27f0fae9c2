"""Design tools against closed forms: describing functions, margins, transfer functions, tangents, delays, sectors."""

from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest
from series import series

from hystfmu import Graph, Input, InputError, Node, Output
from hystfmu.design import describing_function, gains, linearise, loop, margins, sector, to_control
from hystfmu.design.delays import unfolded
from hystfmu.identify.estimate.dynamics import Dynamics
from hystfmu.inverse import inverse
from hystfmu.model import Model

pytestmark = pytest.mark.skipif(find_spec("control") is None, reason="python-control is not installed")
H = 1e-4
OMEGA = 2 * np.pi * 500
G0 = Node("g0", "transfer_function", {}, {"b": [OMEGA**2], "a": [1.0, 1.4 * OMEGA, OMEGA**2]})


def play(A: np.ndarray, r: float) -> np.ndarray:
    """Describing function of backlash of half width r (Gelb & Vander Velde 1968, appendix B): 0 for A <= r."""
    x = np.clip(1 - 2 * r / A, -1, 1)
    real = 0.5 + (np.arcsin(x) + x * np.sqrt(1 - x * x)) / np.pi
    return np.where(r < A, real - 1j * (1 - x * x) / np.pi, 0)


def test_play_has_its_closed_form() -> None:
    A = np.array([0.2, 0.35, 0.6, 1.0, 5.0])
    one = describing_function(Node("b", "play_bank", {"n": 1}, {"r": [0.3]}), A)
    assert np.abs(one.N - play(A, 0.3)).max() < 2e-6
    assert (one.N[0], one.distortion[0], one.gain[0]) == (0, 0, 0)
    assert one.phase == pytest.approx(np.degrees(np.angle(one.N)))
    r, w = np.linspace(0.1, 1, 10) / 2, np.linspace(0.2, 0.05, 10)
    many = describing_function(Node("b", "prandtl_ishlinskii", {}, {"w0": 0.3, "r": r, "w": w}), A)
    expected = 0.3 + sum(w_i * play(A, r_i) for r_i, w_i in zip(r, w, strict=True))
    assert np.abs(many.N - expected).max() < 2e-6
    assert (many.phase < 0).all()
    assert (many.distortion < 0.3).all()


def test_relay_and_dynamics() -> None:
    """Saturation far beyond its range is a relay: 4 M / (pi A), harmonics 1/(2k+1); a lag is its transfer function."""
    relay = describing_function(
        Node("b", "scaling", {"n": 1}, {"gain": [1e6], "lo": [-1e-6], "hi": [1e-6]}), [2.0], samples=2**14
    )
    assert relay.N[0] == pytest.approx(4 / (np.pi * 2), rel=1e-4)
    assert relay.distortion[0] == pytest.approx(np.sqrt(np.pi**2 / 8 - 1), rel=1e-3)  # odd harmonics 1/(2k+1)
    lag = Node("b", "transfer_function", {}, {"b": [1.0], "a": [0.1, 1.0], "hold": "foh"})
    got = describing_function(lag, [1.0], frequency=3.0, cycles=8)
    assert got.N[0] == pytest.approx(1 / (1 + 0.1j * 2 * np.pi * 3), rel=1e-5)


def test_refusals() -> None:
    for part, amplitudes, words in (
        (Node("b", "pid"), [1.0], "one input and one output. Got 3 and 1 instead."),
        (Node("b", "play_bank", {"n": 1}), [0.0], "The amplitudes must be finite and greater than 0"),
    ):
        with pytest.raises(InputError, match=words):
            describing_function(part, amplitudes)
    for given in ({"samples": 15}, {"cycles": 0}, {"frequency": 0.0}, {"frequency": np.inf}):
        with pytest.raises(InputError, match=r"must be (at least|finite)"):
            describing_function(G0, [1.0], **given)  # type: ignore[arg-type]
    assert len(describing_function(G0, [1.0], samples=16, cycles=1).N) == 1
    with pytest.raises(InputError, match="The step 'h' of the sampled block pid must be"):
        to_control(Node("b", "pid"))
    with pytest.raises(InputError, match=r"The block must be linear, .* Got play_bank instead"):
        to_control(Node("b", "play_bank"), H)
    with pytest.raises(InputError, match="sampled blocks"):
        linearise(Graph.single(Node("b", "pid")))


CONTROLLERS = [
    Node("b", "pid", {}, {"Kp": 1.2, "Ki": 9000.0, "Kd": 6e-4, "tau": 2e-4}),
    Node("b", "pid", {}, {"Kp": 1.2}),
    Node("b", "lead_lag", {}, {"K": 0.7, "T_z": [2e-3, 1e-4], "T_p": [3e-4, 2e-2]}),
    Node("b", "sliding_mode", {}, {"lam": 1300.0, "eta": 6.5e-4, "rho": 1e-4, "epsilon": 7.0, "k_i": 1.56e7}),
    Node("b", "super_twisting", {}, {"lam": 900.0, "k_1": 1e-3, "k_2": 0.5, "mu": 0.1, "epsilon": 50.0}),
]


@pytest.mark.parametrize("node", CONTROLLERS, ids=lambda n: n.type)
def test_a_controller_is_its_transfer_function(node: Node) -> None:
    """The block itself on a small random error; python-control's response to the same."""
    import control

    e = 1e-7 * np.random.default_rng(3).normal(size=300)
    e[0] = 0  # at the initialisation a block takes no step of its integral
    u = Graph.single(node).run(np.column_stack([0 * e, -e, 0 * e]), H).reshape(len(e), -1)[:, 0]
    expected = control.forced_response(to_control(node, H), np.arange(len(e)) * H, e).outputs
    bound = 1e-9 if node.type in ("pid", "lead_lag") else 1e-3  # the switching term is linear for small s only
    assert np.abs(u - expected).max() < bound * np.abs(expected).max()


def test_plant_is_discretised_exactly_and_linearised_by_its_tangents() -> None:
    y = Graph.single(G0).run(np.ones(60), H)
    import control

    step = control.forced_response(to_control(G0, H), np.arange(60) * H, np.ones(60)).outputs
    # the block gives the end of the step, python-control its begin; row 0 is before the input came
    assert np.abs(y[1:] - step[1:]).max() < 1e-12
    plant = Model.load(Path(__file__).parents[2] / "scenarios" / "models" / "backlash_plant.model.toml")
    gain = to_control(plant).dcgain()[0]
    assert gain == pytest.approx([0.3, 0.3], rel=1e-12)  # the plays stand still at first: w0 alone, for u and d
    assert sorted(to_control(plant).poles(), key=np.imag) == pytest.approx(
        sorted(np.roots([1.0, 1.4 * OMEGA, OMEGA**2]), key=np.imag), rel=1e-9
    )


def test_margins_of_an_integral_loop() -> None:
    """I control, held, of a plant of gain 1 with d steps of delay: L = k h / (z - 1) / z^d.

    |L| = 1 at 2 sin(w h/2) = k h, phase -90 deg - w h/2 - d w h; gain margin for d = 0: 2 / (k h).
    """
    one = Node("b", "transfer_function", {}, {"b": [1.0], "a": [1e-9, 1.0]})  # faster than any step
    k = 2000.0
    for d in (0, 2):
        L = loop(one, Node("c", "pid", {}, {"Kp": 0.0, "Ki": k}), H, delay=d)
        m = margins(L)
        wh = 2 * np.arcsin(k * H / 2)
        phase = np.pi / 2 - wh / 2 - d * wh
        assert m.stable
        assert m.phase_deg == pytest.approx(np.degrees(phase), abs=1e-3)
        assert m.crossover_hz == pytest.approx(wh / (2 * np.pi * H), rel=1e-4)
        assert m.delay_s == pytest.approx(phase / (wh / H), rel=1e-3)
        assert m.delay_steps == pytest.approx(m.delay_s / H)
        if d == 0:
            assert m.gain_db == pytest.approx(20 * np.log10(2 / (k * H)), abs=1e-3)
        assert 0 < m.modulus < 1
        assert "phase margin" in str(m)
    assert not margins(loop(one, Node("c", "pid", {}, {"Kp": 0.0, "Ki": 2.1 / H}), H)).stable
    assert not margins(loop(one, Node("c", "pid", {}, {"Kp": 0.0, "Ki": k}), H, delay=2, gain=20.0)).stable


def test_gains_carry_their_units() -> None:
    found = {g.name: g for g in gains(Node("b", "sliding_mode", {}, {"lam": 1300.0, "k_i": 1e7}))}
    assert str(found["lam"]) == "lam = 1300 1/s  (slope of the sliding line)"
    assert (found["eta"].unit, found["k_i"].unit, found["rho"].unit) == ("s", "1/s2", "1")
    assert "switching" not in found  # a word
    assert str(gains(Node("b", "lead_lag", {}, {"T_z": [1.0, 2.0], "T_p": [0.1, 0.2]}))[1]).startswith("T_z = 1, 2 s")


# ---- delays ----------------------------------------------------------------------------------------------------------
def chain(steps: int, gain: float = 2.5) -> Graph:
    """As the kinds g0_... : a gain, G0, a delay, an offset."""
    return series(
        Node("input", "scaling", {"n": 1}, {"gain": gain}), G0, Node("late", "delay", {"n": steps}, {"y0": 0.0}),
        Node("readout", "scaling", {"n": 1}, {"offset": 0.0}), step=H,
    )  # fmt: skip


def test_a_discrete_delay_is_what_the_core_steps():
    """The impulse response of the state space against the graph, whose input is held at the end of a step."""
    graph, n = chain(3), 60
    system = to_control(graph, H)
    u = np.zeros(n + 1)
    u[1] = 1.0
    core = graph.run(u, H)
    x, rows = np.zeros((system.nstates, 1)), []
    for value in u[1:]:
        x = np.asarray(system.A) @ x + np.asarray(system.B) * value
        rows.append(float((np.asarray(system.C) @ x)[0, 0]))
    assert system.nstates == 5
    assert core[1:] == pytest.approx(np.array(rows), abs=1e-12 * np.abs(core).max())


def test_two_delays_one_behind_the_other_and_one_at_the_input():
    nodes = [Node("a", "delay", {"n": 2}), Node("b", "delay", {"n": 1}), G0]
    graph = Graph(
        nodes, [("a.y", "b.u"), ("b.y", "g0.u")], [Input("u", ("a.u",))], [Output("y", "g0.y"), Output("v", "b.y")],
        step=H,
    )  # fmt: skip
    system, z = to_control(graph, H), np.exp(0.3j)
    y, v = (complex(k) for k in np.ravel(system(z)))
    assert v == pytest.approx(z**-3, rel=1e-12)
    assert y == pytest.approx(complex(to_control(G0, H)(z)) * z**-3, rel=1e-9)


def test_a_model_with_delay_is_linearised():
    model, s = Model("m", chain(3), H), 2j * np.pi * 200
    A, B, C, D = linearise(model, pade=3)
    assert len(A) == 2 + 3
    (value,) = np.ravel(C @ np.linalg.solve(s * np.eye(len(A)) - A, B) + D)
    assert value == pytest.approx(complex(to_control(model, pade=3)(s)), rel=1e-9)
    assert value == pytest.approx(2.5 * complex(to_control(G0)(s)) * np.exp(-s * 3 * H), rel=1e-6)


def test_margins_of_a_model_with_delay():
    """A model with two steps of delay has the margins of the same model and `delay=2`."""
    pid = Node("pid", "pid", {}, {"Kp": 0.3, "Ki": 900.0})
    with_delay = margins(loop(Model("m", chain(2), H), pid, H))
    beside = margins(loop(G0, pid, H, delay=2, gain=2.5))
    assert vars(with_delay) == pytest.approx(vars(beside), rel=1e-5)


def test_refusals_of_delays():
    with pytest.raises(InputError, match=r"must be given for a delay in continuous form.*pade=ORDER"):
        to_control(chain(2))
    with pytest.raises(InputError, match=r"must be given for a delay in continuous form.*pade=ORDER"):
        linearise(Model("m", chain(2), H))
    with pytest.raises(InputError, match=r"must be that of the model, 0.0001 s.*Got 0.001"):
        to_control(chain(2), 1e-3)
    with pytest.raises(InputError, match=r"'h' must be a float in \(0, inf\)"):
        to_control(chain(2), -1.0)


def late_inverse() -> tuple[Model, Model]:
    """Plays, G0 and a delay of 3.4 steps as the kinds g0_..., and their inverse."""
    values = {"w0": 0.6, "r": [0.05, 0.2], "w": [0.3, 0.2]}
    graph = series(
        Node("hysteresis", "prandtl_ishlinskii", {}, values),
        *Dynamics(500.0, 0.7, 3.4 * H).nodes(H, "zoh"),
        Node("readout", "scaling", {"n": 1}, {"gain": -5.0, "offset": 3.0}),
    )
    model = Model("g0_prandtl_ishlinskii", graph, H, "", {}, {"span_u": [-1, 1]})
    return model, inverse(model)


def test_weights_of_past_samples_become_delays() -> None:
    _, made = late_inverse()
    opened = unfolded(made.graph)
    assert "polynomial_narx" not in {n.type for n in opened.nodes}
    u = 3 + np.append(0, np.cumsum(np.random.default_rng(0).normal(size=300)))
    np.testing.assert_allclose(opened.run(u, H), made.graph.run(u, H), rtol=0, atol=1e-10)


def test_an_inverse_of_dynamics_cancels_its_model_but_for_the_lag() -> None:
    """The product of both responses is a delay: the lag of the inverse, and the step for which the model is held."""
    model, made = late_inverse()
    first, second = to_control(made, H), to_control(model, H)
    for f in (0.1, 10.0, 50.0):
        z = np.exp(2j * np.pi * f * H)
        assert abs(first(z) * second(z) * z ** (made.fit["lag_steps"] + 1) - 1) < 1e-4
    assert margins(loop(model, Node("pid", "pid", {}, {"Kp": -0.1, "Ki": -50.0, "Kd": 0.0}), H)).stable


# ---- sectors of slopes -----------------------------------------------------------------------------------------------
STEP = 1e-3
W0, R, W = 0.3, 0.1, 0.7


def plays_and_lag(gain: float = 1.0) -> Graph:
    """w0 u + w p_r[u] by slopes w0 inside of the play and w0 + w outside, before dynamics with static gain `gain`."""
    return series(
        Node("plays", "prandtl_ishlinskii", {"n": 1}, {"w0": W0, "r": [R], "w": [W]}),
        Node("g0", "transfer_function", {"na": 2}, {"b": [gain * 1e6], "a": [1.0, 1e3, 1e6]}),
    )


def test_slopes_of_a_play_are_those_inside_and_outside() -> None:
    path = np.sin(np.linspace(0.0, 9.0, 4001))
    late = series(*plays_and_lag(1.5).nodes, Node("late", "delay", {"n": 3}))
    for part in (plays_and_lag(1.5), late):
        assert sector(path, part, h=STEP) == pytest.approx((1.5 * W0, 1.5 * (W0 + W)), rel=1e-9)


def test_exact_inverse_leaves_the_gain_of_the_dynamics_and_a_wrong_one_the_ratio() -> None:
    path = 0.8 * np.sin(np.linspace(0.0, 9.0, 4001))
    exact = {"w0": W0, "r": [R], "w": [W]}
    inverse = Graph.single(Node("inverse", "prandtl_ishlinskii_inverse", {"n": 1}, exact))
    assert sector(path, inverse, plays_and_lag(1.2), h=STEP) == pytest.approx((1.2, 1.2), rel=1e-6)
    twice = Graph.single(Node("inverse", "prandtl_ishlinskii_inverse", {"n": 1}, exact | {"w0": 2 * W0, "w": [2 * W]}))
    assert sector(path, twice, plays_and_lag(), h=STEP) == pytest.approx((0.5, 0.5), rel=1e-6)


def test_a_path_at_rest_is_refused() -> None:
    with pytest.raises(InputError, match="path of a sector must vary"):
        sector(np.ones(5), plays_and_lag(), h=STEP)
