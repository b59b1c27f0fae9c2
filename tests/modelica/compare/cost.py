"""What Events costs beside Smooth: ten plays on two tones, both in one run of one process."""

from __future__ import annotations

import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import simulate

MOST = 3.0  # times the seconds of Smooth
STOP, INTERVAL = 3, 1e-3  # s
HEADING = f"{'ten plays on two tones':58} {'rows':>6} {'events':>6} {'reversals':>9} {'s':>6} {'of Smooth':>9}"
_MODEL = """model M
  HystFMU.Sources.Multisine signal(m = 2, f = {{3, 17}}, a = {{0.7, 0.4}}, ph = {{0, 0}});
  HystFMU.Operators.{kind}.PrandtlIshlinskii tested(n = 10, w0 = 0.3, r = linspace(0.05, 0.5, 10), w = fill(0.1, 10));
equation
  connect(signal.r, tested.u);
  connect(signal.dr_lead, tested.du);
end M;
"""


@dataclass(frozen=True)
class Cost:
    """Seconds without those of the compiler, rows and events; reversals that the input has."""

    kind: str
    seconds: float
    rows: int
    events: int
    reversals: int


def measure(kind: str, folder: Path, repeats: int = 3) -> Cost:
    """Simulate the realisation `kind`."""
    file, out = folder / kind / "M.mo", folder / "r.npz"
    file.parent.mkdir()
    file.write_text(_MODEL.format(kind=kind))

    def seconds(stop: float) -> float:
        began = time.perf_counter()
        assert simulate.rumoca(file, "M", repr(stop), repr(INTERVAL), "1e-6", out) == ""
        return time.perf_counter() - began

    seconds(INTERVAL)  # imports
    idle = min(seconds(INTERVAL) for _ in range(repeats))
    took = min(seconds(float(STOP)) for _ in range(repeats)) - idle
    with np.load(out) as stored:
        rows = simulate.Trajectory({k: stored[k] for k in stored.files})
    t = np.linspace(0, STOP, 1_000_000 * STOP + 1)
    rate = 0.7 * 3 * np.cos(6 * np.pi * t) + 0.4 * 17 * np.cos(34 * np.pi * t)
    return Cost(kind, took, len(rows.values["time"]), rows.events, int(np.count_nonzero(rate[1:] * rate[:-1] < 0)))


def line(cost: Cost, smooth: Cost) -> str:
    """One row of the report."""
    ratio = cost.seconds / smooth.seconds
    return f"{cost.kind:58} {cost.rows:6} {cost.events:6} {cost.reversals:9} {cost.seconds:6.2f} {ratio:9.2f}"
