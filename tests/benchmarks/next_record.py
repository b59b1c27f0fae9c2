"""Does the next measurement pay?  Foreign devices that began with one sine, measured again as `start` asks.

A model is fitted to the sine; the input that `hystfmu start` would write for it drives the device from rest; the same
fit to both records is scored on held-out signals within the band, the range and the speed of the sine.  Beside them
stands what the solver of the device itself reaches, its parameters fitted to the same records from the true ones on:

    python tests/benchmarks/next_record.py                            # a drawn seed, by auto
    python tests/benchmarks/next_record.py --seed 7 --key actuator    # by name
    python tests/benchmarks/next_record.py --only slip --work FILE.jsonl

`--work` keeps the figures, so that an interrupted run goes on where it stopped.  The exit status is 1 where an error
falls less than five times, stays above one and a half times what the true structure reaches on both records, and above
twice the noise of the record, which no fit can tell from the truth.
"""

import argparse
import json
import os
import secrets
import sys
import time
from pathlib import Path

os.environ.setdefault("OMP_NUM_THREADS", "1")
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

from next_cases import DEVICES, NOISE, Case

import hystfmu as hy
from hystfmu.report.terminal import table
from hystfmu.start.device import reference_frequency
from hystfmu.start.excitation import excitation
from hystfmu.start.run import CARRIED

PAYS, NEAR = 5.0, 1.5  # times smaller; times the error of the true structure


def fitted(case, data, key):
    """Kind, held-out error and seconds of a fit; no error where it is refused."""
    started = time.process_time()
    try:
        model = hy.fit(data, key)
    except hy.InputError as e:
        return None, {"refused": str(e), "seconds": time.process_time() - started}
    return model, {"kind": model.key, "error": case.error(model), "seconds": time.process_time() - started}


def figures(name, seed, key):
    """Figures of one device."""
    case = Case(name, seed)
    model, before = fitted(case, case.sine, key)
    u, h = excitation(case.sine, reference_frequency(case.sine), CARRIED / case.sine.h, model)
    both = hy.Dataset.joined([case.sine, case.measured(u, h)])
    _, after = fitted(case, both, key)
    rows, truth = [len(case.sine.u), len(u)], [case.truth(case.sine), case.truth(both)]
    return {"device": name, "seed": seed, "key": key, "rows": rows, "before": before, "after": after, "truth": truth}


def met(row):
    """Whether the measurement paid, or the error is below what the noise hides."""
    before, after = (row[k].get("error", float("inf")) for k in ("before", "after"))
    return after <= max(before / PAYS, NEAR * row["truth"][1], 200 * NOISE) and after < float("inf")


def line(row):
    """Row of the table."""
    before, after = row["before"], row["after"]
    told = [f"{of['error']:.3g} ({of['kind']})" if "error" in of else "refused" for of in (before, after)]
    ratio = f"{before['error'] / after['error']:.1f}" if "error" in before and "error" in after else "-"
    truth = "{:.2g}, {:.2g}".format(*row["truth"])
    seconds = f"{before['seconds']:.0f}, {after['seconds']:.0f}"
    return [
        row["device"], "{} + {}".format(*row["rows"]), *told, ratio, truth, seconds, "met" if met(row) else "MISSED",
    ]  # fmt: skip


def main():
    """Run and print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seed", type=int, help="drawn if not given")
    parser.add_argument("--key", default="auto", help="kind of model")
    parser.add_argument("--only", default="", help="devices whose names hold this")
    parser.add_argument("--work", type=Path, help="figures so far; a later run goes on from there")
    given = parser.parse_args()
    have = given.work is not None and given.work.exists()
    rows = [json.loads(text) for text in given.work.read_text().splitlines()] if have else []
    seed = given.seed if given.seed is not None else rows[-1]["seed"] if rows else secrets.randbelow(1 << 31)
    rows = [r for r in rows if (r["seed"], r["key"]) == (seed, given.key) and given.only in r["device"]]
    for name in DEVICES:
        if given.only in name and name not in {r["device"] for r in rows}:
            rows.append(figures(name, seed, given.key))
            if given.work is not None:
                with given.work.open("a") as f:
                    f.write(json.dumps(rows[-1]) + "\n")
    head = ["device", "rows", "sine alone, %FS", "with the next record", "ratio", "truth, %FS", "CPU s", "verdict"]
    print(f"seed {seed}, {given.key}\n\n{table(head, [line(r) for r in rows])}")
    return 0 if all(map(met, rows)) else 1


if __name__ == "__main__":
    sys.exit(main())
