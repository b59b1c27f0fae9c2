"""S13: error of the kind that `auto` picks over that of the best kind, on devices that no default was tuned to.

Every cell is a family of devices with random parameters and a form of the data; every seed draws both again
(`choice_cases`).  All kinds are fitted to the same rows and scored on held-out signals of other forms.  `--work` keeps
the figures of every fit, so that an interrupted run goes on where it stopped:

    make choice

A kind that is far off after the short fit with which `auto` tries it is not fitted in full, nor are plays or Bouc-Wen
with dynamics where a static plant is far off without them.  Where an error counts as equal no other kind can change the
ratio, and the rest is not fitted.  The true structure of foreign devices is fitted as well (`foreign.truth`).
"""

import argparse
import json
import os
import secrets
import subprocess
import sys
import time
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

os.environ.setdefault("OMP_NUM_THREADS", "1")
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np
from choice_cases import DATA, FOREIGN, STATIC, TRUTH, asked, case, equal, options
from choice_page import page

import hystfmu as hy
from hystfmu import InputError
from hystfmu.identify.catalogue import candidates

WITHOUT = {"g0_bouc_wen": "bouc_wen", "g0_prandtl_ishlinskii": "prandtl_ishlinskii"}  # the same kinds without dynamics
SHORT = {key: dict(c.quick) for key, c in candidates().values() if c.quick and not c.options}
FAR = 10.0  # times the least error: beyond it no full fit


def code():
    """Commit of the tree, with `-dirty` where files differ from it."""
    told = ["git", "-C", str(Path(__file__).parent), "describe", "--always", "--dirty", "--exclude=*", "--abbrev=8"]
    return subprocess.run(told, capture_output=True, text=True, check=False).stdout.strip() or "unknown"


def figures(at, key, **given):
    """Fit one kind; return its figures, or the reason of a refusal."""
    started = time.process_time()
    if key == TRUTH:
        return {"error": at.truth(), "seconds": time.process_time() - started}
    try:
        model = hy.fit(at.data, key, **given)
    except InputError as e:
        return {"refused": str(e), "seconds": time.process_time() - started}
    found = {"error": at.error(model), "seconds": time.process_time() - started}
    if key == "auto":
        found |= {"key": model.key, "choice": model.provenance["auto_choice"], "validation": model.provenance["auto"]}
    return found


def next_figures(at, family, form, key, known):
    """Return the figures of one kind, from a full fit only where those that are known leave it a chance."""
    if key in ("auto", TRUTH):
        return figures(at, key)
    least = min(
        (f["error"] for k, f in known.items() if k != TRUTH and np.isfinite(f.get("error", np.inf))), default=np.inf
    )
    chosen = known.get("auto", {})
    if chosen.get("choice") == key:  # the choice ends with this very fit
        return {"error": chosen["error"], "seconds": 0.0}
    if least <= equal(family, form):
        return {"left out": "an error that counts as equal is known", "seconds": 0.0}
    without = known.get(WITHOUT.get(key), {}) if form in DATA else {}
    if "left out" in without or not without.get("error", 0.0) <= FAR * least:
        return {"left out": f"{WITHOUT[key]} is far off", "seconds": 0.0}
    if key in SHORT and not (found := figures(at, key, **SHORT[key])).get("error", 0.0) <= FAR * least:
        return {"left out": f"{found['error']:.3g} %FS after a short fit", "seconds": found["seconds"]}
    return figures(at, key, **options(key, family))


class Store:
    """Figures by cell, seed and kind, appended to a file as they come."""

    def __init__(self, path):
        self.path, self.known = path, {}
        if path.exists():
            for line in path.read_text().splitlines():
                row = json.loads(line)
                self.known.setdefault(tuple(row["at"][:3]), {})[row["at"][3]] = row["figures"]

    def add(self, at, key, found):
        self.known.setdefault(at, {})[key] = found
        with self.path.open("a") as f:
            f.write(json.dumps({"at": [*at, key], "figures": found}) + "\n")


def cell(at, known):
    """Return the figures of one cell that are not known."""
    made, found = case(*at), {}
    for key in asked(at[0]):
        if key not in known:
            found[key] = next_figures(made, *at[:2], key, known | found)
    return at, found


def run(store, cells, jobs):
    """Fit what is not known, cell by cell."""
    left = [at for at in cells if not complete(store, at)]
    tree = code()
    with ProcessPoolExecutor(jobs) as pool:
        for at, found in pool.map(cell, left, [store.known.get(at, {}) for at in left]):
            for key, of_kind in found.items():
                store.add(at, key, of_kind | ({"code": tree} if key == "auto" else {}))
            print(", ".join(map(str, at)), file=sys.stderr, flush=True)


def complete(store, at):
    """Whether all figures of a cell are known."""
    return set(asked(at[0])) <= set(store.known.get(at, ()))


if __name__ == "__main__":
    p = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    p.add_argument(
        "--seeds", type=int, default=10, help="seeds of the static plants, with those in the file of figures"
    )
    p.add_argument("--foreign", type=int, default=3, help="seeds of the foreign devices, the first of them")
    p.add_argument("--again", type=int, nargs="*", default=[], help="seeds to use before new ones are drawn")
    p.add_argument("--work", type=Path, default=Path("choice.jsonl"), help="figures of all fits so far")
    p.add_argument("--only", default="", help="devices whose names hold this")
    p.add_argument("-j", "--jobs", type=int, default=1, help="processes")
    p.add_argument("-o", "--out", type=Path, help="page to write")
    a = p.parse_args()
    store = Store(a.work)
    drawn = list(dict.fromkeys([*a.again, *(at[2] for at in store.known)]))[: max(a.seeds, a.foreign)]
    drawn += [secrets.randbelow(100_000) for _ in range(max(a.seeds, a.foreign) - len(drawn))]
    wanted = [(*of, seed) for of in STATIC for seed in drawn[: a.seeds]]
    wanted += [(*of, seed) for of in FOREIGN for seed in drawn[: a.foreign]]
    wanted = [at for at in wanted if a.only in at[0]]
    run(store, sorted(wanted, key=lambda at: drawn.index(at[2])), a.jobs)
    if done := {at: store.known[at] for at in wanted if complete(store, at)}:
        text = page(done)
        print(text)
        if a.out:
            a.out.write_text(text)
