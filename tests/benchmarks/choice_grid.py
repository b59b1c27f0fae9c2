"""S13: error of the kind that `auto` picks over that of the best kind, on devices that no default was tuned to.

Every cell is a family of devices with random parameters and a form of the data; every seed draws both again
(`choice_cases`).  All kinds are fitted to the same rows and scored on held-out signals of other forms.  `--work` keeps
the figures of every fit, so that an interrupted run goes on where it stopped:

    make choice

A kind that is far off after the short fit with which `auto` tries it is not fitted in full, nor are plays or Bouc-Wen
with dynamics where a static plant is far off without them.  A seed takes four minutes for the static plants and half an
hour for the foreign devices.
"""

import argparse
import json
import os
import secrets
import sys
import textwrap
import time
from collections import Counter
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

os.environ.setdefault("OMP_NUM_THREADS", "1")
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np
from choice_cases import DATA, FOREIGN, STATIC, case, equal, kinds, options

import hystfmu as hy
from hystfmu import InputError
from hystfmu.identify.catalogue import candidates

WITHOUT = {"g0_bouc_wen": "bouc_wen", "g0_prandtl_ishlinskii": "prandtl_ishlinskii"}  # the same kinds without dynamics
SHORT = {key: dict(c.quick) for key, c in candidates().values() if c.quick and not c.options}
FAR = 10.0  # times the least error: beyond it no full fit
COMMAND = "make choice"
MEDIAN, WORST, POOR = 1.3, 2.0, 3.0  # limits of auto / best; a refusal counts where the best kind is above (%FS)


def figures(at, key, **given):
    """Fit one kind; return its figures, or the reason of a refusal."""
    started = time.process_time()
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
    least = min((f["error"] for f in known.values() if np.isfinite(f.get("error", np.inf))), default=np.inf)
    chosen = known.get("auto", {})
    if chosen.get("choice") == key:  # the choice ends with this very fit
        return {"error": chosen["error"], "seconds": 0.0}
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
                self.known[tuple(row["at"])] = row["figures"]

    def add(self, at, found):
        self.known[at] = found
        with self.path.open("a") as f:
            f.write(json.dumps({"at": at, "figures": found}) + "\n")


def cell(family, form, seed, known):
    """Return the figures of one cell that are not known."""
    at, found = case(family, form, seed), {}
    for key in kinds(family):
        if key not in known:
            found[key] = next_figures(at, family, form, key, known | found)
    return (family, form, seed), found


def run(store, cells, jobs):
    """Fit what is not known, cell by cell."""
    left = []
    for family, form, seed in cells:
        known = {k: store.known[family, form, seed, k] for k in kinds(family) if (family, form, seed, k) in store.known}
        if len(known) < len(kinds(family)):
            left.append((family, form, seed, known))
    with ProcessPoolExecutor(jobs) as pool:
        for at, found in pool.map(cell, *zip(*left, strict=True)) if left else ():
            for key, figures_of_kind in found.items():
                store.add((*at, key), figures_of_kind)
            print(f"{at[0]}, {at[1]}, seed {at[2]}", file=sys.stderr, flush=True)


def errors(store, at):
    """Return the finite errors of all kinds on a cell."""
    found = {k: store.known[*at, k].get("error", np.inf) for k in kinds(at[0])[1:]}
    return {k: e for k, e in found.items() if np.isfinite(e)}


def ratio(store, at):
    """Return error of `auto` over the least of all kinds; nan for a refusal that counts, inf for another one."""
    best, chosen = min(errors(store, at).values(), default=np.inf), store.known[*at, "auto"]
    if "error" in chosen:
        return max(chosen["error"], equal(*at[:2])) / max(best, equal(*at[:2]))
    return np.nan if best > POOR else np.inf


def table(store, cells):
    """Return the table of families and forms, and how many meet the limits."""
    lines = ["| device | data | median | worst | refused | best kinds | chosen | least error, %FS |", "|" + "---|" * 8]
    met = []
    for family, form in dict.fromkeys(at[:2] for at in cells):
        drawn = [at for at in cells if at[:2] == (family, form)]
        ratios = np.array([ratio(store, at) for at in drawn])
        refused, rated = int(np.isnan(ratios).sum()), ratios[~np.isnan(ratios)]
        known = [errors(store, at) for at in drawn]
        best = [min(of, key=of.get, default="none") for of in known]
        least = np.median([min(of.values(), default=np.inf) for of in known])
        picked = [store.known[*at, "auto"].get("key", "refused") for at in drawn]
        median, worst = (np.median(rated), rated.max()) if len(rated) else (np.nan, np.nan)
        met.append(not len(rated) or bool(median <= MEDIAN and worst <= WORST))
        row = [family, form, f"{median:.2f}", f"{worst:.2f}", refused, _counted(best), _counted(picked), f"{least:.2g}"]
        lines.append("| " + " | ".join(map(str, row)) + " |")
    return lines, met


def _counted(names):
    """Return the names with how often each occurs, the most frequent first."""
    found = Counter(names).most_common(3)
    return ", ".join(name if count == len(names) else f"{name} {count}" for name, count in found)


def page(store, cells):
    """Return the page."""
    lines, met = table(store, cells)
    seconds = [store.known[*at, "auto"]["seconds"] for at in cells]
    seeds = sorted({at[2] for at in cells})
    drawn = f"The only seed is {seeds[0]}" if len(seeds) == 1 else f"The seeds are {', '.join(map(str, seeds))}"
    rows = zip(dict.fromkeys(at[:2] for at in cells), met, strict=True)
    missed = [f"{family} ({form})" for (family, form), good in rows if not good]
    found = (
        f"{sum(met)} of {len(met)} rows meet both goals; missed: {'; '.join(missed) or 'none'}. {drawn}. "
        'The columns "best kinds" and "chosen" state for how many seeds a kind was the best or was chosen; a kind '
        f"without a number applies to all seeds. The median time of a choice was {np.median(seconds):.1f} s on one "
        f"core. If the error of a kind after a short fit is more than {FAR:g} times the smallest error, the kind is "
        "not fitted further."
    )
    head = f"""# Choice of the kind of model

`{COMMAND}` writes this page. The columns "median" and "worst" are ratios: the error of the model that `hystfmu fit`
selects, divided by the error of the best kind of model. The errors are measured on held-out signals, which have other
forms than the data. Each row of the table belongs to one family of devices and one form of the data. For each row and
each of its seeds, `hystfmu fit` makes one choice. The first families are static plants of the same classes as the kinds
of model. The other families are devices of the literature. They have dynamics, covariates and noise, and independent
programs simulate them (`foreign` in the tests). Every seed gives new devices and new data. No default of HystFMU was
tuned to these devices. Errors below 0.05 %FS, or below twice the noise, are treated as equal. `hystfmu fit` may refuse
the data. A refusal is correct if the error of the best kind is more than {POOR:g} %FS, and the column "refused" counts
it. Otherwise the ratio is infinite. The goals for every row are a median of at most {MEDIAN:g} and a worst value of at
most {WORST:g}.

{textwrap.fill(found, 120)}
"""
    return "\n".join([head, *lines, ""])


def complete(store, cells):
    """Return the cells of which all figures are known."""
    return [at for at in cells if all((*at, k) in store.known for k in kinds(at[0]))]


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
    if done := complete(store, wanted):
        text = page(store, done)
        print(text)
        if a.out:
            a.out.write_text(text)
