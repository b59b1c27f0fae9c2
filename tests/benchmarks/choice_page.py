"""Page of the choice benchmark: ratios to the best kind and to the fitted true structure, and what they miss."""

import textwrap
from collections import Counter

import numpy as np
from choice_cases import TRUTH, equal
from foreign.truth import GRAPHS

COMMAND = "make choice"
MEDIAN, WORST, POOR = 1.3, 2.0, 3.0  # limits of auto / best; a refusal counts where the best kind is above (%FS)
NEAR = 3.0  # limit of the median of auto / fitted true structure
COLUMNS = ("device", "data", "seeds", "median", "worst", "refused", "best kinds", "chosen", "least error, %FS")
LATER = "Spencer's MR damper"  # its program takes the velocity at a row from the next row
OF_TRUTH = ("truth, %FS", "ratio to truth")


def errors(known):
    """Return the finite errors of all kinds on a cell; options that the choice takes count for their kind."""
    found = {
        k: f["error"] for k, f in known.items() if k not in ("auto", TRUTH) and np.isfinite(f.get("error", np.inf))
    }
    if "error" in (chosen := known["auto"]):
        found[chosen["key"]] = min(chosen["error"], found.get(chosen["key"], np.inf))
    return found


def ratio(at, known):
    """Return error of `auto` over the least of all kinds; nan for a refusal that counts, inf for another one."""
    best, chosen = min(errors(known).values(), default=np.inf), known["auto"]
    if "error" in chosen:
        return _ratio(at, chosen["error"], best)
    return np.nan if best > POOR else np.inf


def to_truth(at, known):
    """Return error of `auto` over that of the fitted true structure; inf for a refusal."""
    return _ratio(at, known["auto"].get("error", np.inf), known[TRUTH]["error"])


def _ratio(at, error, other):
    return max(error, equal(*at[:2])) / max(other, equal(*at[:2]))


def table(cells):
    """Return the lines of the table, and by row whether it meets the limits and its median ratio to the truth."""
    lines = ["| " + " | ".join((*COLUMNS, *OF_TRUTH)) + " |", "|" + "---|" * len((*COLUMNS, *OF_TRUTH))]
    met, near = {}, {}
    for row in dict.fromkeys(at[:2] for at in cells):
        drawn = [(at, known) for at, known in cells.items() if at[:2] == row]
        ratios = np.array([ratio(*one) for one in drawn])
        refused, rated = int(np.isnan(ratios).sum()), ratios[~np.isnan(ratios)]
        found = [errors(known) for _, known in drawn]
        best = [min(of, key=of.get, default="none") for of in found]
        least = np.median([min(of.values(), default=np.inf) for of in found])
        picked = [known["auto"].get("key", "refused") for _, known in drawn]
        median, worst = (np.median(rated), rated.max()) if len(rated) else (np.nan, np.nan)
        met[row] = not len(rated) or bool(median <= MEDIAN and worst <= WORST)
        told = [*row, len(drawn), f"{median:.2f}", f"{worst:.2f}", refused, _counted(best), _counted(picked)]
        told += [f"{least:.2g}", "-", "-"]
        if TRUTH in drawn[0][1]:
            near[row] = float(np.median([to_truth(*one) for one in drawn]))
            told[-2:] = f"{np.median([known[TRUTH]['error'] for _, known in drawn]):.2g}", f"{near[row]:.3g}"
        lines.append("| " + " | ".join(map(str, told)) + " |")
    return lines, met, near


def _counted(names):
    """Return the names with how often each occurs, the most frequent first."""
    found = Counter(names).most_common(3)
    return ", ".join(name if count == len(names) else f"{name} {count}" for name, count in found)


def _list(told):
    """Return rows by device, each with the text that belongs to its form of the data."""
    devices = dict.fromkeys(device for device, _ in told)
    return "; ".join(f"{d} ({', '.join(t for (of, _), t in told.items() if of == d)})" for d in devices) or "none"


def _of_truth(near):
    """Return the sentences on the ratio to the fitted true structure."""
    above = {row: f"{row[1]} {x:.3g}" for row, x in near.items() if x > NEAR}
    families = dict.fromkeys(row[0] for row in near)
    own = [name for name in families if name not in GRAPHS]
    if not near:
        return ""
    later = (
        f" The program of {LATER} takes the velocity at a row from the next row; no graph knows this row, so that the "
        "truth of this device contains the difference."
    )
    graphs, median = len(families) - len(own), np.median(list(near.values()))
    return (
        f"The median ratio to the truth over {len(near)} rows is {median:.3g}; the goal is at most "
        f"{NEAR:g}. {len(near) - len(above)} of {len(near)} rows are at most {NEAR:g}; above it: {_list(above)}. The "
        f"true structure of {graphs} devices is a graph of blocks, which `hystfmu.fit` fits with free parameters. No "
        f"graph of blocks has the structure of the other devices ({'; '.join(own)}); for these, least squares fits the "
        "parameters of their own programs. Both fits start at the true parameters."
        f"{later if LATER in families else ''}"
    )


def _of_code(cells):
    """Return the sentences on seeds and commits."""
    by = {}
    for at, known in cells.items():
        by.setdefault(at[2], []).append(known["auto"].get("code", "unknown"))
    seeds = []
    for seed, codes in by.items():
        of = ", ".join(f"{count} at commit {code}" for code, count in Counter(codes).most_common())
        seeds.append(f"seed {seed} has {len(codes)} rows ({of})")
    return f'The column "seeds" states how many seeds a row has: {"; ".join(seeds)}.'


def page(cells):
    """Return the page of cells, each with the figures of its kinds."""
    lines, met, near = table(cells)
    seconds = [known["auto"]["seconds"] for known in cells.values()]
    found = (
        f"{sum(met.values())} of {len(met)} rows meet both goals; missed: "
        f"{_list({row: row[1] for row, good in met.items() if not good})}. {_of_code(cells)} "
        'The columns "best kinds" and "chosen" state for how many seeds a kind was the '
        "best or was chosen; a kind without a number applies to all seeds. The median time of a choice was "
        f"{np.median(seconds):.1f} s on one core."
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

The best kind is the best of the kinds that are fitted. A kind is not fitted further if its error after a short fit is
more than ten times the smallest error. No further kind is fitted if one error already counts as equal, because
then no other kind changes the ratio.

{textwrap.fill(found, 120)}

The column "truth, %FS" is the median error of the true structure of a device of the literature. Its parameters are
fitted to the same record, and its error is measured on the same held-out signals. The column "ratio to truth" is the
error of the selected model divided by this error, the median over the seeds. If `hystfmu fit` refuses the data, this
ratio is infinite.

{textwrap.fill(_of_truth(near), 120)}
"""
    return "\n".join([head, *lines, ""])
