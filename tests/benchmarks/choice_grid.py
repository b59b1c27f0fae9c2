"""S13: error of the kind that `auto` picks over that of the best kind, on plants that no default was tuned to.

Every cell is a family of plants with random parameters and a form of the data; every seed draws both again.  All kinds
are fitted to the same rows and scored on the held-out signals, which are of other forms.  `--work` keeps the figures of
every fit, so that an interrupted run goes on where it stopped:

    make choice

A kind that is far off after the short fit with which `auto` tries it is not fitted in full, nor are plays or Bouc-Wen
with dynamics where the kind without them is far off: no plant here has dynamics.  A seed takes four minutes.
"""

import argparse
import json
import os
import secrets
import sys
import textwrap
import time
from collections import Counter
from pathlib import Path

os.environ.setdefault("OMP_NUM_THREADS", "1")
sys.path.insert(0, str(Path(__file__).parent.parent / "oracles"))

import numpy as np
from random_plants import FAMILIES, draw

import hystfmu as hy
from hystfmu import Dataset, InputError
from hystfmu.data import signals
from hystfmu.identify import METHODS
from hystfmu.identify.catalogue import candidates

DYNAMICS = ("bouc_wen_oscillator", "duhem_oscillator", "narx_network")
KINDS = [k for k in METHODS if k not in ("auto", *DYNAMICS)]
STATIC = {"g0_bouc_wen": "bouc_wen", "g0_prandtl_ishlinskii": "prandtl_ishlinskii"}  # the same kinds without dynamics
SHORT = {key: dict(c.quick) for key, c in candidates()[0].values() if c.quick and not c.options}
ORDER = ["auto", "prandtl_ishlinskii", "bouc_wen", "actuator"]  # first, because they are often the best
ORDER += [k for k in KINDS if k not in ORDER]
FAR = 10.0  # times the least error: beyond it no full fit
COMMAND = "make choice"
H = 1e-3  # s, time between rows
MEDIAN, WORST, POOR = 1.3, 2.0, 3.0  # limits of auto / best; a refusal counts where the best kind is above (%FS)


def _nested(rng):
    return signals.training(40, int(rng.integers(1 << 31)), 0.015)


def _decaying(rng):
    return signals.decaying_sine(10, rng.uniform(0.07, 0.15))


def _staircase(rng):
    """Minor loops at rising offsets."""
    return signals.minor_loops(int(rng.integers(7, 12)), rng.uniform(0.12, 0.25), 100)


def _few(rng):
    return signals.training(40, int(rng.integers(1 << 31)), 0.08)[:200]


# input, noise (share of the span of y), then scale and offset of u and y
DATA = {
    "nested reversals": (_nested, 0.0, (1.0, 0.0), (1.0, 0.0)),
    "decaying sine": (_decaying, 0.0, (1.0, 0.0), (1.0, 0.0)),
    "staircase": (_staircase, 0.0, (1.0, 0.0), (1.0, 0.0)),
    "200 rows": (_few, 0.0, (1.0, 0.0), (1.0, 0.0)),
    "0.5 % noise": (_nested, 0.005, (1.0, 0.0), (1.0, 0.0)),
    "volts and metres": (_nested, 0.0, (50.0, 50.0), (1e-6, 0.0)),
    "offset": (_nested, 0.0, (1.0, 3.0), (1.0, 10.0)),
}


class Case:
    """One plant and one record of it."""

    def __init__(self, family, form, seed):
        self.plant = draw(family, seed)
        excite, noise, self.to_u, self.to_y = DATA[form]
        rng = np.random.default_rng([seed, list(FAMILIES).index(family), list(DATA).index(form)])
        x = excite(rng)
        y = self.out(x)
        y = y + noise * np.ptp(y) * rng.normal(size=len(y))
        self.data = Dataset.from_signal(self.into(x), y, H)
        self.held_out = [(self.into(x), self.out(x)) for x in signals.held_out(int(rng.integers(1 << 31))).values()]

    def into(self, x):
        return self.to_u[0] * x + self.to_u[1]

    def out(self, x):
        return self.to_y[0] * self.plant(x) + self.to_y[1]

    def error(self, model):
        """RMS error over all held-out signals in % of the span of the training rows."""
        e = np.concatenate([model.predict(u) - y for u, y in self.held_out])
        return 100 * float(np.sqrt(np.mean(e**2))) / self.data.span


def figures(case, key, **options):
    """Fit one kind; return its figures, or the reason of a refusal."""
    started = time.process_time()
    try:
        model = hy.fit(case.data, key, **options)
    except InputError as e:
        return {"refused": str(e), "seconds": time.process_time() - started}
    found = {"error": case.error(model), "seconds": time.process_time() - started}
    if key == "auto":
        found |= {"key": model.key, "choice": model.provenance["auto_choice"], "validation": model.provenance["auto"]}
    return found


def next_figures(case, key, known):
    """Return the figures of one kind, from a full fit only where those that are known leave it a chance."""
    least = min((f["error"] for f in known.values() if np.isfinite(f.get("error", np.inf))), default=np.inf)
    chosen = known.get("auto", {})
    if chosen.get("choice") == key:  # the choice ends with this very fit
        return {"error": chosen["error"], "seconds": 0.0}
    without = known.get(STATIC.get(key), {})
    if "left out" in without or not without.get("error", 0.0) <= FAR * least:
        return {"left out": f"{STATIC[key]} is far off", "seconds": 0.0}
    if key in SHORT and not (found := figures(case, key, **SHORT[key])).get("error", 0.0) <= FAR * least:
        return {"left out": f"{found['error']:.3g} %FS after a short fit", "seconds": found["seconds"]}
    return figures(case, key)


class Store:
    """Figures by cell, seed and kind, appended to a file as they come."""

    def __init__(self, path):
        self.path, self.known = path, {}
        if path.exists():
            for line in path.read_text().splitlines():
                row = json.loads(line)
                self.known[tuple(row["at"])] = row["figures"]

    def add(self, at, found):
        self.known[at] = found
        with self.path.open("a") as f:
            f.write(json.dumps({"at": at, "figures": found}) + "\n")


def run(store, seeds):
    for seed in seeds:
        for family in FAMILIES:
            for form in DATA:
                known = {k: store.known[*at, k] for k in ORDER if (*(at := (family, form, seed)), k) in store.known}
                case = Case(*at) if len(known) < len(ORDER) else None
                for key in (k for k in ORDER if k not in known):
                    known[key] = next_figures(case, key, known)
                    store.add((*at, key), known[key])
                print(f"{family}, {form}, seed {seed}", file=sys.stderr, flush=True)


def ratio(store, at):
    """Return error of `auto` over the least of all kinds; nan for a refusal that counts, inf for another one."""
    errors = [f["error"] for k in KINDS if "error" in (f := store.known[*at, k])]
    best, chosen = min((e for e in errors if np.isfinite(e)), default=np.inf), store.known[*at, "auto"]
    if "error" in chosen:
        return chosen["error"] / best
    return np.nan if best > POOR else np.inf


def table(store, seeds):
    """Return the table of cells, and how many meet the limits."""
    lines = ["| plant | data | median | worst | refused | best kinds | chosen | least error, %FS |", "|" + "---|" * 8]
    met = []
    for family in FAMILIES:
        for form in DATA:
            cells = [(family, form, seed) for seed in seeds]
            ratios = np.array([ratio(store, at) for at in cells])
            refused, rated = int(np.isnan(ratios).sum()), ratios[~np.isnan(ratios)]
            best = [min(KINDS, key=lambda k, at=at: store.known[*at, k].get("error", np.inf)) for at in cells]
            least = np.median([store.known[*at, k]["error"] for at, k in zip(cells, best, strict=True)])
            picked = [store.known[*at, "auto"].get("key", "refused") for at in cells]
            median, worst = (np.median(rated), rated.max()) if len(rated) else (np.nan, np.nan)
            met.append(not len(rated) or (median <= MEDIAN and worst <= WORST))
            figures = [f"{median:.2f}", f"{worst:.2f}", refused, _counted(best), _counted(picked), f"{least:.2g}"]
            lines.append("| " + " | ".join(map(str, [family, form, *figures])) + " |")
    return lines, met


def _counted(names):
    """Return the names with how often each occurs, the most frequent first."""
    found = Counter(names).most_common(3)
    return ", ".join(name if count == len(names) else f"{name} {count}" for name, count in found)


def page(store, seeds):
    lines, met = table(store, seeds)
    seconds = [f["seconds"] for at, f in store.known.items() if at[3] == "auto" and at[2] in seeds]
    found = (
        f"{sum(met)} of {len(met)} cells meet both. Seeds drawn: {', '.join(map(str, seeds))}. A choice took "
        f"{np.median(seconds):.1f} s of one core (median). A kind that errs by more than {FAR:g} times the least error "
        "after a short fit is not fitted in full."
    )
    head = f"""# Choice of the kind of model

`{COMMAND}` writes this page: the held-out error of the model that `hystfmu fit` picks over that of the best kind, for
plants with random parameters and forms of data, on signals of other forms than the data (`signals.held_out`). Every
seed draws plants and data anew; no default was tuned to them. A refusal counts where the best kind errs by more than
{POOR:g} %FS; another one would stand as an infinite ratio. Wanted in every cell: median at most {MEDIAN:g}, worst at
most {WORST:g}.

{textwrap.fill(found, 120)}
"""
    return "\n".join([head, *lines, ""])


def complete(store):
    """Return the seeds of which all figures are known."""
    seeds = sorted({at[2] for at in store.known})
    every = [(a, b, k) for a in FAMILIES for b in DATA for k in ORDER]
    return [seed for seed in seeds if all((a, b, seed, k) in store.known for a, b, k in every)]


if __name__ == "__main__":
    p = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    p.add_argument("--seeds", type=int, default=10, help="how many seeds to draw, besides those in the file of figures")
    p.add_argument("--again", type=int, nargs="*", default=[], help="seeds to use before new ones are drawn")
    p.add_argument("--work", type=Path, default=Path("choice.jsonl"), help="figures of all fits so far")
    p.add_argument("-o", "--out", type=Path, help="page to write")
    a = p.parse_args()
    store = Store(a.work)
    drawn = list(dict.fromkeys([*a.again, *(at[2] for at in store.known)]))[: a.seeds]
    drawn += [secrets.randbelow(100_000) for _ in range(a.seeds - len(drawn))]
    run(store, drawn)
    if done := complete(store):
        text = page(store, done)
        print(text)
        if a.out:
            a.out.write_text(text)
