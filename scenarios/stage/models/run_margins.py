"""Records margins of every controller of the stage and the settling of its staircase in loops.record.toml.

python scenarios/stage/models/run_margins.py [CONTROLLER ...]
"""

import sys
import tomllib
from itertools import pairwise
from pathlib import Path

import numpy as np

import hystfmu as hy
from hystfmu.base.files import write_toml
from hystfmu.scenario import Cases, build
from hystfmu.scenario.engine.native import Native

STAGE = Path(__file__).parents[1]
RECORD = STAGE / "loops.record.toml"
BAND = 0.02  # of a step


def margins(name: str) -> dict[str, float]:
    """Return Ms (dB; infinite: unstable) and bandwidth (Hz) of the nominal loop, and Ms with modes 20 % off."""
    loop = hy.Scenario.load(STAGE / name)
    try:
        found = {case: loop.open_loop(case).margins() for case in ("scan_100", "low_100", "high_100")}
    except hy.InputError:  # no feedback
        return {}
    Ms = {case: float(m.Ms_db) if m.stable else np.inf for case, m in found.items()}
    nominal = {"Ms_db": Ms["scan_100"], "bandwidth_hz": float(found["scan_100"].bandwidth_hz)}
    return nominal | {"Ms_low_db": Ms["low_100"], "Ms_high_db": Ms["high_100"]}


def settling(name: str) -> float:
    """Return the longest time (s) until a step of the staircase stays in its band; infinite if it never does."""
    (case,) = [c for c in Cases(STAGE / name).cases if c.name == "staircase"]
    run = Native(build(case), ["plant.y", "reference.r"]).run()
    t, e, r = run.t, np.abs(run["plant.y"] - run["reference.r"]), run["reference.r"]
    starts = np.append(np.flatnonzero(np.diff(r)) + 1, len(t))
    longest = 0.0
    for a, b in pairwise(starts):
        outside = np.flatnonzero(e[a:b] > BAND * abs(r[a] - r[a - 1]))
        last = outside[-1] + 1 if len(outside) else 0
        longest = max(longest, float(t[a + last] - t[a]) if a + last < b else np.inf)
    return longest


def main(names: list[str]) -> None:
    """Write the record; controllers that are not named keep theirs."""
    recorded = tomllib.loads(RECORD.read_text()) if RECORD.exists() else {}
    for name in names or sorted(f.parent.name for f in STAGE.glob("*/draws_5.study.toml")):
        recorded[name] = margins(name) | {"settling_s": settling(name)}
        print(name, recorded[name], flush=True)
    write_toml(
        RECORD, recorded, "written by models/run_margins.py: margins, and settling of the staircase to 2 % of a step"
    )


if __name__ == "__main__":
    main(sys.argv[1:])
