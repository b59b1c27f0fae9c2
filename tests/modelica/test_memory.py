"""The memory of dominant extrema when its list is full: nested loops are forgotten, and one sweep closes all."""

import numpy as np
import simulate

from hystfmu.graph import Graph, Node

DEPTHS = (4, 5, 8)


def bursts(rows: int) -> np.ndarray:
    """Bursts of decaying reversals of random length and size: each begins with a sweep across the ones before."""
    rng = np.random.default_rng(0)
    found: list[float] = []
    while len(found) < rows:
        size = rng.choice([-1, 1]) * rng.uniform(0.5, 2)
        found += [size * (-0.93) ** j for j in range(rng.integers(2, 14))]
    return np.array(found[:rows])


def test_full_memory_agrees_with_the_c_core() -> None:
    u = bursts(90)
    parts = [f"HystFMU.Operators.Sampled.ZhaoTan d{d}(depth = {d}, Ts = 0.1);" for d in DEPTHS]
    wires = [f"connect(signal.r, d{d}.x);" for d in DEPTHS]
    levels = ", ".join(map(repr, u.tolist()))
    source = (
        f"model M HystFMU.Sources.Steps signal(m = {len(u)}, levels = {{{levels}}}, T = 0.1); {' '.join(parts)} "
        f"equation {' '.join(wires)} end M;"
    )
    rows = simulated(source, len(u))
    for d in DEPTHS:
        expected = Graph.single(Node("tested", "zhao_tan", {"depth": d}, {})).run(rows["signal.r"])
        assert rows[f"d{d}.extrema[1]"].max() == d, "the list was never full"
        assert np.abs(rows[f"d{d}.h"] - expected).max() <= 1e-12 * np.abs(expected).max()


CASES = 1000
# Peaks of growing size on either side of x0, each with a reversal of one to three roundings behind it.  A peak passes
# the mirror image of the one before, so that it is on the virgin branch: the reversal is its outermost extremum.  From
# there the input goes some way back, and then to below or above the peak.  Below x0 a rounding of the input is less
# than one of its distance to x0.
ROUNDINGS = """
model M
  HystFMU.Operators.Sampled.ZhaoTan d8(depth = 8, x0 = 1, Ts = 0.1);
  Integer k(start = -1, fixed = true);
  discrete Real side(start = 1, fixed = true), peak(start = 1, fixed = true), u(start = 1, fixed = true);
  discrete Real whole(start = 5, fixed = true), drawn(start = 0, fixed = true), other(start = 0, fixed = true);
equation
  when sample(0, 0.1) then
    k = pre(k) + 1;
    whole = mod(16807*pre(whole), 2147483647);
    drawn = whole/2147483647;
    other = mod(16807*whole, 2147483647)/2147483647;
    side = if mod(k, 8) < 4 then 1 else -1;
    peak = if mod(k, 4) == 0 then 1 + side*(0.9 + 0.00005*k + 0.0001*drawn) else pre(peak);
    u = if mod(k, 4) == 0 then peak
      elseif mod(k, 4) == 1 then peak - side*(if side > 0 then 2.3e-16 else 1.4e-17)*(1 + floor(3*drawn))
      elseif mod(k, 4) == 2 then 1 + (peak - 1)*(1.85*drawn - 0.9)
      else 1 + (peak - 1)*(if other > 0.5 then 0.96 + 0.03*drawn else 1 + 1e-6*drawn);
  end when;
  d8.x = u;
end M;
"""


def test_reversal_of_one_rounding_behind_a_peak_agrees_with_the_c_core() -> None:
    rows = simulated(ROUNDINGS, 4 * CASES + 1)
    u = rows["u"][: 4 * CASES]
    assert len(u) == 4 * CASES
    behind, peak = u[1::4], u[::4]
    # what a comparison without a sign takes for a loop that closes
    assert np.count_nonzero((behind != peak) & (np.abs(behind - 1) == np.abs(peak - 1))) > 250
    expected = Graph.single(Node("tested", "zhao_tan", {"depth": 8}, {"x0": 1.0})).run(u)
    assert np.abs(rows["d8.h"][: len(u)] - expected).max() <= 1e-12 * np.abs(expected).max()


def simulated(source: str, samples: int) -> dict[str, np.ndarray]:
    """What the model M has after each of its samples, a tenth of a second apart."""
    return simulate.solve_text(source, 0.1 * samples, 0.1, 1e-6).at(0.1)
