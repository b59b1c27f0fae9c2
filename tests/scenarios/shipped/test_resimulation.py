"""Every shipped scenario simulated again, by plays, controllers and a discretisation that are not those of the core.

One case of each; its output agrees along the whole trajectory, and its error with the recorded one, to 0.001 % of the
span.
"""

import sys
import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from hystfmu.model import Model
from hystfmu.scenario import Cases, build
from hystfmu.scenario.engine.native import Native
from hystfmu.scenario.system.system import System

ROOT = Path(__file__).parents[3]
sys.path.insert(0, str(ROOT / "tests" / "oracles"))
from loop_simulation import simulate  # noqa: E402

SCENARIOS = {
    f.parent.relative_to(ROOT / "scenarios").as_posix(): f.parent
    for f in sorted((ROOT / "scenarios").glob("**/scenario.toml"))
}
QUICK = (
    "cascade_1khz", "iterative_learning_1khz", "open_loop_1khz", "pid", "pid_1khz", "sliding_mode_2005_1khz",
    "papers/zhao_tan_2008_model",
)  # fmt: skip
MORE = {
    "pid": ["noise_10", "disturbance_10", "up_400_two_steps_100", "everything_10"],
    "cascade": ["bouc_wen_sine_100", "bouc_wen_up_600_10"],
}
INSTEAD = {"example_substeps": "ten_substeps"}  # in one step the block divides it by a rule of its own
TOLERANCE = 1e-5  # of the span
FROM_THE_RUN = ("noise", "random_reversals")  # random numbers are not drawn again


def preferred(scenario: Cases) -> str:
    """The case of a scenario with the fewest steps and a coupling in the stated order."""
    ordered = [c for c in scenario.cases if c.coupling.scheme == "gauss_seidel"]
    return min(ordered, key=lambda c: round(c.stop / c.step * c.ripple)).name


CASES = [(name, None) for name in SCENARIOS] + [(name, case) for name, cases in MORE.items() for case in cases]


def case_of(name: str, case: str | None) -> System:
    scenario = Cases(SCENARIOS[name])
    case = case or INSTEAD.get(name) or preferred(scenario)
    return build(next(c for c in scenario.cases if c.name == case))


def run(system: System) -> dict[str, Any]:
    trace = Native(system).run()
    return {name: trace[name] for name in system.columns}


def again(system: System, recorded: dict[str, Any]) -> dict[str, Any]:
    """The outputs of a case from the independent simulation."""
    case = system.case
    forward = {
        name: Model.load(case.folder / spec.inverse_of).graph
        for name, spec in case.units.items()
        if spec.inverse_of is not None and case.folder is not None
    }
    drawn = [
        p
        for p in system.parts
        if any(n.type in FROM_THE_RUN or n.values.get("shape") in FROM_THE_RUN for n in p.own.nodes)
    ]
    given = {p.name: np.column_stack([recorded[f"{p.name}.{o}"] for o in p.outputs]) for p in drawn}
    return simulate(system, forward, given)


def differences(system: System) -> tuple[float, float]:
    """Largest difference of the output along the run, and of its error from the baseline; shares of the span."""
    case, theirs = system.case, run(system)
    ours = again(system, theirs)
    metric = next((m for m in case.metrics.values() if m.kind == "rms_percent"), next(iter(case.metrics.values())))
    span = float(np.ptp(theirs[metric.signal]))
    along = float(np.abs(ours[metric.signal] - theirs[metric.signal]).max()) / span
    if metric.kind != "rms_percent" or case.folder is None or metric.against is None:
        return along, 0.0
    (name,) = (k for k, m in case.metrics.items() if m is metric)
    recorded = tomllib.loads((case.folder / "baseline.toml").read_text())["case"][case.name]["metrics"][name]
    e, r = ours[metric.signal] - ours[metric.against], ours[metric.against]
    rows = system.times(0, system.n_steps + 1) >= metric.after * (1 - 1e-12)
    if metric.lines:  # where the reference goes on at its speed, which the first two rows do not tell
        steps = np.diff(r[rows])
        straight = np.abs(np.diff(steps)) <= 1e-6 * np.abs(steps[1:])
        rows[rows] = np.append([False, False], straight)
    e = e[rows]
    stroke = metric.stroke or float(np.ptp(r))
    return along, abs(float(np.sqrt(np.mean(e**2))) - recorded / 100 * stroke) / span


@pytest.mark.some(1)
@pytest.mark.parametrize(("name", "case"), [
    pytest.param(
        *c, marks=() if c[0] in QUICK and c[1] is None else pytest.mark.stress, id="/".join(filter(None, c))
    )
    for c in CASES
])  # fmt: skip
def test_a_scenario_agrees_with_its_independent_simulation(name: str, case: str | None) -> None:
    along, error = differences(case_of(name, case))
    assert along < TOLERANCE
    assert error < TOLERANCE


def test_a_loop_with_another_gain_does_not_agree() -> None:
    """One gain that is one percent off is seen."""
    theirs = run(case_of("pid_1khz", "sine_100"))
    other = Cases(SCENARIOS["pid_1khz"]).changed({"pid.Ki": "*1.01"}, None)
    found = again(build(next(c for c in other.cases if c.name == "sine_100")), theirs)["plant.y"]
    assert np.abs(found - theirs["plant.y"]).max() > 10 * TOLERANCE * np.ptp(found)
