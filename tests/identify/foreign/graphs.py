"""Foreign devices as graphs of the kit: true values and free parameters, for those that its blocks can express.

The functions take the numbers that the device of the same name draws, in this order.
"""

from collections.abc import Callable
from itertools import pairwise
from typing import Any

import numpy as np

import hystfmu as hy

PLAYS = 10  # thresholds, then as many weights, are the first numbers of devices with plays
Wires = list[tuple[str, str]]
Made = tuple[hy.Graph, dict[str, Any]]


def _graph(nodes: list[hy.Node], wires: Wires, last: str, **inputs: tuple[str, ...]) -> hy.Graph:
    listed = [hy.Input(name, ends) for name, ends in inputs.items()]
    return hy.Graph(nodes, wires, listed, [hy.Output("y", f"{last}.y")])


def _chain(*nodes: hy.Node) -> hy.Graph:
    names = [node.name for node in nodes]
    wires = [(f"{a}.y", f"{b}.u") for a, b in pairwise(names)]
    return _graph(list(nodes), wires, names[-1], u=(f"{names[0]}.u",))


def _plays(own: float, drawn: tuple[float, ...]) -> hy.Node:
    """(own u + sum w_i play_i) / 10."""
    r, w = np.sort(drawn[:PLAYS]), np.array(drawn[PLAYS:])
    return hy.Node("plays", "backlash_sum", {}, {"w0": own / PLAYS, "r": r, "w": w / PLAYS, "z0": np.zeros(PLAYS)})


def _filter(name: str, b: float, *a: float) -> hy.Node:
    """b / (a_0 s^n + .. + a_n) of ramps between rows, as the devices have it."""
    return hy.Node(name, "transfer_function", {}, {"b": [b], "a": a, "hold": "foh", "start": "steady"})


def _mode(name: str, f: float, zeta: float, gain: float = 1.0) -> hy.Node:
    w = 2 * np.pi * f
    return _filter(name, gain * w * w, 1.0, 2 * zeta * w, w * w)


OF_PLAYS = {"plays.w0": True, "plays.w": (0.0, np.inf), "plays.r": {"lower": 0.0, "upper": 1.0, "rising": True}}


def _late(rows: float, wires: Wires, source: str) -> list[hy.Node]:
    """A delay of whole rows and of the next number of rows, mixed; their wires are added."""
    whole, nodes = int(rows), [hy.Node("late", "sum", {"n": 2}, {"k": [1 - rows % 1, rows % 1]})]
    for k, n in enumerate((whole, whole + 1), 1):
        if n:
            nodes.append(hy.Node(f"delay{k}", "delay", {"n": n}))
            wires.append((source, f"delay{k}.u"))
        wires.append((f"delay{k}.y" if n else source, f"late.u[{k}]"))
    return nodes


def coleman_hodgdon(zeta: float, a: float, b: float, c: float) -> Made:
    """Operator, mode, delay."""
    operator = hy.Node("operator", "coleman_hodgdon", {}, {"alpha": a, "b": b, "k": c})
    free = ("operator.alpha", "operator.b", "operator.k", "mode.a[2]")
    return _chain(operator, _mode("mode", 250.0, zeta), hy.Node("delay", "delay", {"n": 2})), dict.fromkeys(free, True)


def battery(g: float, M: float, k: float, c: float) -> Made:
    """A tanh, a cube, a line and one state side by side; Bouc-Wen with A = 1 is 1 / g of the state."""
    nodes = [
        hy.Node("tanh", "mlp", {"n_hidden": 1}, {"W1": [k], "activation": "tanh"}),
        hy.Node("cube", "product", {"n": 3, "m": 0}),
        hy.Node("state", "bouc_wen", {}, {"beta": g, "gamma": 0.0, "alpha": 0.0}),
        hy.Node("out", "sum", {"n": 4}, {"k": [1 / k, c, 0.3, M * g]}),
    ]
    wires = [("tanh.y", "out.u[1]"), ("cube.y", "out.u[2]"), ("state.z", "out.u[4]")]
    ends = ("tanh.u", "cube.u[1]", "cube.u[2]", "cube.u[3]", "state.u", "out.u[3]")
    return _graph(nodes, wires, "out", u=ends), {"tanh.W1": True, "state.beta": True, "out.k": True}


def jiles_atherton(a: float, k: float, c: float, T: float, alpha: float) -> Made:
    """Operator and a lag."""
    operator = hy.Node("operator", "jiles_atherton", {}, {"a": a, "k": k, "c": c, "alpha": alpha})
    free = (*(f"operator.{name}" for name in ("a", "k", "c", "alpha")), "lag.a[1]")
    return _chain(operator, _filter("lag", 1.0, T, 1.0)), dict.fromkeys(free, True)


def ipmc(*drawn: float) -> Made:
    """Plays and two lags of opposite signs."""
    fast, slow, share = drawn[2 * PLAYS :]
    nodes = [
        _plays(2.0, drawn[: 2 * PLAYS]),
        _filter("fast", 1.0, fast, 1.0),
        _filter("slow", 1.0, slow, 1.0),
        hy.Node("out", "sum", {"n": 2}, {"k": [1.0, -share]}),
    ]
    wires = [("plays.y", "fast.u"), ("plays.y", "slow.u"), ("fast.y", "out.u[1]"), ("slow.y", "out.u[2]")]
    free = {**OF_PLAYS, "fast.a[1]": True, "slow.a[1]": True, "out.k[2]": True}
    return _graph(nodes, wires, "out", u=("plays.u",)), free


def mr_damper(c_0: float, c_1: float, k_0: float, k_1: float, alpha: float, A: float, beta: float) -> Made:
    """One block; the scale of z is held, because only alpha z has an effect."""
    values = {"c_0": c_0, "c_1": c_1, "k_0": k_0, "k_1": k_1, "alpha": alpha, "A": A, "beta": beta, "gamma": beta}
    free = ("c_0", "c_1", "k_0", "k_1", "alpha", "beta", "gamma")
    damper = hy.Node("damper", "modified_bouc_wen", {}, values)
    return _chain(damper), {f"damper.{name}": True for name in free}


def bouc_wen_g0(beta: float, share: float, n: float, a: float, f: float, zeta: float, rows: float) -> Made:
    """Operator beside a line, mode, delay."""
    wires = [("operator.z", "mix.u[2]"), ("mix.y", "mode.u")]
    nodes = [
        hy.Node("operator", "bouc_wen", {}, {"beta": beta * (1 - share), "gamma": beta * share, "n": n, "alpha": 0.0}),
        hy.Node("mix", "sum", {"n": 2}, {"k": [a, 1.0]}),
        _mode("mode", f, zeta),
        *_late(rows, wires, "mode.y"),
    ]
    free = ("operator.beta", "operator.gamma", "operator.n", "mix.k[1]", "mode.a[2]", "mode.a[3]", "late.k")
    return _graph(nodes, wires, "late", u=("operator.u", "mix.u[1]")), dict.fromkeys(free, True)


def two_modes(*drawn: float) -> Made:
    """Plays, two modes, delay."""
    f, zeta, share = drawn[2 * PLAYS :]
    wires = [("plays.y", "first.u"), ("plays.y", "second.u"), ("first.y", "mix.u[1]"), ("second.y", "mix.u[2]")]
    nodes = [
        _plays(3.0, drawn[: 2 * PLAYS]), _mode("first", f, zeta), _mode("second", 2.7 * f, zeta),
        hy.Node("mix", "sum", {"n": 2}, {"k": [1 - share, share]}), *_late(1.3, wires, "mix.y"),
    ]  # fmt: skip
    dynamics = [f"{mode}.a[{k}]" for mode in ("first", "second") for k in (2, 3)]
    free = {**OF_PLAYS, **dict.fromkeys((*dynamics, "mix.k[2]", "late.k[2]"), True)}
    return _graph(nodes, wires, "late", u=("plays.u",)), free


def elastomer(*drawn: float) -> Made:
    """Square of the voltage about a bias, and three lags of known times."""
    *share, bias = drawn
    nodes = [
        hy.Node("voltage", "scaling", {}, {"gain": [bias], "offset": [1.0]}),
        hy.Node("square", "product", {"n": 2, "m": 0}),
        *(_filter(f"lag{k}", 1.0, T, 1.0) for k, T in enumerate((0.05, 0.4, 3.0), 2)),
        hy.Node("out", "sum", {"n": 4}, {"k": [0.25, *(w / 4 for w in share)]}),
    ]
    wires = [("voltage.y", "square.u[1]"), ("voltage.y", "square.u[2]"), ("square.y", "out.u[1]")]
    wires += [wire for k in (2, 3, 4) for wire in (("square.y", f"lag{k}.u"), (f"lag{k}.y", f"out.u[{k}]"))]
    return _graph(nodes, wires, "out", u=("voltage.u",)), {"voltage.gain": True, "out.k": True}


def warm_stack(*drawn: float) -> Made:
    """Plays and their square times a gain that follows T, beside the load."""
    bend, warm, load = drawn[2 * PLAYS :]
    nodes = [
        _plays(3.0, drawn[: 2 * PLAYS]),
        hy.Node("square", "product", {"n": 2, "m": 0}),
        hy.Node("bent", "sum", {"n": 2}, {"k": [1.0, bend]}),
        hy.Node("gain", "sum", {"n": 1}, {"k": [warm], "offset": 1.0}),
        hy.Node("warm", "product", {"n": 2, "m": 0}),
        hy.Node("out", "sum", {"n": 2}, {"k": [1.0, load]}),
    ]
    wires = [("plays.y", to) for to in ("square.u[1]", "square.u[2]", "bent.u[1]")]
    wires += [("square.y", "bent.u[2]"), ("bent.y", "warm.u[1]"), ("gain.y", "warm.u[2]"), ("warm.y", "out.u[1]")]
    free = {**OF_PLAYS, "bent.k[2]": True, "gain.k": True, "out.k[2]": True}
    return _graph(nodes, wires, "out", u=("plays.u",), T=("gain.u",), load=("out.u[2]",)), free


GRAPHS: dict[str, Callable[..., Made]] = {
    "Coleman-Hodgdon piezo, mode, delay": coleman_hodgdon, "battery, one state": battery,
    "Jiles-Atherton, eddy lag": jiles_atherton, "IPMC, back-relaxation": ipmc, "Spencer's MR damper": mr_damper,
    "Bouc-Wen + G0": bouc_wen_g0, "plays + two modes": two_modes, "dielectric elastomer": elastomer,
    "stack, temperature and load": warm_stack,
}  # fmt: skip
