"""Runs the studies of 1000 draws of every controller of the stage and records what they gave in draws.record.toml.

    python scenarios/stage/models/run_draws.py [CONTROLLER ...]

The draws are new in each run; the file keeps their seed.
"""

import sys
import tempfile
import tomllib
from pathlib import Path

import numpy as np

import hystfmu as hy
from hystfmu.base.files import write_toml

STAGE = Path(__file__).parents[1]
RECORD = STAGE / "draws.record.toml"


def found(name: str, known: int) -> dict[str, object]:
    """Run one study."""
    with tempfile.TemporaryDirectory() as folder:
        outcome = hy.study(STAGE / name / f"draws_{known}.study.toml", Path(folder))
    summary = outcome.summary
    lines = [r["metrics"].get("lines", np.inf) for r in outcome.rows]
    median, p95, worst = (float(np.quantile(lines, q, method="inverted_cdf")) for q in (0.5, 0.95, 1.0))
    text = {"draws": summary.draws, "seed": outcome.seed, "inside": summary.inside, "unstable": summary.unstable}
    return text | {"interval": list(summary.interval), "median": median, "p95": p95, "worst": worst}


def main(names: list[str]) -> None:
    """Write the record; controllers that are not named keep theirs."""
    recorded = tomllib.loads(RECORD.read_text()) if RECORD.exists() else {}
    for name in names or sorted(f.parent.name for f in STAGE.glob("*/draws_5.study.toml")):
        recorded[name] = {f"known_to_{known}": found(name, known) for known in (5, 20)}
        write_toml(RECORD, recorded, "written by models/run_draws.py: errors on the lines at 100 Hz, % of the stroke")
        print(name, recorded[name], flush=True)


if __name__ == "__main__":
    main(sys.argv[1:])
