"""Pictures of the site as SVG, computed from the blocks themselves."""

from collections.abc import Callable

import numpy as np

import hystfmu as hy
from hystfmu.base.arrays import Array
from hystfmu.report.plot import LOOP_POINTS, Line, Plot

STYLE = """<style>
svg { background:#fff; font-family:sans-serif } .grid { stroke:#d9e0e6; fill:none } .frame { stroke:#5d6b78; fill:none }
.tick { fill:#5d6b78; font-size:14px }
.line { vector-effect:non-scaling-stroke; fill:none; stroke-width:1.4; stroke-linejoin:round }
.c0 { stroke:#0b63b5 } .c1 { stroke:#d1521b } .c2 { stroke:#2a8a4a } .c3 { stroke:#8a3fa0 }
</style>"""


def side_by_side(*plots: Plot) -> list[str]:
    """Return plots as SVGs that need no style sheet of a page and fit a narrow screen."""
    own = '<svg xmlns="http://www.w3.org/2000/svg" width="360" '
    return [p.svg().replace("<svg ", own, 1).replace(">", f">{STYLE}", 1) for p in plots]


def loop(title: str, x: Array, y: Array, across: str = "u", up: str = "y") -> Plot:
    """Return a diagram of one line."""
    return Plot(title, across, up, [Line(title, x, y)], points=LOOP_POINTS)


def before_after() -> list[str]:
    """The built-in piezo behind a gain, and behind the inverse of an identified model."""
    data = hy.synthetic.piezo(60, 1000.0)
    inverse = hy.fit(data, "actuator").inverse()
    t = np.arange(4000) * 1e-3
    wanted = 1.0 + 15.0 * np.sin(2 * np.pi * t) * np.exp(-0.25 * t)
    line = np.polyfit(data.y, data.u, 1)
    ahead = int(inverse.fit.get("lag_steps", 0))
    gain = hy.synthetic.displacement(np.polyval(line, wanted), 1e-3)
    there = hy.synthetic.displacement(inverse.predict(wanted), 1e-3)
    return side_by_side(
        loop("behind a gain", wanted, gain, "wanted (um)", "reached (um)"),
        loop("behind the inverse", wanted[: len(t) - ahead], there[ahead:], "wanted (um)", "reached (um)"),
    )


def nested() -> list[str]:
    """Three operators on the same nested reversals."""
    u = np.asarray(hy.signals.nested_reversals(14, seed=3))
    kinds: dict[str, hy.Graph] = {
        "plays": hy.blocks.PrandtlIshlinskii(w0=0.3, r=[0.1, 0.3, 0.6], w=[0.3, 0.3, 0.3]).graph,
        "Zhao-Tan": hy.blocks.ZhaoTan().graph,
        "Bouc-Wen": hy.blocks.BoucWen(A=1.0, beta=3.0, gamma=-1.0, alpha=0.3).graph,
    }
    first = {name: hy.Model(name, g).predict(u).reshape(len(u), -1)[:, 0] for name, g in kinds.items()}
    return side_by_side(*(loop(name, u, y) for name, y in first.items()))


def creeping() -> list[str]:
    """A step of the voltage: a memory answers at once, creep goes on."""
    t = np.arange(4000) * 1e-3
    u = np.where(t > 0.2, 1.0, 0.0)
    y = hy.Model("creep", hy.blocks.Creep().graph, step=1e-3).predict(u, 1e-3)
    return side_by_side(loop("creep", t, y, "time (s)", "displacement"))


def closing() -> list[str]:
    """Minor loops of a memory that closes them, and of one that is led by the rate of its input."""
    data = hy.synthetic.piezo(60, 1000.0)
    model = hy.fit(data, "prandtl_ishlinskii")
    t = np.arange(6000) * 1e-3
    u = 50.0 - 45.0 * np.cos(2 * np.pi * t / 6) * np.cos(2 * np.pi * t)
    hertz = [5.0, 50.0, 150.0]
    curves = []
    for f in hertz:
        n = round(1e4 / f)  # rows of a period
        x = 50.0 - 40.0 * np.cos(2 * np.pi * f * np.arange(3 * n + 1) * 1e-4)
        curves.append(Line(f"{f:g} Hz", x[2 * n :], hy.synthetic.displacement(x, 1e-4)[2 * n :]))
    return side_by_side(
        loop("minor loops of plays", u, model.predict(u), "voltage (V)", "displacement (um)"),
        Plot("the built-in stack", "voltage (V)", "displacement (um)", curves, points=LOOP_POINTS),
    )


def tracking() -> list[str]:
    """A loop without and with its inverse."""
    data = hy.synthetic.piezo(60, 1000.0)
    model = hy.fit(data, "prandtl_ishlinskii")
    plots = []
    for title, part in (("a gain and PI", None), ("the inverse and PI", model.inverse())):
        made = hy.Scenario("tracking", step=1e-4).add("plant", model, fine=True)
        lo, hi = model.predict([0.0, 100.0])
        k = 100.0 / (hi - lo)
        made.add("inverse", hy.blocks.Scaling(gain=k, offset=-k * lo) if part is None else part)
        made.add("pid", hy.blocks.Pid(Kp=0.2, Ki=300.0))
        for source, target in (
            ("reference.r_lead", "pid.u_ff"),
            ("reference.r", "pid.y_d"),
            ("plant.y", "pid.y"),
            ("pid.u", "inverse.u"),
            ("inverse.y", "plant.u"),
        ):
            made.connect(source, target)
        made.metric("tracking", "rms_percent", "plant.y", against="reference.r").record("reference.r", "plant.y")
        trace = made.run(engine="native").trace
        assert trace is not None
        settled = trace.t > 0.1
        error = (trace["plant.y"] - trace["reference.r"])[settled]
        plots.append(Plot(title, "time (s)", "error (um)", [Line(title, trace.t[settled], error)], envelope=True))
    return side_by_side(*plots)


PICTURES: dict[str, tuple[str, str, Callable[[], list[str]]]] = {
    "before_after": (
        "Before and after",
        "The built-in piezo stack follows a decaying sine: driven by a gain, and by the inverse of the `actuator` "
        "model that was fitted to a noisy record of random reversals.",
        before_after,
    ),
    "nested": (
        "Nested loops",
        "The same reversals through plays, the Zhao-Tan operator, and Bouc-Wen, whose minor loops do not close.",
        nested,
    ),
    "closing": (
        "Minor loops and rate",
        "Plays return to the point where a minor loop began. The built-in stack has creep and mechanics of 500 Hz "
        "behind its plays: its loops widen with the frequency.",
        closing,
    ),
    "tracking": (
        "What the inverse adds to feedback",
        "The same PI controller in front of a gain and in front of the inverse; the plant is the fitted model.",
        tracking,
    ),
    "creep": ("Creep", "A step of the input and a weighted sum of first-order lags.", creeping),
}
