"""Do the 95 % intervals of fits hold on new signals?  Drawn devices decide, with solvers of their own.

Every device gives a record of one kind of signal; a model is fitted by name (every tenth device: by `auto` with
`--auto`), and the errors on new signals, of the same kind and of others, are counted inside the interval:

    make intervals                                        # 200 devices drawn anew
    python tests/benchmarks/intervals.py --seed 7 -n 20   # the first twenty of another draw

`--work FILE.jsonl` keeps the figures of every device, so that an interrupted run goes on where it stopped.  The exit
status is 1 where a goal is missed: 90 to 99 % of the rows of signals of the same kind over all devices, and at least
80 % on nine of ten devices.
"""

import argparse
import json
import os
import secrets
import sys
import time
from concurrent.futures import ProcessPoolExecutor, as_completed
from pathlib import Path

os.environ.setdefault("OMP_NUM_THREADS", "1")
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np
from interval_cases import NAMES, RECORDS, Case

import hystfmu as hy
from hystfmu.face.interval import known
from hystfmu.report.terminal import table

POOLED, LEAST, DEVICES = (0.90, 0.99), 0.80, 0.9
AUTO = 10  # one of so many devices is fitted by auto, where asked


def figures(seed, number, auto):
    """Figures of one device."""
    case, started = Case(number, seed), time.process_time()
    key = "auto" if auto and number % AUTO == 0 else case.kind
    row = {"seed": seed, "number": number, "device": case.name, "record": case.form, "key": key}
    try:
        model = hy.fit(case.data, key)
        fitted = time.process_time()
        found = known(model, case.data)
    except hy.InputError as e:
        return {**row, "refused": str(e)}
    if found is None:
        return {**row, "refused": "no interval"}
    row |= {"kind": model.key, "fit_seconds": fitted - started, "seconds": time.process_time() - fitted}
    row |= {"half_width": found.interval.half_width / case.data.span, "noise_only": found.noise_only}
    row["signals"] = {}
    for form, other in case.others.items():
        e = np.abs(other.y - model.predict(other))
        row["signals"][form] = {
            "inside": float(np.mean(e <= found.interval.half_width)),
            "rms": float(np.sqrt(np.mean(e**2))) / case.data.span,
            "named": form != case.form and NAMES[form] in found.not_for,
        }
    return row


def run(todo, path, jobs, auto):
    """Work through the devices; append each to the file as it comes."""
    rows = []
    with ProcessPoolExecutor(jobs) as pool:
        for done in as_completed([pool.submit(figures, *at, auto) for at in todo]):
            rows.append(done.result())
            if path is not None:
                with path.open("a") as f:
                    f.write(json.dumps(rows[-1]) + "\n")
            print(f"{len(rows)}/{len(todo)}", end="\r", file=sys.stderr, flush=True)
    return rows


def line(name, inside, ratio):
    """Row of the table: how many signals, rows inside, signals with enough of them, width over RMS error."""
    if not len(inside):
        return [name, "0", *"----"]
    shares = [
        f"{100 * np.mean(inside):.1f} %",
        f"{100 * np.mean(inside >= LEAST):.1f} %",
        f"{100 * inside.min():.0f} %",
    ]
    return [name, str(len(inside)), *shares, f"{np.median(ratio):.2f}, {ratio.max():.1f}"]


def main():
    """Run and print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("-n", type=int, default=200, help="devices")
    parser.add_argument("--seed", type=int, help="drawn if not given")
    parser.add_argument("--auto", action="store_true", help=f"fit every {AUTO}th device by auto")
    parser.add_argument("--work", type=Path, help="figures so far; a later run goes on from there")
    parser.add_argument("-j", "--jobs", type=int, default=1, help="processes")
    given = parser.parse_args()
    have = given.work is not None and given.work.exists()
    rows = [json.loads(text) for text in given.work.read_text().splitlines()] if have else []
    seed = given.seed if given.seed is not None else rows[0]["seed"] if rows else secrets.randbelow(1 << 31)
    rows = [r for r in rows if r["seed"] == seed and r["number"] < given.n]
    left = sorted(set(range(given.n)) - {r["number"] for r in rows})
    rows += run([(seed, k) for k in left], given.work, given.jobs, given.auto)
    held = [r for r in rows if "refused" not in r]

    def over(chosen):
        """Shares of the signals that are chosen, and widths over their RMS errors."""
        found = [(s, r) for r in held for form, s in r["signals"].items() if chosen(r, form, s)]
        return np.array([s["inside"] for s, r in found]), np.array([r["half_width"] / s["rms"] for s, r in found])

    same = over(lambda r, form, s: form == r["record"])
    lines = [line("same kind of signal", *same)]
    lines += [line(f"  {k}", *over(lambda r, f, s, k=k: f == r["record"] == k)) for k in RECORDS]
    lines += [
        line("other kinds, said to hold", *over(lambda r, f, s: f != r["record"] and not s["named"])),
        line("other kinds, named", *over(lambda r, f, s: s["named"])),
    ]
    print(f"seed {seed}: {len(held)} devices, {len(rows) - len(held)} refused\n")
    print(table(["signals", "n", "rows inside", f">= {100 * LEAST:.0f} %", "least", "width / RMS, most"], lines))
    cost = np.median([r["seconds"] / max(r["fit_seconds"], 1e-3) for r in held])
    print(f"\nan interval takes {cost:.1f} times the time of the fit (median)")
    pooled, enough = float(np.mean(same[0])), float(np.mean(same[0] >= LEAST))
    met = POOLED[0] <= pooled <= POOLED[1] and enough >= DEVICES
    print("met" if met else f"MISSED: {100 * pooled:.1f} % of the rows, {100 * enough:.1f} % of the devices")
    return 0 if met else 1


if __name__ == "__main__":
    sys.exit(main())
