"""Measures what switching is worth in the sampled loop with delay; writes scenarios/loops/switching.record.toml.

    python scenarios/models/run_switching.py [draws]

Every sliding mode of the tracking table is compared with itself with the slope of its boundary layer in the place of
the switching term, a PD or PID, in the worst corner.  Then gains are drawn whose linear law meets the limits of
loops/gains.toml; a share of its s is switched, in a layer of any width, without and with a disturbance observer.
"""

import sys
import tomllib
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from hystfmu.base.files import write_toml
from hystfmu.scenario import Cases, build
from hystfmu.scenario.engine.native import Native
from hystfmu.scenario.outcome.metrics import Measure
from hystfmu.studies import Study
from hystfmu.studies.task import LoopLimits

SCENARIOS = Path(__file__).parents[1]
RECORD = SCENARIOS / "loops" / "switching.record.toml"
HEAD = (
    "written by models/run_switching.py: worst corners, RMS in percent of the stroke; ratios of law over its linear law"
)
PLANTS = {"backlash": "", "bouc_wen": "bouc_wen_"}
CORNERS = ("up_400", "up_600", "down_400", "down_600")
SIGNALS = ("10", "100", "broadband")
DRAWS, SEED = 25, 1

Values = Mapping[str, float]


def worst(scenario: str, plant: str, signal: str, unit: str, block: str, values: Values) -> float:
    """Return the largest error in the corners with another block in the place of a unit."""
    cases = {c.name: c for c in Cases(SCENARIOS / scenario).cases}
    errors = []
    for corner in CORNERS:
        case = cases[f"{PLANTS[plant]}{corner}_{signal}"]
        spec = case.units[unit].model_copy(update={"block": block, "values": dict(values)})
        measure = Measure(case.metrics["tracking"])
        measure.add(Native(build(replace(case, units={**case.units, unit: spec}))).run())
        errors.append(measure.value())
    return max(errors)


def shipped(scenario: str, unit: str) -> dict[str, float]:
    """Return the gains that a scenario states."""
    return {k: float(v) for k, v in Cases(SCENARIOS / scenario).spec.units[unit].values.items()}


def linear() -> dict[str, tuple[str, str, str, dict[str, float]]]:
    """Return of every law scenario, unit, block and gains of the linear law that it is for small s."""
    old, law, twice = (
        shipped(n, u)
        for n, u in (
            ("sliding_mode_2005", "sliding_mode"),
            ("sliding_mode", "sliding_mode"),
            ("super_twisting", "super_twisting"),
        )
    )
    slope = law["eta"] + law["rho"] / law["epsilon"]
    root = twice["epsilon"] ** 0.5
    first = twice["k_1"] * (1 / root + twice["mu"])
    second = twice["k_2"] * (0.5 / root**2 + 1.5 * twice["mu"] / root + twice["mu"] ** 2)
    lam = twice["lam"]
    pd = old | {"eta": old["eta"] + old["rho"] / old["epsilon"], "rho": 0.0}
    return {
        "sliding_mode_2005": ("sliding_mode_2005", "sliding_mode", "sliding_mode", pd),
        "sliding_mode": ("pid", "pid", "pid", {"Kp": slope * law["lam"], "Ki": slope * law["k_i"], "Kd": slope}),
        "super_twisting": ("pid", "pid", "pid", {"Kp": first * lam + second, "Ki": second * lam, "Kd": first}),
    }


def switched(gains: Values, share: float, layer: float) -> dict[str, float]:
    """Return the sliding mode that is the PID of `gains` for s = 0; outside of a layer a share of s is switched."""
    kd = gains["Kd"]
    line = {"lam": gains["Kp"] / kd, "k_i": gains["Ki"] / kd}
    return line | {"eta": (1 - share) * kd, "rho": share * kd * layer, "epsilon": layer}


def draws(scenario: str, n: int, seed: int) -> dict[str, Any]:
    """Draw switched laws whose linear law meets the limits of the study, and compare them in the worst corner.

    With their linear law, and with the larger ratio of those to it and to the tuned loop of the same structure.
    """
    rng, study = np.random.default_rng(seed), Study(SCENARIOS / scenario / "gains.study.toml")
    objective = study.spec.objective
    assert objective is not None
    assert objective.loop is not None
    limits, tuned = LoopLimits(study, objective.loop), shipped(scenario, "pid")
    recorded = tomllib.loads((SCENARIOS / scenario / "baseline.toml").read_text())["case"]
    ratios: list[float] = []
    both: list[float] = []
    while len(ratios) < n:
        gains = {k: tuned[k] * float(np.exp(rng.uniform(-1, 0.5))) for k in ("Kp", "Ki", "Kd")}
        share, layer = float(rng.uniform(0.2, 1)), float(np.exp(rng.uniform(np.log(0.01), np.log(50))))
        plant, signal = rng.choice(list(PLANTS)), rng.choice(SIGNALS[:2])
        if max(limits.excess({f"pid.{k}": v for k, v in gains.items()}).values()) > 0:
            continue
        law = worst(scenario, plant, signal, "pid", "sliding_mode", switched(gains, share, layer))
        best = max(recorded[f"{PLANTS[plant]}{c}_{signal}"]["metrics"]["tracking"] for c in CORNERS)
        ratios.append(law / worst(scenario, plant, signal, "pid", "pid", gains))
        both.append(max(ratios[-1], law / best))
    found = {"smallest_ratio": min(ratios), "median_ratio": float(np.median(ratios)), "smallest_to_both": min(both)}
    return {"draws": n, "seed": seed} | found


def main(n: int = DRAWS) -> None:
    """Write the record."""
    found: dict[str, Any] = {
        law: {p: {s: worst(where, p, s, unit, block, gains) for s in SIGNALS} for p in PLANTS}
        for law, (where, unit, block, gains) in linear().items()
    }
    for name in ("pid", "pid_observer"):
        found[f"drawn_{name}"] = draws(name, n, SEED)
        print(name, found[f"drawn_{name}"], flush=True)
    write_toml(RECORD, found, HEAD)


if __name__ == "__main__":
    main(*(int(a) for a in sys.argv[1:]))
