"""S5, S6, P3, P10: steps of operators, models and implicit inverses in the C core, beside plain loops and numpy.

All run in the same process.  The plain loop is the block `backlash_sum` (same C core, one state per play).  Figures are
minima of several repeats and include the graph around the block.
"""

import sys
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[2] / "scenarios"))

import numpy as np

from hystfmu.data.synthetic import piezo
from hystfmu.graph.blocks import BacklashSum, PrandtlIshlinskii, PrandtlIshlinskiiInverse
from hystfmu.identify import fit
from hystfmu.identify.methods.weighted_sums import grid, ridge
from hystfmu.inverse import inverse
from hystfmu.report.terminal import table
from papers.sums_of_plays import nanoseconds

STEPS, REPEATS = 400_000, 20
KINDS = {  # target of a step (ns) and options of a short fit: the weights do not change the time
    "bouc_wen": (150, {"starts": 1}),
    "krasnoselskii_pokrovskii": (60, {}),
    "polynomial_narx": (120, {}),
    "play_bank_mlp": (170, {"starts": 1, "iterations": 5}),
    "prandtl_ishlinskii": (None, {}),
}
INVERSE = 6  # steps of its model that an implicit inverse may take


def signals(rng):
    k = np.arange(STEPS)
    ends = rng.uniform(-1, 1, STEPS // 25 + 2)
    rise = (1 - np.cos(np.pi * (k % 25) / 25)) / 2
    return {
        "minor loops": ends[k // 25] + (ends[k // 25 + 1] - ends[k // 25]) * rise,
        "white noise": rng.uniform(-1, 1, STEPS),
        "decaying sine": np.exp(-3 * k / STEPS) * np.sin(2 * np.pi * 500 * k / STEPS),
    }


def numpy_nanoseconds(u, r, w, w0):
    z = np.zeros_like(r)
    begin = time.perf_counter()
    for x in u:
        np.minimum(x + r, z, out=z)
        np.maximum(x - r, z, out=z)
        w0 * x + w @ z
    return 1e9 * (time.perf_counter() - begin) / len(u)


def bouc_wen_loop(graph, u):
    """Return the time per row (ns) of four Runge-Kutta stages in u, in Python; rough where a row passes the knee."""
    p = {k: float(graph.node("operator").value(k)[0]) for k in ("A", "beta", "gamma", "n")}

    def rate(z, s):
        return p["A"] - s * p["beta"] * abs(z) ** (p["n"] - 1) * z - p["gamma"] * abs(z) ** p["n"]

    u = (graph.node("input").value("gain") * u + graph.node("input").value("offset")).tolist()
    top = (p["A"] / (p["beta"] + p["gamma"])) ** (1 / p["n"])
    z, last, begin = 0.0, u[0], time.perf_counter()
    for x in u:
        h, s = x - last, 1.0 if x > last else -1.0
        k1 = rate(z, s)
        k2 = rate(z + h / 2 * k1, s)
        k3 = rate(z + h / 2 * k2, s)
        z = max(-top, min(top, z + h / 6 * (k1 + 2 * (k2 + k3) + rate(z + h * k3, s))))
        last = x
    return 1e9 * (time.perf_counter() - begin) / len(u)


def kernels_numpy(graph, u):
    """Return the time per row (ns) of one array of kernels."""
    node = graph.node("hysteresis")
    a, p1, p2 = grid(node.value("lo")[0], node.value("hi")[0], node.dims["n"])
    k, w = np.zeros(len(p1)), node.value("w")
    begin = time.perf_counter()
    for x in u:
        k = np.minimum(np.maximum(k, ridge(x - p2, a)), ridge(x - p1, a))
        w @ k
    return 1e9 * (time.perf_counter() - begin) / len(u)


RIVALS = {"bouc_wen": ("Runge-Kutta", bouc_wen_loop), "krasnoselskii_pokrovskii": ("numpy", kernels_numpy)}


def kinds(rng):
    """P10: a step of models as fitted, and of their implicit inverses in steps of the model."""
    rows, data = [], piezo(20, 1000.0)
    lo, hi = float(data.u.min()), float(data.u.max())
    shapes = {name: 0.5 * (lo + hi) + 0.45 * (hi - lo) * u[:100_000] for name, u in signals(rng).items()}
    for key, (target, options) in KINDS.items():
        model = fit(data, key, **options)
        for name, u in shapes.items():
            step = nanoseconds(model.graph, u, REPEATS)
            asked = "" if target is None else f"<= {target}"
            rival = f"{RIVALS[key][0]} {RIVALS[key][1](model.graph, u[:2000]):.0f}" if key in RIVALS else ""
            ratio = error = ""
            if key != "polynomial_narx":  # its lags have no inverse in one step
                found, y = inverse(model, "implicit"), model.predict(u)
                ratio = f"{nanoseconds(found.graph, y, REPEATS) / step:.1f}"
                error = f"{np.abs(model.predict(found.predict(y)) - y).max() / np.ptp(y):.1e}"
            rows.append([key, name, f"{step:.0f}", asked, rival, ratio, error])
    print(table(["kind", "signal", "ns/step", "target", "rival, ns", "inverse/step", "error/range"], rows))
    print(
        f"P10: models as fitted to a piezo stack; an implicit inverse is to take {INVERSE} steps of its model at most"
    )


def main():
    rng = np.random.default_rng(0)
    rows, errors = [], []
    for n in (10, 100, 1000, 5000):
        for kind in ("uniform", "random"):
            r = np.linspace(0, 0.95, n) if kind == "uniform" else np.sort(rng.uniform(0, 0.95, n))
            w = rng.normal(size=n) / n  # weights of both signs
            values = {"r": r, "w": w, "w0": 0.3}
            fast, plain = PrandtlIshlinskii(**values).graph, BacklashSum(**values).graph
            for name, u in signals(rng).items():
                short = u[: max(2000, min(STEPS, 20_000_000 // n))]
                y, expected = fast.run(short), plain.run(short)
                errors.append(np.abs(y - expected).max() / np.abs(expected).max())
                loop = nanoseconds(plain, short, REPEATS)
                vector = numpy_nanoseconds(short[:2000], r, w, 0.3)
                figures = [f"{nanoseconds(fast, u, REPEATS):.1f}", f"{loop:.0f}", f"{vector:.0f}", f"{errors[-1]:.1e}"]
                rows.append([n, kind, name, *figures])
    print(table(["plays", "thresholds", "signal", "ns/step", "plain loop", "numpy", "error/max|y|"], rows))
    print("S5/P3 targets at 5000 plays: 25 ns uniform, 100 ns otherwise; error 2e-14")
    w = rng.uniform(0.1, 1, 40)
    values = {"r": np.sort(rng.uniform(0, 0.95, 40)), "w": w, "w0": 0.3 * w.sum()}
    worst = 0.0
    for u in signals(rng).values():
        y = PrandtlIshlinskii(**values)(PrandtlIshlinskiiInverse(**values)(u))
        worst = max(worst, np.abs(y - u).max() / np.ptp(u))
    print(f"S6 exact inverse in cascade: {worst:.1e} of the stroke (target 1e-14)")
    kinds(rng)


if __name__ == "__main__":
    main()
