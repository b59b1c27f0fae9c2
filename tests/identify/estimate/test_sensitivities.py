"""Sensitivities of runs: plays by definition, Bouc-Wen by a tight integrator, others by extrapolated differences."""

import numpy as np
import pytest
from numpy_devices import multisine
from scipy.integrate import solve_ivp
from series import series

import hystfmu as hy
from hystfmu.core.executor import SEED, Executor
from hystfmu.graph import Graph

H = 1e-3


def place(graph: Graph, name: str, element: int = 0) -> int:
    node, _, parameter = name.partition(".")
    return next(
        p.reference + element
        for p in graph.ports
        if p.is_parameter and (graph.nodes[p.node].name, p.var.name) == (node, parameter)
    )


def derivatives(graph: Graph, u: np.ndarray, names: list[tuple[str, int]], sizes: np.ndarray) -> np.ndarray:
    """By 1 of each parameter; in the order of nodes, as the core asks."""
    seeds = [(place(graph, name, k), column, s) for column, ((name, k), s) in enumerate(zip(names, sizes, strict=True))]
    dy = Executor(graph.to_bytes()).sensitivities(u[:, None], 1, H, np.array(seeds, dtype=SEED))[1]
    return np.asarray(dy[:, 0] / sizes)


def extrapolated(graph: Graph, u: np.ndarray, names: list[tuple[str, int]], sizes: np.ndarray) -> np.ndarray:
    """Central differences of whole runs, extrapolated from three steps (Richardson): error of order six."""
    x, found = Executor(graph.to_bytes()), []
    for (name, k), size in zip(names, sizes, strict=True):
        at, slopes = place(graph, name, k), []
        value = x.get(at)
        for step in (4e-3 * size, 2e-3 * size, 1e-3 * size):
            ends = []
            for s in (step, -step):
                x.set(at, value + s)
                ends.append(x.run(u[:, None], 1, H)[:, 0])
            slopes.append((ends[0] - ends[1]) / (2 * step))
            x.set(at, value)
        a, b = (4 * slopes[1] - slopes[0]) / 3, (4 * slopes[2] - slopes[1]) / 3
        found.append((16 * b - a) / 15)
    return np.column_stack(found)


def by_definition(u, gain, w0, r, w, z0):
    """Derivatives of the output by (gain of the input, w0, r, w, z0): a play is what it followed last."""
    z, by_r, by_z0, by_gain = z0.copy(), np.zeros_like(r), np.ones_like(r), np.zeros_like(r)
    found = []
    for x in u:
        for i in range(len(r)):
            side = -1 if z[i] < gain * x - r[i] else 1 if z[i] > gain * x + r[i] else 0
            if side:
                z[i] = gain * x + side * r[i]
                by_r[i], by_z0[i], by_gain[i] = side, 0.0, x
        found.append(np.concatenate([[w0 * x + w @ by_gain, gain * x], w * by_r, z, w * by_z0]))
    return np.array(found)


@pytest.mark.parametrize("seed", range(3))
def test_plays_are_exact_through_turning_points(seed):
    rng = np.random.default_rng(seed)
    n, u = 12, np.cumsum(rng.normal(size=2000)) * 0.1
    r, w, z0 = rng.uniform(0.01, 1.5, n), rng.normal(size=n), rng.uniform(-0.3, 0.3, n)
    nodes = [
        hy.Node("a", "scaling", {"n": 1}, {"gain": 0.7}),
        hy.Node("p", "backlash_sum", {}, {"w0": 0.4, "r": r, "w": w, "z0": z0}),
    ]
    names = [("a.gain", 0), ("p.w0", 0), *((f"p.{k}", i) for k in ("r", "w", "z0") for i in range(n))]
    want = by_definition(u, 0.7, 0.4, r, w, z0)
    sizes = rng.uniform(0.5, 2, len(names))
    got = derivatives(series(*nodes), u, names, sizes)
    assert np.abs(got - want).max() <= 1e-12 * np.abs(want).max()
    # the same plays with an output each, behind which a sum has the weights
    bank = hy.Node("p", "play_bank", {"n": n}, {"r": r, "z0": z0})
    mix = hy.Node("m", "sum", {"n": n + 1}, {"k": [*w, 0.4]})
    graph = Graph(
        [nodes[0], bank, mix],
        [("a.y", "p.u"), *((f"p.z[{k}]", f"m.u[{k}]") for k in range(1, n + 1)), ("a.y", f"m.u[{n + 1}]")],
        [hy.Input("u", ("a.u",))],
        [hy.Output("y", "m.y")],
    )
    names = [
        ("a.gain", 0), *(("p.r", i) for i in range(n)), *(("p.z0", i) for i in range(n)), ("m.k", n),
        *(("m.k", i) for i in range(n)),
    ]  # fmt: skip
    order = [0, *range(2, 2 + n), *range(2 + 2 * n, 2 + 3 * n), 1, *range(2 + n, 2 + 2 * n)]
    got = derivatives(graph, u, names, np.ones(len(names)))
    assert np.abs(got - want[:, order]).max() <= 1e-12 * np.abs(want).max()


@pytest.mark.parametrize(("beta", "gamma", "n"), [(0.8, 0.3, 1.6), (0.5, 0.5, 2.0), (0.6, -0.2, 1.0)])
def test_bouc_wen_by_the_variational_equations(beta, gamma, n):
    u = np.concatenate(
        [np.linspace(a, b, 25) for a, b in zip((0.0, 1.5, -1.0, 0.4, -0.6), (1.5, -1, 0.4, -0.6, 2.0), strict=True)]
    )
    node = hy.Node("b", "bouc_wen", {}, {"A": 1.2, "beta": beta, "gamma": gamma, "n": n, "z0": 0.1, "alpha": 0.0})

    def rates(x, s, q):
        z, by = q[0], q[1:]
        size = abs(z) ** n
        c = gamma + beta * s * np.sign(z)
        own = np.array([1.0, -s * np.sign(z) * size, -size, 0.0])
        return np.concatenate([[1.2 - c * size], own - c * n * abs(z) ** (n - 1) * np.sign(z) * by])

    q, want = np.array([0.1, 0.0, 0.0, 0.0, 1.0]), []
    for a, b in zip([0.0, *u[:-1]], u, strict=True):
        if b != a:
            cross = lambda x, q, s: q[0]  # noqa: E731  |z| has a kink there
            cross.terminal = True
            s, at = np.sign(b - a), a
            while at != b:
                rest = solve_ivp(
                    lambda x, q, s: rates(x, s, q), (at, b), q, "DOP853", rtol=1e-11, atol=1e-13, args=(s,),
                    events=cross if q[0] else None,
                )  # fmt: skip
                at, q = rest.t[-1], rest.y[:, -1].copy()
                if at != b:
                    q[0] = 0.0
        want.append(q[1:])
    names = [("b.A", 0), ("b.beta", 0), ("b.gamma", 0), ("b.z0", 0)]
    got = derivatives(series(node), u, names, np.ones(4))
    assert np.abs(got - np.array(want)).max() <= 1e-8 * np.abs(want).max()


OSCILLATORS = [
    ("bouc_wen_oscillator", {"nu": 2.0}, ("m_L", "c_L", "k_L", "alpha", "beta", "gamma", "delta", "nu")),
    ("duhem_oscillator", {"f": [9e4, 7e4, 5e4, 3e4, 1e4], "z_max": 90.0}, ("m_L", "c_L", "k_L")),
    ("maxwell_slip_oscillator", {"k": [4e4, 3e4], "r": [2e-4, 5e-4]}, ("m_L", "c_L", "k_L", "k", "r")),
]


@pytest.mark.parametrize(("name", "values", "free"), OSCILLATORS)
def test_oscillators_by_extrapolated_differences(name, values, free):
    u = 40 * multisine(np.random.default_rng(4), 600, 30.0)[1]
    graph = series(hy.Node("p", name, {}, values))
    names = [(f"p.{k}", 0) for k in free]
    sizes = np.array([1e-3 * graph.node("p").value(k)[0] for k in free])
    want = extrapolated(graph, u, names, sizes) * sizes
    got = derivatives(graph, u, names, sizes) * sizes
    error = np.abs(got - want) / np.abs(want).max(axis=0)
    assert np.quantile(error, 0.9) <= 1e-5  # the differences cross kinks of |v| and |z|
    assert np.median(error) <= 1e-6


def test_a_mode_by_extrapolated_differences():
    u = multisine(np.random.default_rng(5), 500)[1]
    a = [1.0, 120.0, 9e4]
    graph = series(
        hy.Node(
            "g", "transfer_function", {"na": 2, "nb": 1}, {"b": [20.0, 9e4], "a": a, "hold": "foh", "start": "steady"}
        )
    )
    names = [("g.b", 0), ("g.b", 1), ("g.a", 0), ("g.a", 1), ("g.a", 2)]
    sizes = np.array([2.0, 9e3, 0.1, 12.0, 9e3])
    want = extrapolated(graph, u, names, sizes) * sizes
    assert np.abs(derivatives(graph, u, names, sizes) * sizes - want).max() <= 1e-9 * np.abs(want).max()


def test_a_loop_reads_the_derivatives_of_the_last_step():
    """y_k = plays of (u_k - 0.3 y_(k-1)): the recursion of derivatives, by differences of a loop in numpy."""
    u = np.cumsum(np.random.default_rng(6).normal(size=400)) * 0.1
    nodes = [
        hy.Node("e", "sum", {"n": 2}, {"k": [1.0, -0.3]}),
        hy.Node("p", "backlash_sum", {}, {"r": [0.2, 0.5], "w": [0.3, 0.4], "w0": 0.5, "z0": [0.0, 0.0]}),
        hy.Node("d", "delay", {"n": 1}, {"y0": 0.1}),
    ]
    wires = [("e.y", "p.u"), ("p.y", "d.u"), ("d.y", "e.u[2]")]
    graph = Graph(nodes, wires, [hy.Input("u", ("e.u[1]",))], [hy.Output("y", "p.y")])
    names = [("e.k", 1), ("p.r", 0), ("p.r", 1), ("p.w", 0), ("d.y0", 0)]
    order = sorted(range(5), key=lambda i: [n.name for n in graph.nodes].index(names[i][0][0]))
    names = [names[i] for i in order]
    want = extrapolated(graph, u, names, np.full(5, 0.1))
    error = np.abs(derivatives(graph, u, names, np.full(5, 0.1)) - want)
    assert np.quantile(error, 0.9) <= 1e-8 * np.abs(want).max()


@pytest.mark.turn("free parameters")
def test_a_graph_with_an_implicit_inverse_is_fitted():
    """The core has no sensitivities there: whole runs take their place."""
    rng = np.random.default_rng(7)
    t, y = multisine(rng, 400, 8.0)
    plays = hy.Node("p", "backlash_sum", {}, {"r": [0.2, 0.5], "w": [0.3, 0.4], "w0": 0.5, "z0": [0.0, 0.0]})
    inverse = hy.Node("i", "implicit_inverse", {}, {"lo": -9.0, "hi": 9.0})
    graph = Graph(
        [inverse, plays], [("i.u", "p.u"), ("p.y", "i.h")], [hy.Input("y", ("i.y",))], [hy.Output("u", "i.u")]
    )
    u = np.ravel(graph.run(y))
    start = graph.replace(plays.with_values(r=[0.15, 0.6]))
    model = hy.fit(hy.Dataset(t, y, u), start, free={"p.r[1]": (0.05, 0.3), "p.r[2]": (0.35, 0.9)}, starts=1)
    assert model.graph.node("p").value("r") == pytest.approx([0.2, 0.5], abs=1e-3)
