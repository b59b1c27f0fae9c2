"""What Events costs beside Smooth: ten plays on two tones, both in one run of one process."""

from dataclasses import dataclass

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


def measure(kind: str, repeats: int = 3) -> Cost:
    """Simulate the realisation `kind`."""

    def solved(stop: float) -> simulate.Trajectory:
        return simulate.solve_text(_MODEL.format(kind=kind), stop, INTERVAL, 1e-6)

    solved(INTERVAL)  # imports
    idle = min(solved(INTERVAL).seconds for _ in range(repeats))
    rows = min((solved(STOP) for _ in range(repeats)), key=lambda r: r.seconds)
    took = rows.seconds - idle
    t = np.linspace(0, STOP, 1_000_000 * STOP + 1)
    rate = 0.7 * 3 * np.cos(6 * np.pi * t) + 0.4 * 17 * np.cos(34 * np.pi * t)
    return Cost(kind, took, len(rows.values["time"]), rows.events, int(np.count_nonzero(rate[1:] * rate[:-1] < 0)))


def line(cost: Cost, smooth: Cost) -> str:
    """One row of the report."""
    ratio = cost.seconds / smooth.seconds
    return f"{cost.kind:58} {cost.rows:6} {cost.events:6} {cost.reversals:9} {cost.seconds:6.2f} {ratio:9.2f}"
