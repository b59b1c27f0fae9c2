"""Records what every loop does on hard devices: errors, where it breaks, and ranges in which no draw is unstable.

    python scenarios/models/run_hard.py [LOOP ...]

For example `run_hard.py pid stage/irc`; without a name all loops that have a `hard.toml`.  The record keeps the seeds
of the draws, which are new in each run.  A range comes from the linearised loop (`stable_range.py`); 1000 draws in it
are simulated and linearised, its corners simulated, and the range is drawn in until none is unstable.  What is stated,
here and in the file `stable.study.toml` of the loop, are these ranges shrunk by a tenth.
"""

import itertools
import sys
import tempfile
import tomllib
from pathlib import Path
from typing import Any

import numpy as np
from stable_range import SCENARIOS, Box, Loop, shrunk

import hystfmu as hy
from hystfmu.base.errors import InputError
from hystfmu.base.files import write_text, write_toml
from hystfmu.scenario import Cases, build
from hystfmu.scenario.engine.native import Native
from hystfmu.scenario.loop.opening import open_loop
from hystfmu.scenario.outcome.metrics import measure
from hystfmu.scenario.outcome.trace import Stopped
from hystfmu.studies import Outcome, Study

RECORD, STAGE_RECORD = SCENARIOS / "loops" / "hard.record.toml", SCENARIOS / "stage" / "hard.record.toml"
BAND = 0.02  # of a step
LOST = 25.0  # RMS error of an output at rest, % of the stroke
RESTLESS = 1.0  # deviation of the error after a step, % of the stroke, from which a loop does not come to rest
LEAST = 1e-4  # relative width of a range that is one value
TRIES = 20
CLOSER = 0.9  # by which a range with an unstable draw is drawn in
STEPS = {"step": ("nominal", "tracking"), "staircase": ("scan_100", "lines")}
STUDY = """# No random device within these ranges is unstable.  Written by models/run_hard.py.
#   hystfmu study scenarios/{name}/stable.study.toml -o out
extends = "{base}/stable_draws.toml"
{cases}
[parameters]
"plant.g0_zeta_1" = {{ range = {damping}, log = true }}
"plant.g0_k_2" = {{ range = {second_mode} }}
{gain_of} = {gain} }}
"""


def error(name: str, case: str, metric: str) -> float:
    """Return the error of a hard case (%); infinite where the loop is unstable.

    It is unstable if the run leaves all bounds or errs as an output at rest, or by its poles.  The poles of a loop with
    jitter are not known.  An output at rest is no measure for a stage, whose slow integral leaves a wrong gain to the
    feed-forward.
    """
    loop = Cases(SCENARIOS / name / "hard.toml")
    system = build(next(c for c in loop.cases if c.name == case))
    m = system.case.metrics[metric]
    try:
        run = Native(system, ["plant.y", "reference.r"]).run()
    except Stopped:
        return np.inf
    value = measure(m, run)
    if not value < LOST and not name.startswith("stage/"):
        return np.inf
    if case == "jitter":
        return value
    try:
        opened = open_loop(system)
        return value if opened.stable(slope(name, case), 0.0) else np.inf
    except InputError:
        return value


def slope(name: str, case: str) -> float:
    """Return the slope of plant over inverse for small signals: static gain of a hard case over the known one."""
    if case == "second_mode":
        return 1.1 if name.startswith("stage/") else 1.05
    return 0.35 if case == "gain_35" else 1.0


def steps(name: str, case: str) -> tuple[float, float]:
    """Return settling time (s; infinite: not before the next step) and overshoot (% of the step), of the worst step."""
    system = build(next(c for c in Cases(SCENARIOS / name / "hard.toml").cases if c.name == case))
    run = Native(system, ["plant.y", "reference.r"]).run()
    t, y, r = run.t, run["plant.y"], run["reference.r"]
    starts = np.append(np.flatnonzero(np.diff(r)) + 1, len(t))
    settling = overshoot = 0.0
    for a, b in itertools.pairwise(starts):
        e = (y[a:b] - r[a]) / (r[a] - r[a - 1])
        outside = np.flatnonzero(np.abs(e) > BAND)
        last = outside[-1] + 1 if len(outside) else 0
        settling = max(settling, float(t[a + last] - t[a]) if a + last < b else np.inf)
        overshoot = max(overshoot, 100 * float(e.max()))
    return settling, overshoot


def cases(name: str) -> dict[str, float]:
    """Return the errors of all hard cases, settling and overshoot."""
    names = [c.name for c in Cases(SCENARIOS / name / "hard.toml").cases]
    kind = "staircase" if name.startswith("stage/") else "step"
    metric = STEPS[kind][1]
    skipped = (kind, "small", "everything", "everything_step")
    found = {case: error(name, case, metric) for case in names if case not in skipped}
    if name == "iterative_learning":  # a step does not repeat
        return found
    settling, overshoot = steps(name, kind)
    return found | {"settling_s": settling, "overshoot_percent": overshoot}


def breaks(loop: Loop) -> dict[str, float]:
    """Return where the nominal loop breaks if one quantity alone differs; what never breaks is left out."""
    found = {f"{name}_{side}": loop.breaks(name, k) for name in loop.axes for k, side in enumerate(("below", "above"))}
    return {name: value for name, value in found.items() if value is not None}


def drawn(file: Path) -> Outcome:
    """Run a study in one process."""
    with tempfile.TemporaryDirectory() as folder:
        return hy.study(file, Path(folder), workers=1)


def hard(loop: Loop) -> dict[str, int]:
    """Return how many hard draws are stable."""
    found = drawn(loop.folder / "hard.study.toml")
    assert found.summary is not None
    stable = found.summary.draws - found.summary.unstable - found.summary.failed
    return {"draws": found.summary.draws, "stable": stable, "seed": found.seed}


def study_text(loop: Loop, box: Box) -> str:
    """Return a study that draws in a box."""
    base = "../loops" if not loop.stage else ".."
    gain = '"plant.bend_theta" = { scale' if loop.stage else '"plant.static_gain" = { range'
    more = ""
    if loop.name == "iterative_learning":
        more = 'cases = ["nominal"]\n'
    spans = {
        k: f"[{lo:.6g}, {max(hi, lo * (1 + LEAST), LEAST**2):.6g}]" for k, (lo, hi) in box.items()
    }  # a range must rise
    text = STUDY.format(name=loop.name, base=base, cases=more, gain_of=gain, **spans)
    if loop.learns:
        text += '"delay.n" = { values = [1] }\n'
    return text


def unstable(loop: Loop, file: Path) -> tuple[int, int]:
    """Return how many draws of a study are unstable, simulated or linearised, and its seed."""
    outcome = drawn(file)
    lost = set()
    for row in outcome.rows:
        v = row["values"]
        late = {"delay": v["delay.n"], "damping": v["plant.g0_zeta_1"], "second_mode": v["plant.g0_k_2"]}
        gain = v["plant.bend_theta" if loop.stage else "plant.static_gain"]
        modes = {f"f_{k}": v[f"plant.g0_f_n_{k}"] * (loop.nominal[f"f_{k}"] if loop.stage else 1) for k in (1, 2)}
        errors = [e for k, e in row["metrics"].items() if k in ("tracking", "lines")]
        good = row["status"] == "ok" and all(e < LOST for e in errors)
        if not (good and loop.stable({**late, **modes, "gain": gain})):
            lost.add(row["variation"])
    return len(lost), outcome.seed


def lost_corners(loop: Loop, file: Path) -> int:
    """Return at how many ends of all ranges of a study the simulated loop is lost, or does not come to rest."""
    study = Study(file)
    ends = [sorted({p.at(0.0), p.at(1.0)}) for p in study.parameters.values()]
    lost = 0
    for values in itertools.product(*ends):
        settings = study.settings(dict(zip(study.parameters, values, strict=True)))
        cases = Cases(loop.folder / "hard.toml", settings).cases
        lost += any(_moves(build(c)) for c in cases if c.name in study.spec.cases)
    return lost


def _moves(system: Any) -> bool:
    """Whether a run is lost, or its error still moves when a step should be over."""
    metric = next(system.case.metrics[k] for k in ("tracking", "lines") if k in system.case.metrics)
    try:
        run = Native(system, ["plant.y", "reference.r"]).run()
    except Stopped:
        return True
    e = (run["plant.y"] - run["reference.r"])[run.t >= metric.after]
    rest = 100 * float(np.std(e)) / metric.stroke
    return not measure(metric, run) < LOST or (system.case.name == "step" and not rest < RESTLESS)


def ranges(loop: Loop) -> dict[str, Any]:
    """Find the ranges, confirm them by 1000 draws, and write the study with what is stated.

    A loop that is unstable for some draws although damping, second mode and gain are nominal has none.
    """
    box, file = loop.widest(), loop.folder / "stable.study.toml"
    for _ in range(TRIES):
        write_text(file, study_text(loop, box))
        (count, seed), corners = unstable(loop, file), lost_corners(loop, file)
        print(f"{loop.name}: {count} of 1000 draws unstable, {corners} corners, in {box}", flush=True)
        if count + corners == 0:
            break
        if all(lo == hi for lo, hi in box.values()):
            file.unlink()
            return {"draws": 1000, "unstable": count, "seed": seed}
        box = {name: tuple(loop.axes[name].towards(end, CLOSER) for end in ends) for name, ends in box.items()}  # type: ignore[misc]
    else:
        raise SystemExit(f"{loop.name}: no range after {TRIES} tries")
    stated = {k: tuple(float(f"{end:.4g}") for end in ends) for k, ends in shrunk(loop.axes, box).items()}
    write_text(file, study_text(loop, stated))  # type: ignore[arg-type]
    found = {"draws": 1000, "unstable": 0, "seed": seed}
    return found | {f"drawn_{k}": list(v) for k, v in box.items()} | {k: list(v) for k, v in stated.items()}


def main(names: list[str]) -> None:
    """Write the records; loops that are not named keep theirs."""
    every = [f.parent.relative_to(SCENARIOS).as_posix() for f in sorted(SCENARIOS.glob("**/hard.study.toml"))]
    for name in names or every:
        loop = Loop(name)
        record = STAGE_RECORD if loop.stage else RECORD
        found = {"cases": cases(name), "breaks": breaks(loop), "hard": hard(loop), "range": ranges(loop)}
        recorded = tomllib.loads(record.read_text()) if record.exists() else {}
        recorded[name.removeprefix("stage/")] = found
        write_toml(record, recorded, "written by scenarios/models/run_hard.py: loops on hard devices")
        print(name, found, flush=True)


if __name__ == "__main__":
    main(sys.argv[1:])
