"""Is a green line of `hystfmu start` true?  Drawn resonant devices decide, simulated by code of its own.

Every device (plays, bend, creep, one or two modes, delay, noise) gives a record of each kind; `hystfmu start` sees the
record alone, and its loop then runs on the device.  The table counts verdicts by kind of record and compares errors:

    make devices                                        # 50 devices drawn anew
    python tests/benchmarks/devices.py --seed 7 -n 5    # the first five of another draw
    python tests/benchmarks/devices.py --seed 7 --only 3 --kinds chirp --keep build/device  # one of them, files stay

`--work FILE.jsonl` keeps the figures of every record, so that an interrupted run goes on where it stopped.  The exit
status is 1 where a requirement is missed.
"""

import argparse
import json
import os
import secrets
import sys
import tempfile
from concurrent.futures import ProcessPoolExecutor, as_completed
from pathlib import Path
from typing import Any

os.environ.setdefault("OMP_NUM_THREADS", "1")
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
sys.path.insert(0, str(Path(__file__).parents[1]))

import numpy as np
from start.devices.judge import figures
from start.devices.records import KINDS

from hystfmu.report.terminal import table

WITH_FEEDBACK, WITHIN_FACTOR, UNDER_BOUND, PESSIMISM, SECONDS = 0.9, 0.9, 0.95, 3.0, 60.0
FACTOR = 2.0
SMOOTH = ("sine", "triangle", "nested")  # inside the band; the error of a jump is that of its shaping, on any device
SHOWN = 5  # devices named for each requirement
Rows = list[dict[str, Any]]


def work(seed: int, index: int, kind: str, keep: Path | None) -> dict[str, Any]:
    """Figures of one record, with its place."""
    with tempfile.TemporaryDirectory() as spare:
        folder = Path(spare) if keep is None else keep / f"{index}_{kind}"
        return {"seed": seed, "index": index, "kind": kind, **figures(seed, index, kind, folder)}


def run(todo: list[tuple[int, int, str]], path: Path | None, jobs: int, keep: Path | None) -> Rows:
    """Work through the records; append each to the file as it comes."""
    rows: Rows = []
    with ProcessPoolExecutor(jobs, max_tasks_per_child=1) as pool:
        waiting = [pool.submit(work, *at, keep) for at in todo]
        for done in as_completed(waiting):
            row = done.result()
            rows.append(row)
            if path is not None:
                with path.open("a") as f:
                    f.write(json.dumps(row) + "\n")
            print(f"{len(rows)}/{len(todo)} {line(row)}", file=sys.stderr, flush=True)
    return rows


def line(row: dict[str, Any]) -> str:
    """One record in one line."""
    told = "approved" if row["approved"] else "not approved"
    seen = "; ".join(row.get("unstable", [])) or "stable"
    return f"device {row['index']} {row['kind']}: {told}, feedback {row['feedback']}, {row['seconds']:g} s; {seen}"


def runs(rows: Rows) -> Rows:
    """Every smooth reference that ran on a device, of approved loops."""
    return [{**r, "row": row} for row in rows if row["approved"] for r in row.get("runs", ()) if r["shape"] in SMOOTH]


def stated(found: Rows) -> Rows:
    """References whose error is stated."""
    return [r for r in found if r["rms_percent"] is not None]


def close(r: dict[str, Any]) -> bool:
    """Whether the error on the device is within a factor of the stated one."""
    return r["device"] is not None and r["rms_percent"] / FACTOR <= r["device"] <= r["rms_percent"] * FACTOR


def bounded(found: Rows) -> Rows:
    """References with a bound."""
    return [r for r in found if r.get("bound_percent") is not None]


def under(r: dict[str, Any]) -> bool:
    """Whether the error on the device is under the bound."""
    return r["device"] is not None and r["device"] <= r["bound_percent"]


def pessimism(found: Rows) -> float | None:
    """Median of bound over error."""
    ratios = [r["bound_percent"] / r["device"] for r in bounded(found) if r["device"]]
    return float(np.median(ratios)) if ratios else None


def share(hits: list[bool]) -> float | None:
    """Share of true ones; None where there is none at all."""
    return float(np.mean(hits)) if hits else None


def percent(x: float | None) -> str:
    """A share for a table."""
    return "-" if x is None else f"{100 * x:.0f} %"


def counts(kind: str, rows: Rows) -> list[str]:
    """A row of the table."""
    found = runs(rows)
    known, ends = stated(found), bounded(found)
    median = pessimism(found)
    by = [sum(row["feedback"] == f and "runs" in row for row in rows) for f in ("full", "slow", "none")]
    return [
        kind,
        *map(str, (len(rows), *by, sum("runs" not in row for row in rows), sum(row["approved"] for row in rows))),
        str(sum(row["approved"] and bool(row.get("unstable")) for row in rows)),
        str(sum(not row["approved"] and bool(row.get("unstable")) for row in rows)),
        str(len(found)),
        percent(share([close(r) for r in known])),
        percent(share([under(r) for r in ends])),
        "-" if median is None else f"{median:.3g}",
        str(len(found) - len(known)),
        f"{max((row['seconds'] for row in rows), default=0):.0f}",
    ]


HEAD = [
    "record", "n", "full", "slow", "forward only", "no loop", "approved", "approved but unstable",
    "refused and unstable", "references", f"within {FACTOR:g}x", "under bound", "bound / error", "not known",
    "most CPU s",
]  # fmt: skip


def missed(rows: Rows) -> list[str]:
    """One line per requirement that is missed, with the devices that did."""
    found: list[str] = []

    def demand(text: str, bad: Rows, met: bool) -> None:
        if not met:
            named = ", ".join(f"device {r['index']} {r['kind']}" for r in bad[:SHOWN])
            more = f" and {len(bad) - SHOWN} more" if len(bad) > SHOWN else ""
            found.append(f"{text}: {named}{more}")

    chirp = [r for r in rows if r["kind"] == "chirp"]
    other = [r for r in rows if r["kind"] != "chirp"]
    unstable = [r for r in rows if r["approved"] and r.get("unstable")]
    demand(f"{len(unstable)} approved loops are unstable or oscillate on the device", unstable, not unstable)
    differ = [r for r in rows if not r["one_verdict"]]
    demand(f"{len(differ)} runs whose exit status, JSON and verdict differ", differ, not differ)
    loopless = [r for r in rows if "runs" not in r]
    demand(f"{len(loopless)} records without any loop", loopless, not loopless)
    slow = [r for r in rows if r["seconds"] > SECONDS * max(r["rows"], 10_000) / 10_000]
    demand(f"{len(slow)} records take more than {SECONDS:g} CPU s for 10 000 rows", slow, not slow)
    without = [r for r in chirp if not (r["approved"] and r["feedback"] in ("full", "slow") and "runs" in r)]
    text = f"{percent(1 - len(without) / max(len(chirp), 1))} of records with chirp are approved with feedback"
    demand(f"{text}, not {percent(WITH_FEEDBACK)}", without, len(without) <= (1 - WITH_FEEDBACK) * len(chirp))
    asked = runs(chirp)
    far = [r for r in asked if r["rms_percent"] is None or not close(r)]
    text = f"{percent(1 - len(far) / max(len(asked), 1))} of errors with chirp lie within a factor of {FACTOR:g}"
    demand(f"{text}, not {percent(WITHIN_FACTOR)}", _rows(far), len(far) <= (1 - WITHIN_FACTOR) * len(asked))
    bounds = bounded(runs(other))
    above = [r for r in bounds if not under(r)]
    text = f"{percent(1 - len(above) / max(len(bounds), 1))} of errors without chirp lie under their bound"
    demand(f"{text}, not {percent(UNDER_BOUND)}", _rows(above), len(above) <= (1 - UNDER_BOUND) * len(bounds))
    median = pessimism(runs(other))
    if median is not None and median > PESSIMISM:
        found.append(f"the median bound without chirp is {median:.3g} times the error, not {PESSIMISM:g}")
    return found


def _rows(found: Rows) -> Rows:
    """The records of references, each once."""
    return list({(r["row"]["index"], r["row"]["kind"]): r["row"] for r in found}.values())


def main() -> int:
    """Run and print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("-n", type=int, default=50, help="devices")
    parser.add_argument("--seed", type=int, help="drawn if not given")
    parser.add_argument("--kinds", default=",".join(KINDS), help="kinds of record")
    parser.add_argument("--only", type=int, help="this device alone")
    parser.add_argument("--work", type=Path, help="figures so far; a later run goes on from there")
    parser.add_argument("--keep", type=Path, help="folder in which records and loops stay")
    parser.add_argument("-j", "--jobs", type=int, default=1, help="processes")
    given = parser.parse_args()
    kinds = given.kinds.split(",")
    if wrong := set(kinds) - set(KINDS):
        parser.error(f"--kinds must be some of {', '.join(KINDS)}. Got {', '.join(sorted(wrong))} instead.")
    known: Rows = []
    if given.work is not None and given.work.exists():
        known = [json.loads(text) for text in given.work.read_text().splitlines()]
    seed = given.seed if given.seed is not None else known[0]["seed"] if known else secrets.randbelow(1 << 31)
    devices = range(given.n) if given.only is None else [given.only]
    wanted = [(seed, index, kind) for index in devices for kind in kinds]
    known = [row for row in known if (row["seed"], row["index"], row["kind"]) in set(wanted)]
    done = {(row["seed"], row["index"], row["kind"]) for row in known}
    rows = known + run([at for at in wanted if at not in done], given.work, given.jobs, given.keep)
    rows.sort(key=lambda row: (row["index"], KINDS.index(row["kind"])))
    groups = {kind: [r for r in rows if r["kind"] == kind] for kind in kinds}
    print(f"seed {seed}\n\n" + table(HEAD, [counts(kind, r) for kind, r in {**groups, "all": rows}.items()]) + "\n")
    for row in rows:
        if row.get("unstable"):
            print(f"{line(row)}  [{row['device']}]")
    lines = missed(rows)
    print("\n".join(f"MISSED: {text} (seed {seed})" for text in lines) or "every requirement is met")
    return 1 if lines else 0


if __name__ == "__main__":
    sys.exit(main())
