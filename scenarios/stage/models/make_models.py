"""Makes the models of the nanopositioning stage: the plant, and what is identified from one noisy record of it.

    python scenarios/stage/models/make_models.py

Plant, from the command (V) to the position (um): an amplifier with limits, ten plays and a linear term, a bend, creep
as three lags one decade apart, two lightly damped modes.  A stroke of 20 um needs about 106 V.  The actuator (three
lags, eight terms of the bend, forty plays) is identified from slow nested reversals with the noise of the sensor;
natural frequencies and damping are those of a data sheet: 500 Hz and 1.6 kHz, 0.02 and 0.01.  They give the
feed-forward of the scans in scans.toml.
"""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np

from hystfmu.data import Dataset
from hystfmu.design import scan_feedforward
from hystfmu.graph import Graph, Input, Node, Output
from hystfmu.identify import fit, fit_graph
from hystfmu.inverse import inverse
from hystfmu.model import Model

HERE = Path(__file__).parent
PLAYS = {"w0": 0.05, "r": np.linspace(2.5, 25, 10), "w": np.full(10, 0.016)}
CHARGE = {**PLAYS, "w0": 0.194, "w": np.full(10, 0.0016)}  # a tenth of the hysteresis at the same slope
BEND = [1.04, -0.002, 0.0]  # v, v^2 (1/um), constant
CREEP = {"w0": 1.0, "w": [0.008, 0.008, 0.008], "T": [0.1, 1.0, 10.0]}
BOUC_WEN = {"beta": 0.016, "gamma": -0.0032}  # 1/V
READOUT = [0.24, -0.095]  # um/V of the command and of the Bouc-Wen state
MODES = {"f_n": [500.0, 1600.0], "zeta": [0.02, 0.01], "k": [0.9, 0.1]}
NOISE = 20e-6 * np.sqrt(5000)  # um: 20 pm/sqrt(Hz) up to half the rate of 10 kHz
HYSTERESIS = "hysteresis"


def plant(dynamics: bool, plays: dict[str, object] = PLAYS, creep: float = 1.0) -> Graph:
    """Amplifier -> plays and a linear term -> bend -> creep -> two modes."""
    nodes = [
        Node(HYSTERESIS, "backlash_sum", {"n": 10}, plays),
        Node("bend", "polynomial_narx", {"n_u": 1, "n_f": 0, "n_y": 0, "q": 2, "n_k": 0}, {"theta": BEND}),
        Node("creep", "creep", {"n": 3}, {**CREEP, "w": [creep * w for w in CREEP["w"]]}),
    ]
    wires, end = [(f"{HYSTERESIS}.y", "bend.u"), ("bend.y", "creep.u")], "creep.y"
    if dynamics:
        nodes = [Node("amplifier", "amplifier"), *nodes, Node("g0", "modes", {"n": 2}, MODES)]
        wires, end = [("amplifier.y", f"{HYSTERESIS}.u"), *wires, (end, "g0.u")], "g0.y"
    first = nodes[0].name
    inputs = [Input("u", (f"{first}.u",), text="command of the amplifier", unit="V")]
    return Graph(nodes, wires, inputs, [Output("y", end, text="position", unit="um")])


def bouc_wen(dynamics: bool, hysteresis: dict[str, float] = BOUC_WEN) -> Graph:
    """Amplifier -> linear term minus Bouc-Wen state -> creep -> two modes: the stage of another actuator."""
    nodes = [
        Node(HYSTERESIS, "bouc_wen", {}, hysteresis),
        Node("readout", "sum", {"n": 2}, {"k": READOUT}),
        Node("creep", "creep", {"n": 3}, {**CREEP, "start": "steady"}),
    ]
    wires = [(f"{HYSTERESIS}.z", "readout.u[2]"), ("readout.y", "creep.u")]
    ends, end = (f"{HYSTERESIS}.u", "readout.u[1]"), "creep.y"
    if dynamics:
        nodes = [Node("amplifier", "amplifier"), *nodes, Node("g0", "modes", {"n": 2}, MODES)]
        wires, end = [*(("amplifier.y", e) for e in ends), *wires, (end, "g0.u")], "g0.y"
        ends = ("amplifier.u",)
    inputs = [Input("u", ends, text="command of the amplifier", unit="V")]
    return Graph(nodes, wires, inputs, [Output("y", end, text="position", unit="um")])


def bouc_wen_inverse() -> Model:
    """Identify the other actuator in its own class, with creep, and invert it at the rate of the loop."""
    free = {
        f"{HYSTERESIS}.beta": (0.004, 0.06),
        f"{HYSTERESIS}.gamma": (-0.02, 0.02),
        "readout.k": True,
        "creep.w": True,
    }
    found = fit_graph(record(bouc_wen(False)), bouc_wen(False, {"beta": 0.01, "gamma": 0.0}), free)
    return inverse(replace(found, step=H), "implicit", lo=-100.0, hi=250.0)


def record(device: Graph | None = None) -> Dataset:
    """Three minutes of nested reversals between 0 and 125 V at 1 Hz, 50 rows a second."""
    h, n = 0.02, 9001
    values = {"shape": "random_reversals", "amplitude": 62.5, "offset": 62.5, "frequency": 1.0, "seed": 5}
    u = Graph.single(Node("reference", "reference", {"m": 400}, values)).run(np.zeros((n, 0)), h)[:, 0]
    u *= np.minimum(1, np.arange(n) * h)  # from rest
    y = (device or plant(False)).run(u, h)
    noise = np.random.default_rng(1).standard_normal(n)
    return Dataset.from_signal(u, y + NOISE * noise, h, "stage: random reversals, noise of the sensor")


H, DELAY = 1e-4, 1.0  # of the loop
SCANS = {10: (0.2, 0.1), 50: (0.2, 0.12), 100: (0.2, 0.15), 200: (0.15, 0.125)}  # Hz: end of the run, of the transient
TURN, HIGHEST, TONES = 0.1, 1200.0, 25
HEAD = """# Written by models/make_models.py: the scans, each with the tones that modes, delay and hold call for.
extends = "loop.toml"

[units.feedforward]
block = "reference"
dims = { m = 25 }
values = { shape = "multisine", amplitude = 10.0, offset = 10.0 }
text = "the scan through the inverse of the modes, up to 1.2 kHz: hystfmu.design.scan_feedforward"
"""
OTHERS = """[[case]]
name = "low_100"
text = "triangle at 100 Hz; modes 20 % lower, weights 20 % up"
stop = 0.2
after = 0.15
set = {{ {tones}, "plant.g0_f_n" = "*0.8", "plant.hysteresis_w" = "*1.2" }}

[[case]]
name = "high_100"
text = "triangle at 100 Hz; modes 20 % higher, weights 20 % down"
stop = 0.2
after = 0.15
set = {{ {tones}, "plant.g0_f_n" = "*1.2", "plant.hysteresis_w" = "*0.8" }}

[[case]]
name = "two_steps_100"
text = "triangle at 100 Hz, one more step of delay than the design considers"
stop = 0.2
after = 0.15
set = {{ {tones}, "delay.n" = 2 }}

[[case]]
name = "staircase"
text = "ten steps of 2 um, 20 ms each"
stop = 0.22
set = {{ "reference.shape" = "steps", "reference.amplitude" = 1, "reference.offset" = 0, "reference.T" = 0.02 }}
units.feedforward = {{ block = "reference", dims = {{ m = 11 }}, values = {{ shape = "steps", T = 0.02, levels = {levels} }} }}

[[case]]
name = "slow"
text = "triangle at 0.5 Hz: the error is the noise of the position"
stop = 0.2
after = 0.1
set = {{ "reference.frequency" = 0.5 }}
units.feedforward = {{ block = "reference", dims = {{ m = 1 }}, values = {{ shape = "triangle", amplitude = 10.0, offset = 10.0, frequency = 0.5, phase = -1.5707963267948966, turn = 0.1, lead = 1.5e-4 }} }}
"""  # noqa: E501


def scan(f: float) -> dict[str, str]:
    """Return the settings of one scan."""
    nodes = [Node("amplifier", "amplifier"), Node("g0", "modes", {"n": 2}, MODES)]
    dynamics = Graph(nodes, [("amplifier.y", "g0.u")], [Input("u", ("amplifier.u",))], [Output("y", "g0.y")])
    highest = min(HIGHEST, 2 * TONES * f)
    tones = scan_feedforward(dynamics, f, H, turn=TURN, phase=-math.pi / 2, delay=DELAY, highest=highest)
    tones["ph"] = np.angle(np.exp(1j * tones["ph"]))
    padded = {k: np.append(v, np.zeros(TONES - len(v))) for k, v in tones.items()}
    return {f"feedforward.{k}": "[" + ", ".join(f"{float(x):.10g}" for x in v) + "]" for k, v in padded.items()}


def write_scans() -> None:
    """Write scans.toml."""
    lines = [HEAD]
    for f, (stop, after) in SCANS.items():
        lines += [
            "[[case]]",
            f'name = "scan_{f}"',
            f'text = "triangle at {f} Hz"',
            f"stop = {stop}",
            f"after = {after}",
        ]
        settings = ", ".join(f'"{k}" = {v}' for k, v in scan(float(f)).items())
        lines += [f'set = {{ "reference.frequency" = {f}, {settings} }}', ""]
    tones = ", ".join(f'"{k}" = {v}' for k, v in scan(100.0).items())
    lines.append(OTHERS.format(tones=tones, levels=[2.0 * k for k in range(11)]))
    stop, after = SCANS[100]
    for name, more in (
        ("scan", ""),
        ("low", ', "bouc_wen_low"'),
        ("high", ', "bouc_wen_high"'),
        ("two_steps", ', "two_steps"'),
    ):
        lines += ["", "[[case]]", f'name = "bouc_wen_{name}_100"', f'conditions = ["scan_100", "bouc_wen"{more}]']
    lines += [
        "",
        "# of the cases above and in hard.toml",
        "[conditions.scan_100]",
        'text = "triangle at 100 Hz"',
        f"stop = {stop}",
        f"after = {after}",
    ]
    lines += [f"set = {{ {tones} }}", ""]
    (HERE.parent / "scans.toml").write_text("\n".join(lines))


def gain(w0: float, name: str) -> None:
    """Write a gain in um/V as a hysteresis without plays. Its inverse replaces the inverse of the actuator."""
    node = Node("gain", "prandtl_ishlinskii", {"n": 1}, {"w0": w0, "r": [0.0], "w": [0.0]})
    graph = Graph([node], [], [Input("u", ("gain.u",), unit="V")], [Output("y", "gain.y", unit="um")])
    Model("prandtl_ishlinskii", graph, None, "mean gain from V to um").save(HERE / f"{name}.model.toml")


def main() -> None:
    """Write all models."""
    gain(20 / 106, "gain")
    gain(20 / 98, "charge_gain")
    write_scans()
    Model("plant", plant(True), None, f"stage: {plant.__doc__}").save(HERE / "plant.model.toml")
    text = "stage with a charge drive: a tenth of the hysteresis, three times the creep"
    Model("plant", plant(True, CHARGE, 3.0), None, text).save(HERE / "charge_plant.model.toml")
    Model("bouc_wen_plant", bouc_wen(True), None, f"stage: {bouc_wen.__doc__}").save(HERE / "bouc_wen_plant.model.toml")
    save(bouc_wen_inverse(), "bouc_wen_inverse")
    save(fit(record(), "actuator", dynamics="no"), "actuator")


def save(model: Model, name: str) -> None:
    """Write a model without the seconds that its fit took: the same run gives the same file."""
    replace(model, fit={k: v for k, v in model.fit.items() if k != "seconds"}).save(HERE / f"{name}.model.toml")


if __name__ == "__main__":
    main()
