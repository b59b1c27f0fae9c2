"""Runs studies of gains and records in gains.record.toml what each found: trials, how many were allowed, best values.

    python scenarios/models/run_gains.py pid stage/irc ...

The values go into the scenario by hand, after a look; `--settings` prints them and what a design makes of them.
"""

import sys
import tempfile
import tomllib
from pathlib import Path
from typing import Any

import hystfmu as hy
from hystfmu.base.files import write_toml
from hystfmu.studies import Study
from hystfmu.studies.report import best_variation
from hystfmu.studies.task import LoopLimits

SCENARIOS = Path(__file__).parents[1]
RECORD = SCENARIOS / "models" / "gains.record.toml"
HEAD = (
    "written by models/run_gains.py: what the studies of gains found; first: the objective of a first trial that was "
    "given"
)


def rounded(values: dict[str, float]) -> dict[str, float]:
    """Return the values with the digits that a scenario states."""
    return {k: float(f"{v:.4g}") for k, v in values.items()}


def found(name: str) -> dict[str, Any]:
    """Run one study."""
    study = Study(SCENARIOS / name / "gains.study.toml")
    objective = study.spec.objective
    assert objective is not None
    with tempfile.TemporaryDirectory() as folder:
        rows = hy.study(study.file, folder, workers=1).rows
    best = best_variation(study, rows)
    assert best is not None, "no trial is within the limits"
    trials: dict[int, list[dict[str, Any]]] = {}
    for row in rows:
        trials.setdefault(row["variation"], []).append(row)
    first, chosen = trials[0], trials[best["variation"]]
    limits = LoopLimits(study, objective.loop) if objective.loop else None
    excess = limits.excess(study.settings(rounded(best["values"]))) if limits else {}
    return {
        "trials": len(trials),
        "seed": study.seed,
        "best": objective.score(chosen),
        "best_trial": best["variation"] + 1,
        "excess": excess,
        "values": rounded(best["values"]),
    } | ({"first": objective.score(first)} if study.spec.start else {})


def main(names: list[str]) -> None:
    """Write the record; studies that are not named keep theirs."""
    recorded = tomllib.loads(RECORD.read_text()) if RECORD.exists() else {}
    for name in names:
        if name == "--settings":
            continue
        if "--settings" in names:
            print(Study(SCENARIOS / name / "gains.study.toml").settings(recorded[name]["values"]))
            continue
        recorded[name] = found(name)
        print(name, recorded[name], flush=True)
        write_toml(RECORD, recorded, HEAD)


if __name__ == "__main__":
    main(sys.argv[1:])
