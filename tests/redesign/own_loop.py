"""A loop of a user: plays, a light mode, a delay, an integral; and its mode behind a held command, by hand."""

import numpy as np
from click.testing import CliRunner, Result

import hystfmu as hy
from hystfmu.cli import main

H, F_N, ZETA, KI, LATE = 1e-4, 700.0, 0.04, 90.0, 1
N = 100  # steps in a period
SLOPES = (0.8, 1.25)


def plant(f: float = 1.0) -> hy.Graph:
    """Plays, then a mode whose natural frequency differs by a factor f."""
    w = 2 * np.pi * F_N * f
    return hy.Graph(
        [
            hy.Node("plays", "prandtl_ishlinskii", {"n": 2}, {"w0": 0.7, "r": [0.1, 0.4], "w": [0.2, 0.1]}),
            hy.Node("mode", "transfer_function", {"nb": 0, "na": 2}, {"b": [w**2], "a": [1.0, 2 * ZETA * w, w**2]}),
        ],
        [("plays.y", "mode.u")],
        [hy.Input("volts", ("plays.u",))],
        [hy.Output("gap", "mode.y")],
    )


def loop(f: float = 1.0, periods: int = 3) -> hy.Scenario:
    """An integral around the inverse of the plays; no unit has the name that `hystfmu start` would give it."""
    plays = hy.Graph.single(hy.Node("plays", "prandtl_ishlinskii", {"n": 2}, dict(plant().nodes[0].values)))
    made = hy.Scenario("stage", step=H, stop=periods * N * H)
    made.add("device", plant(f)).add("gauge", hy.blocks.Scaling(), text="unity").add(
        "wanted", hy.blocks.Reference(frequency=1 / (N * H), amplitude=0.8, shape="triangle", turn=0.3)
    )
    made.add("law", hy.blocks.Pid(Kp=0.0, Ki=KI)).add("undo", hy.Model("inverse", _inverse(plays), H))
    made.add("computing", hy.blocks.Delay(n=LATE))
    for source, target in (
        ("device.gap", "gauge.u"),
        ("gauge.y", "law.y"),
        ("wanted.r", "law.y_d"),
        ("wanted.r", "law.u_ff"),
        ("law.u", "undo.v"),
        ("undo.volts", "computing.u"),
        ("computing.y", "device.volts"),
    ):
        made.connect(source, target)
    made.metric("miss", "rms_percent", "device.gap", "wanted.r", limit=20.0, after=(periods - 1) * N * H)
    return made.margins(corners=["*"], slopes=SLOPES, stable_to_steps=1.0)


def _inverse(plays: hy.Graph) -> hy.Graph:
    """The exact inverse of plays, by the project, with names of its own for the ports."""
    g = hy.Model("plays", plays, H).inverse().graph
    return hy.Graph(
        g.nodes, g.wires, [hy.Input("v", g.inputs[0].to)], [hy.Output("volts", g.outputs[0].source)], sort=False
    )


def command(*words: object) -> Result:
    return CliRunner().invoke(main, [str(w) for w in words])


def held_mode(f: float, z: np.ndarray) -> np.ndarray:
    """Response of a mode behind a held command, from its discrete poles and its step response at two samples."""
    w, d = 2 * np.pi * f, np.sqrt(1 - ZETA**2)
    t = H * np.arange(1, 3)
    y = 1 - np.exp(-ZETA * w * t) * (np.cos(w * d * t) + ZETA / d * np.sin(w * d * t))
    a = np.array([1.0, -2 * np.exp(-ZETA * w * H) * np.cos(w * d * H), np.exp(-2 * ZETA * w * H)])
    b = [y[0], y[1] - y[0] + a[1] * y[0]]
    return np.asarray((b[0] * z + b[1]) / (z**2 + a[1] * z + a[2]))
