"""Models made by hand for the export: every block of the library that no fit uses, and names that Modelica forbids."""

import numpy as np
from series import series

from hystfmu.graph import Graph, Input, Node, Output
from hystfmu.model import Model

OMEGA = 2 * np.pi * 20


def chain(*nodes: Node, step: float | None = 0.01) -> Model:
    """u -> first block -> ... -> y, by the first input and output of each."""
    return Model("made", series(*nodes), step, 'blocks in a "chain" \\ of <three> µm')


def large_network() -> Model:
    """More weights than a record takes, behind a bank; blocks with the names of keywords, ports and classes."""
    rng = np.random.default_rng(3)
    n = 250
    weights = {"W1": rng.normal(size=3 * n), "b1": rng.normal(size=n), "W2": rng.normal(size=n) / n}
    nodes = [
        Node("model", "play_bank", {"n": 3}, {"r": [0.1, 0.2, 0.4]}),
        Node("Ts", "mlp", {"n_in": 3, "n_hidden": n}, {**weights, "b2": 0.1, "activation": "tanh"}),
        Node("y", "scaling", {"n": 1}, {"gain": 2.0}),
    ]
    wires = [("model.z", "Ts.u"), ("Ts.y", "y.u")]
    return Model("made", Graph(nodes, wires, [Input("input", ("model.u",))], [Output("y", "y.y")]), 0.01)


def sources() -> Model:
    """Every source beside the input, with every shape of the reference."""
    shapes = {
        "sine": {}, "triangle": {"phase": 0.3}, "decaying_sine": {"decay": 0.4},
        "multisine": {"f": [1.0, 2.5], "a": [0.5, 0.2]}, "steps": {"levels": [0.2, -0.3, 0.5], "T": 0.5},
        "random_reversals": {"seed": 7},
    }  # fmt: skip
    nodes = [Node(k, "reference", {}, {"shape": k, **v}) for k, v in shapes.items()]
    nodes += [Node("w", "noise", {}, {"sigma": 0.1, "seed": 5}), Node("d", "disturbance", {}, {"step": 0.3})]
    wires = [(f"{n.name}.{n.block.of('output')[0].name}", f"total.u[{i + 2}]") for i, n in enumerate(nodes)]
    nodes.append(Node("total", "sum", {"n": len(nodes) + 1}))
    return Model("made", Graph(nodes, wires, [Input("u", ("total.u[1]",))], [Output("y", "total.y")], sort=False), 0.01)


def static_forms() -> Model:
    """Every block that has a static form, side by side, between u and h of one implicit inverse."""
    rng = np.random.default_rng(4)
    weights = {"W1": rng.normal(size=12), "b1": rng.normal(size=4), "W2": 0.1 * rng.normal(size=8), "b2": [0.1, 0.2]}
    lone = [
        Node("pi", "prandtl_ishlinskii", {"n": 2, "depth": 8}, {"w0": 0.5, "r": [0.1, 0.2], "u0": 0.1}),
        Node("plays", "backlash_sum", {"n": 2}, {"w0": 0.3, "r": [0.05, 0.3], "w": [0.2, 0.1], "z0": [0.01, 0.2]}),
        Node("zt", "zhao_tan", {"depth": 8}, {"x0": 0.1}),
        Node("last", "zhao_tan", {"depth": 8}, {"memory": "last"}),
        Node("ma", "constraint_factor", {"m": 2, "depth": 8}, {"a0": 0.2, "a": [0.5, 0.1]}),
        Node("kp", "krasnoselskii_pokrovskii", {"n": 2, "depth": 8}, {"lo": -0.6, "hi": 0.8, "u0": -0.2,
             "w": [0.1, 0.05, 0.2], "offset": 1.0}),
        Node("low", "preisach", {"n": 2, "depth": 8}, {"E": [0.2, 0.7, 0.3], "lo": -1.0, "hi": 1.0, "start": "low"}),
        Node("virgin", "preisach", {"n": 2, "depth": 8}, {"E": [0.2, 0.7, 0.3], "lo": -1.0, "hi": 1.0}),
        Node("bw", "bouc_wen", {}, {"beta": 0.8, "z0": 0.1}),
        Node("ch", "coleman_hodgdon", {}, {"alpha": 2.0, "b": 0.5, "k": 0.3, "y0": 0.1, "u0": -0.1}),
        Node("du", "duhem", {"m": 1, "q": 1}, {"a_rise": [0.5, 0.1], "b_rise": [-0.5, 0.0], "c_rise": [-0.5, 0.0],
             "a_fall": [0.5, 0.1], "b_fall": [0.5, 0.0], "c_fall": [-0.5, 0.0], "w_max": 1.0, "du_max": 0.2}),
        Node("ja", "jiles_atherton", {"steps": 2}, {"c": 0.2, "alpha": 0.3, "m0": 0.05, "u0": 0.1}),
        Node("zones", "dead_zones", {"n": 2}, {"r": [-0.3, 0.4], "w": [0.3, 0.2]}),
    ]  # fmt: skip
    bank = Node("bank", "play_bank", {"n": 2}, {"r": [0.1, 0.2], "z0": [0.1, 0.0]})
    net = Node("net", "mlp", {"n_in": 3, "n_hidden": 4, "n_out": 2}, {**weights, "activation": "tanh"})
    scale = Node("scale", "scaling", {"n": 2}, {"gain": [0.5, 2.0], "offset": [0.1, 0.2], "hi": [0.4, 9.0]})
    total = Node("total", "sum", {"n": len(lone) + 2}, {"offset": 0.3})
    nodes = [Node("state", "implicit_inverse", {}, {"lo": -1.2, "hi": 1.1}), *lone, bank, net, scale, total]
    wires = [("state.u", f"{n.name}.{n.block.of('input')[0].name}") for n in [*lone, bank]]
    wires += [(f"{n.name}.{n.block.of('output')[0].name}", f"total.u[{i + 1}]") for i, n in enumerate(lone)]
    wires += [("bank.z[1]", "net.u[1]"), ("bank.z[2]", "net.u[2]"), ("state.u", "net.u[3]"), ("net.y", "scale.u")]
    wires += [(f"scale.y[{k + 1}]", f"total.u[{len(lone) + k + 1}]") for k in range(2)]
    wires += [("total.y", "state.h")]
    first, last = Node("first", "scaling", {"n": 1}, {"gain": 6.0}), Node("d", "delay")
    wires += [("first.y", "state.y"), ("state.u", "d.u")]
    ports = [Input("u", ("first.u",))], [Output("y", "d.y")]
    return Model("made", Graph([first, *nodes, last], wires, *ports, sort=False), 0.01)


def implicit_inverse_in_use() -> Model:
    """A model that is tried and used as well: it stands in the package of the inverse and as a component."""
    nodes = [
        Node("inverse", "implicit_inverse"),
        Node("plays", "backlash_sum", {"n": 2}, {"w0": 0.4}),
        Node("g", "scaling", {"n": 1}),
    ]
    wires = [("inverse.u", "plays.u"), ("plays.y", "inverse.h"), ("plays.y", "g.u[1]")]
    return Model("made", Graph(nodes, wires, [Input("u", ("inverse.y",))], [Output("y", "g.y[1]")], sort=False), 0.01)


MADE = {
    "implicit_inverse_in_use": implicit_inverse_in_use,
    "large_network": large_network,
    "sources": sources,
    "inverses": lambda: chain(
        Node("a", "prandtl_ishlinskii_inverse", {"n": 2}), Node("b", "zhao_tan_inverse"),
        Node("c", "zhao_tan_inverse_reconstructed"), Node("d", "delay", {"n": 2}), Node("e", "differentiator"),
    ),
    "controllers": lambda: chain(
        Node("hysteresis", "backlash_sum", {"n": 2}, {"w0": 0.5}), Node("feed", "feedforward", {}, {"f_n": 5.0}),
        Node("pid", "pid", {}, {"Kp": 1.0}),
        Node("smc", "sliding_mode", {}, {"switching": "saturation", "eta": 1e-3, "rho": 0.01}),
        Node("sta", "super_twisting", {}, {"mu": 0.2, "k_1": 0.01, "k_2": 0.1}),
        Node("leads", "lead_lag", {"n": 2}, {"T_p": [0.2, 0.5], "K": 1.0}),
        Node("ilc", "iterative_learning", {"n": 7}, {"lead": 2, "gain": 0.5}), Node("observer", "disturbance_observer"),
    ),
    "dynamics": lambda: chain(
        Node("g0", "transfer_function", {}, {"a": [1, 75, OMEGA**2], "b": [0.01, OMEGA**2], "start": "steady"}),
        Node("g1", "transfer_function", {}, {"a": [0.02, 1, 0], "b": [1.0]}),
    ),
    "in_range": lambda: chain(
        Node("twice", "scaling", {"n": 1}, {"gain": 2.0}), Node("inside", "in_range", {}, {"lo": -0.3, "hi": 0.2})
    ),
    "nfir_without_auxiliary": lambda: chain(Node("network", "polynomial_narx", {"n_f": 0, "n_y": 2, "q": 3})),
}  # fmt: skip
