"""Makes the plant of this folder, its record, and the inverse of what `hystfmu fit` identifies from that record.

    python scenarios/magnetostrictive/models/make_models.py
    hystfmu fit scenarios/magnetostrictive/record.csv --model g0_jiles_atherton --set strain=yes --set hold=zoh \\
        -o scenarios/magnetostrictive/models/identified.model.toml --force
    python scenarios/magnetostrictive/models/make_models.py

The fit sees the rows of the record only.  Its class is not that of the plant: here eddy currents delay the field before
the hysteresis, the model has all of its dynamics and a delay behind it.
"""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np

from hystfmu.data import Dataset
from hystfmu.graph import Graph, Input, Node, Output
from hystfmu.identify.estimate.dynamics import hysteresis
from hystfmu.inverse import inverse
from hystfmu.model import Model

HERE = Path(__file__).parent
OMEGA_N, ZETA = 2 * math.pi * 500, 0.7
EDDY = 5e-5  # s: mu sigma a^2 / 5.78 of a rod of radius a (Engdahl 2000); 5 mm, mu_r = 5.5, 1.7e6 S/m
BIAS, SWING = 1.0, 0.5  # fields of magnet and current, relative to that of the magnet
MAGNET = {"Ms": 1.0, "a": 0.8, "k": 0.1, "c": 0.2, "alpha": 0.1}


def plant() -> Graph:
    """Disturbance -> coil and magnet -> eddy currents -> Jiles-Atherton -> strain, the square of M -> G0."""
    eddy = {"b": [1 / EDDY], "a": [1.0, 1 / EDDY], "start": "steady"}
    g0 = {"b": [OMEGA_N**2], "a": [1.0, 2 * ZETA * OMEGA_N, OMEGA_N**2], "start": "steady"}
    nodes = [
        Node("add", "sum", {"n": 2}, {"k": [1.0, 1.0]}),
        Node("coil", "scaling", {"n": 1}, {"gain": SWING, "offset": BIAS}),
        Node("eddy", "transfer_function", {"na": 1, "nb": 0}, eddy),
        Node("hysteresis", "jiles_atherton", {}, MAGNET),
        Node("square", "product", {"n": 2, "m": 0}),
        Node("strain", "scaling", {"n": 1}, {"gain": 10.0, "offset": -1.58}),
        Node("g0", "transfer_function", {"na": 2, "nb": 0}, g0),
    ]
    wires = [("add.y", "coil.u"), ("coil.y", "eddy.u"), ("eddy.y", "hysteresis.u")]
    wires += [("hysteresis.y", "square.u[1]"), ("hysteresis.y", "square.u[2]"), ("square.y", "strain.u")]
    wires += [("strain.y", "g0.u")]
    inputs = [
        Input("u", ("add.u[1]",), text="current, 1 is the nominal amplitude"),
        Input("d", ("add.u[2]",), text="disturbance at the current"),
    ]
    return Graph(nodes, wires, inputs, [Output("y", "g0.y", text="displacement, 1 is the nominal amplitude")])


def record() -> Dataset:
    """Sixty tones from 4 to 500 Hz at 10 kHz, from rest, each value held for a sample; noise of 0.1 % of the span."""
    h, finer = 1e-4, 10
    t = np.arange(3001) * h
    f = np.geomspace(4, 500, 60)
    phases = np.random.default_rng(3).uniform(0, 2 * np.pi, len(f))
    u = np.minimum(1, t / 0.02) * (f**-0.25 @ np.sin(2 * np.pi * np.outer(f, t) + phases[:, None]))
    u = np.round(u * 1.4 / min(u.max(), -u.min()), 5)
    held = np.append(u[0], np.repeat(u[1:], finer))
    y = plant().run(np.column_stack([held, 0 * held]), h / finer)[::finer]
    noise = np.random.default_rng(1).standard_normal(len(y))
    return Dataset.from_signal(u, np.round(y + 0.001 * np.ptp(y) * noise, 5), h, "record of the rod")


def save(model: Model, name: str) -> None:
    """Write a model."""
    model.save(HERE / f"{name}.model.toml")


def main() -> None:
    """Write plant and record; drop the statistics of an identified model and write the inverse of its static part."""
    save(Model("plant", plant(), None, f"reference plant: {plant.__doc__}"), "plant")
    data = record()
    rows = zip(data.t, data.u, data.y, strict=True)
    lines = ["t [s],u,y", *(f"{t:.4f},{u:.5f},{y:.5f}" for t, u, y in rows)]
    (HERE.parent / "record.csv").write_text("\n".join(lines) + "\n")
    if (HERE / "identified.model.toml").exists():
        model = Model.load(HERE / "identified.model.toml")
        told = {k: v for k, v in model.fit.items() if not isinstance(v, dict) and k != "seconds"}
        save(replace(model, fit=told), "identified")
        save(inverse(hysteresis(model), "implicit"), "inverse")


if __name__ == "__main__":
    main()
