"""S5, S6, P3: the Prandtl-Ishlinskii operator by turning points, compared with a plain loop and numpy; its inverse.

All run in the same process.  The plain loop is the block `backlash_sum` (same C core, one state per play).  Figures are
minima of several repeats and include the graph around the block.
"""

import time

import numpy as np

from hystfmu.graph.blocks import BacklashSum, PrandtlIshlinskii, PrandtlIshlinskiiInverse
from hystfmu.papers.sums_of_plays import nanoseconds
from hystfmu.report.terminal import table

STEPS, REPEATS = 400_000, 20


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


if __name__ == "__main__":
    main()
