"""Makes the models in this folder: the two plants as they are, and what was identified from their noisy data.

    python scenarios/models/make_models.py

The identification sees only data: random nested reversals, 1 % noise, at rest between samples (no G0).  Its excitation,
thresholds and solver differ from the plant's, so that a scenario measures what a user would get.

The Bouc-Wen plant is also identified as a whole, from one broadband record with 0.1 % noise.  Its dynamics go to a
feed-forward, its static part to an implicit inverse.

Network inverses are trained on the response of the identified model to random reversals, with input and output
exchanged.  Bits of trained weights depend on the libraries of linear algebra; errors in the scenarios do not.
"""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np

from hystfmu.data import Dataset
from hystfmu.data.signals import training
from hystfmu.graph import Graph, Input, Node, Output
from hystfmu.identify import fit
from hystfmu.identify.estimate.dynamics import hysteresis
from hystfmu.inverse import inverse
from hystfmu.inverse.ports import over_range
from hystfmu.model import Model

HERE = Path(__file__).parent
OMEGA_N, ZETA = 2 * math.pi * 500, 0.7
G0 = {"b": [OMEGA_N**2], "a": [1.0, 2 * ZETA * OMEGA_N, OMEGA_N**2]}
# the same with a second mode, which hard draws let in; its gain is a share of that of the first
MODES = {"f_n": [500.0, 1500.0], "zeta": [ZETA, 0.01], "k": [1.0, 0.0]}
# ten full widths 0.1 .. 1 (Zhao & Tan 2008), linear term 0.3 of the sum of the weights: without it there is no inverse
BACKLASH = {"w0": 0.3, "r": np.linspace(0.1, 1, 10) / 2, "w": np.full(10, 0.1)}
# a piezo stack after Low & Guo 1995: displacement = d u - z, z the Bouc-Wen state; no play model can be exact for it
BOUC_WEN = {"A": 1.0, "beta": 1.0, "gamma": -0.2, "n": 1.0, "alpha": 0.0, "k": 1.0}
READOUT = {"k": [1.65, -0.77]}
REVERSALS = 200  # in the response that network inverses are trained on
REFERENCE = {"r": "reference", "dr": "its first derivative", "ddr": "its second derivative"}


def backlash(dynamics: bool) -> Graph:
    """Disturbance -> ten plays and a linear term -> G0."""
    nodes = [
        Node("add", "sum", {"n": 2}, {"k": [1.0, 1.0]}),
        Node("hysteresis", "backlash_sum", {}, BACKLASH),
    ]
    wires = [("add.y", "hysteresis.u")]
    return _plant(nodes, wires, "hysteresis.y", dynamics)


def drifting_backlash(plays: str = "plays", whole: str = "hysteresis") -> Graph:
    """Ten plays and a linear term, whose gain and weights of the plays change -> G0."""
    nodes = [
        Node(plays, "backlash_sum", {}, {**BACKLASH, "w0": 0.0}),
        Node("weights", "sum", {"n": 1}, {"offset": 1.0}),
        Node("weighted", "product", {"n": 2, "m": 0}),
        Node(whole, "sum", {"n": 2}, {"k": [1.0, BACKLASH["w0"]]}),
        Node("gain", "sum", {"n": 1}, {"offset": 1.0}),
        Node("changed", "product", {"n": 2, "m": 0}),
        Node("g0", "transfer_function", {"na": 2, "nb": 0}, G0),
    ]
    wires = [
        (f"{plays}.y", "weighted.u[1]"),
        ("weights.y", "weighted.u[2]"),
        ("weighted.y", f"{whole}.u[1]"),
        (f"{whole}.y", "changed.u[1]"),
        ("gain.y", "changed.u[2]"),
        ("changed.y", "g0.u"),
    ]
    inputs = [
        Input("u", (f"{plays}.u", f"{whole}.u[2]"), text="command, 1 is the nominal amplitude"),
        Input("g", ("gain.u[1]",), text="relative change of the gain"),
        Input("w", ("weights.u[1]",), text="relative change of the weights of the plays"),
    ]
    return Graph(nodes, wires, inputs, [Output("y", "g0.y", text="displacement, 1 is the nominal amplitude")])


def with_modes(plant: Graph) -> Graph:
    """The plant with a gain and two modes in the place of G0: what hard draws vary."""
    g0 = [Node("static", "scaling", {"n": 1}), Node("g0", "modes", {"n": 2}, MODES)]
    nodes = [m for n in plant.nodes for m in (g0 if n.name == "g0" else [n])]
    wires = [(a, "static.u" if b == "g0.u" else b) for a, b in plant.wires]
    return Graph(nodes, [*wires, ("static.y", "g0.u")], plant.inputs, plant.outputs)


def bouc_wen(dynamics: bool) -> Graph:
    """Disturbance -> linear term minus Bouc-Wen state -> G0."""
    nodes = [
        Node("add", "sum", {"n": 2}, {"k": [1.0, 1.0]}),
        Node("hysteresis", "bouc_wen", {}, BOUC_WEN),
        Node("readout", "sum", {"n": 2}, READOUT),
    ]
    wires = [("add.y", "hysteresis.u"), ("add.y", "readout.u[1]"), ("hysteresis.z", "readout.u[2]")]
    return _plant(nodes, wires, "readout.y", dynamics)


def _plant(nodes: list[Node], wires: list[tuple[str, str]], end: str, dynamics: bool) -> Graph:
    if dynamics:
        nodes = [*nodes, Node("g0", "transfer_function", {"na": 2, "nb": 0}, G0)]
        wires, end = [*wires, (end, "g0.u")], "g0.y"
    inputs = [
        Input("u", ("add.u[1]",), text="command, 1 is the nominal amplitude"),
        Input("d", ("add.u[2]",), text="disturbance at the actuator"),
    ]
    return Graph(nodes, wires, inputs, [Output("y", end, text="displacement, 1 is the nominal amplitude")])


def training_data(plant: Graph, name: str) -> Dataset:
    """100 random nested reversals with half cosines between them, 100 samples per cycle, 1 % noise."""
    reference = Node(
        "reference",
        "reference",
        {"m": 100},
        {"shape": "random_reversals", "amplitude": 1.3, "frequency": 1.0, "seed": 3},
    )
    h, n = 0.01, 5001
    u = Graph.single(reference).run(np.zeros((n, 0)), h)[:, 0]
    y = plant.run(np.column_stack([u, np.zeros(n)]), h)
    noise = np.random.default_rng(1).standard_normal(n)
    return Dataset.from_signal(u, y + 0.01 * np.abs(y).max() * noise, h, name)


def broadband_data(plant: Graph, name: str, seconds: float = 1.0) -> Dataset:
    """Sixty tones from 1 to 500 Hz at 10 kHz, from rest, each value held for a sample; 0.1 % noise."""
    h, finer = 1e-4, 10
    t = np.arange(round(seconds / h) + 1) * h
    f = np.geomspace(1, 500, 60)
    phases = np.random.default_rng(3).uniform(0, 2 * np.pi, len(f))
    u = np.minimum(1, t / 0.02) * (f**-0.25 @ np.sin(2 * np.pi * np.outer(f, t) + phases[:, None]))
    u *= 1.3 / min(u.max(), -u.min())  # mismatch in the loop needs more than the nominal amplitude
    held = np.append(u[0], np.repeat(u[1:], finer))
    y = plant.run(np.column_stack([held, 0 * held]), h / finer)[::finer]
    noise = np.random.default_rng(1).standard_normal(len(y))
    return Dataset.from_signal(u, y + 0.001 * np.ptp(y) * noise, h, name)


def broadband_models() -> tuple[Model, ...]:
    """The Bouc-Wen plant identified with its dynamics, their feed-forward, and two inverses of the static part."""
    data = broadband_data(bouc_wen(True), "bouc_wen: sixty tones to 500 Hz, 0.1 % noise")
    identified = fit(data, "g0_bouc_wen", hold="zoh")
    g0 = Node("g0", "feedforward", {}, {"f_n": identified.fit["f_n"], "zeta": identified.fit["zeta"]})
    inputs = [Input(name, (f"g0.{name}",), text=text) for name, text in REFERENCE.items()]
    chain = Graph([g0], [], inputs, [Output("v", "g0.v", text="wanted output of the hysteresis")])
    source = {"of": identified.provenance}
    text = "feed-forward of the dynamics of bouc_wen_g0_identified"
    feedforward = Model("feedforward", chain, None, text, {}, source)
    static = hysteresis(identified)
    return identified, feedforward, inverse(static, "implicit"), bank_inverse(static)


def exchanged(model: Model) -> Dataset:
    """Response of a model to random nested reversals over its input range, with input and output exchanged."""
    u = over_range(model, training(REVERSALS, 1))
    return Dataset.from_signal(model.predict(u), u, model.step, f"response of {model.key}, exchanged")


def bank_inverse(model: Model) -> Model:
    """Bank of 24 plays and a network that give the input of the model from its output."""
    return fit(exchanged(model), "play_bank_mlp", N=24, starts=4, decay=1e-6)


def zhao_tan_inverse(model: Model) -> Model:
    """Inverse operator and 2-12-1 network of Zhao & Tan 2008."""
    return fit(exchanged(model), "zhao_tan_mlp", operator="zhao_tan_inverse")


def save(model: Model, name: str) -> None:
    """Write a model without the seconds its fit took: the same run gives the same file."""
    fitted = {k: v for k, v in model.fit.items() if k != "seconds"}
    replace(model, fit=fitted).save(HERE / f"{name}.model.toml")


def write_broadband() -> None:
    """Write the models of `broadband_models`."""
    names = ("identified", "feedforward", "inverse", "learned_inverse")
    for model, name in zip(broadband_models(), names, strict=True):
        save(model, f"bouc_wen_g0_{name}")


def write_modes() -> None:
    """Write the plants of hard draws, which reach the plays of both under one name."""
    plants = {"backlash": backlash(True), "backlash_drifting": drifting_backlash("hysteresis", "whole")}
    for name, plant in plants.items():
        text = f"plant of hard draws: {name}, gain, two modes"
        save(Model("plant", with_modes(plant), None, text), f"{name}_modes_plant")


def main() -> None:
    """Write all models."""
    write_broadband()
    for name, plant in (("backlash", backlash), ("bouc_wen", bouc_wen)):
        text = f"reference plant: {plant.__doc__}"
        save(Model("plant", plant(True), None, text), f"{name}_plant")
        save(Model("plant", plant(False), None, f"{text.removesuffix(' -> G0.')}."), f"{name}_static")
        data = training_data(plant(False), f"{name}: 100 random reversals, 1 % noise")
        identified = fit(data, "prandtl_ishlinskii", N=20)
        save(identified, f"{name}_identified")
        save(bank_inverse(identified), f"{name}_learned_inverse")
        save(zhao_tan_inverse(identified), f"{name}_zhao_tan_inverse")
        if name == "backlash":  # one step of delay stands between command and plant
            learns = inverse(identified, "adaptive", f_n=500.0, zeta=ZETA, delay=1)
            save(learns, "backlash_adaptive_inverse")
    drifting = drifting_backlash()
    save(Model("plant", drifting, None, f"reference plant: {drifting_backlash.__doc__}"), "backlash_drifting_plant")
    write_modes()
    exact = Node("hysteresis", "prandtl_ishlinskii", {}, BACKLASH)
    save(Model("prandtl_ishlinskii", Graph.single(exact), None, "the backlash plant, known exactly"), "backlash_exact")


if __name__ == "__main__":
    main()
