"""Compare two studies on one page.

The page shows the shares of variations inside the limits, the distributions of the metrics, and the variations whose
outcome (inside the limits, outside, unstable, failed) changed.
"""

from pathlib import Path

import numpy as np
from scipy.special import bdtr

from hystfmu.base import InputError, Mask, escape, write_text
from hystfmu.report.diagrams import Bar, Bars, Parallel
from hystfmu.report.page import Section, Table, figures, page, section, table
from hystfmu.report.plot import Line, Plot
from hystfmu.scenario.outcome.metrics import label
from hystfmu.scenario.outcome.result import Change
from hystfmu.scenario.report.compare import change_table
from hystfmu.studies.figures import coordinate, share_bar, share_bars
from hystfmu.studies.summary import WORDS, Read, is_study, read_study

WHICH = ("old", "new")
PERCENTILES = (50, 95, 99)
# largest numbers of bars, of distributions, and of changed variations in the table and in the plot
MOST_PAIRS, MOST_PLOTS, MOST_ROWS, MOST_DRAWN = 5, 12, 100, 300
LONGEST = 3.0  # a distribution is plotted up to this multiple of its limit or of its 95 % percentile
UNPAIRED = "The variations of the two studies differ. Therefore no variation has two verdicts."


def compare_studies(before: str | Path, after: str | Path, out: str | Path) -> list[Change]:
    """Write the page `out` that compares two studies.

    `before` and `after` are each the folder of a study, or the report.json in this folder.

    Return the differences of the shares inside the limits (percent) and of the percentiles of the metrics. An
    InputError is raised if `before` or `after` is not a result of ``hystfmu study``.
    """
    for path, other in ((before, after), (after, before)):
        if is_study(path) and not is_study(other):
            raise InputError(f"{other}: not a report of 'hystfmu study': two studies are compared")
    both = read_study(before), read_study(after)
    found, same = _changes(both)
    body = ["<h1>Two studies side by side</h1>", f'<p class="answer">{escape(_answer(both))}</p>']
    named = zip(WHICH, (before, after), both, strict=True)
    text = " ".join(f"{w.capitalize()}: {p}, study {r.facts.name} of {r.facts.scenario}." for w, p, r in named)
    body.append(f'<p class="lead">{escape(text)}</p>')
    body.append(f'<div class="plots hero">{figures([_shares(both)])}<div>{table(change_table(found[:8]))}</div></div>')
    plots = _distributions(both)
    if plots:
        body.append(section(Section("Distributions on common axes", plots=plots)))
    body.append(section(_verdicts(both)))
    if found:
        folded = [change_table(same)] if same else []
        body.append(section(Section("All changes", "", [change_table(found)], folded=folded)))
    write_text(out, page("HystFMU comparison of studies", body))
    return found


def _paired(both: tuple[Read, Read]) -> bool:
    """Return whether the variations with the same number have the same parameter values in both studies."""
    a, b = both
    return list(a.facts.parameters) == list(b.facts.parameters) and np.array_equal(a.values, b.values, equal_nan=True)


def _share(r: Read) -> str:
    n, inside = len(r.facts.outcomes), r.facts.inside
    ends = r.facts.interval
    said = "" if ends is None else f", 95 % interval {100 * ends[0]:.3g} to {100 * ends[1]:.3g} %"
    return f"{inside} of {n} variations ({100 * inside / n:.3g} %{said})"


def _answer(both: tuple[Read, Read]) -> str:
    a, b = both
    said = f"Inside the limits: {_share(a)} before, {_share(b)} after."
    if not _paired(both):
        return f"{said} {UNPAIRED}"
    gained, lost = (int(np.sum(_inside(x) & ~_inside(y))) for x, y in ((b, a), (a, b)))
    if gained + lost == 0:
        return f"{said} No variation changed its verdict."
    p = _sign_test(gained, lost)
    return (
        f"{said} {gained + lost} variations changed their verdict, {gained} to inside and {lost} to outside: chance "
        f"alone is as one-sided with a probability of {p:.2g} (exact McNemar test)."
    )


def _inside(r: Read) -> Mask:
    return np.array([letter == "i" for letter in r.facts.outcomes])


def _sign_test(gained: int, lost: int) -> float:
    """Return the two-sided p-value of McNemar's test (1947, Psychometrika 12, 153-157).

    `gained` and `lost` are the numbers of variations that only the second and only the first study has inside the
    limits.
    """
    return min(1.0, 2 * float(bdtr(min(gained, lost), gained + lost, 0.5)))


def _within(r: Read, pair: tuple[str, str]) -> Mask:
    return np.asarray(r.metrics[pair] <= r.facts.limits[pair[0]][pair[1]])


def _pairs(both: tuple[Read, Read]) -> list[tuple[str, str]]:
    """Return case and metric of each limit of both studies; the limit that the fewest variations meet is first."""
    common = [pair for pair in both[0].metrics if pair in both[1].metrics]
    return sorted(common, key=lambda pair: min(float(_within(r, pair).mean()) for r in both))


def _shares(both: tuple[Read, Read]) -> Bars:
    bars = [_bar("all limits", _inside(r), w, r) for w, r in zip(WHICH, both, strict=True)]
    for pair in _pairs(both)[: MOST_PAIRS - 1]:
        bars += [_bar(f"{pair[0]}: {pair[1]}", _within(r, pair), w, r) for w, r in zip(WHICH, both, strict=True)]
    return share_bars(bars)


def _bar(name: str, good: Mask, which: str, r: Read) -> Bar:
    return share_bar(f"{name}, {which}", float(good.mean()), len(good), r.facts.interval is not None)


def _distributions(both: tuple[Read, Read]) -> list[Plot]:
    plots = []
    for case, metric in _pairs(both)[:MOST_PLOTS]:
        limits = [r.facts.limits[case][metric] for r in both]
        finite = [np.sort(v[np.isfinite(v)]) for v in (r.metrics[case, metric] for r in both)]
        if not all(map(len, finite)):
            continue
        most = LONGEST * max(*limits, *(float(np.quantile(v, 0.95)) for v in finite))
        lines = [
            Line(w, v[v <= most], 100 * np.arange(1, np.sum(v <= most) + 1) / len(r.facts.outcomes))
            for w, v, r in zip(WHICH, finite, both, strict=True)
        ]
        named = (
            {"limit": limits[0]}
            if limits[0] == limits[1]
            else dict(zip(("old limit", "new limit"), limits, strict=True))
        )
        lines += [Line(name, np.array([v, v]), np.array([0.0, 100.0])) for name, v in named.items()]
        unit = both[1].facts.units.get(metric, "")
        plots.append(Plot(f"{case}: {metric}", label(metric, unit), "% of the variations at or below", lines))
    return plots


def _verdicts(both: tuple[Read, Read]) -> Section:
    """Return a section with a table and a plot of the variations that have different outcomes in the two studies."""
    a, b = both
    title = "Draws that changed their verdict"
    if not _paired(both):
        return Section(title, UNPAIRED)
    pairs = list(zip(a.facts.outcomes, b.facts.outcomes, strict=True))
    moved = [k for k, (x, y) in enumerate(pairs) if x != y]
    if not moved:
        return Section(title, "None.")
    names = list(b.facts.parameters.values())
    rows = [[k, *a.values[k].tolist(), *(WORDS[letter] for letter in pairs[k])] for k in moved[:MOST_ROWS]]
    caption = f"{len(moved)} variations" + (f", the first {MOST_ROWS} of them" if len(moved) > MOST_ROWS else "")
    listed = Table(["draw", *names, *WHICH], rows, caption)
    drawn = [k for k in moved if "i" in pairs[k]][:MOST_DRAWN]
    if len(drawn) < 2:
        return Section(title, "", [listed])
    axes = [coordinate(name, a.values[drawn, j]) for j, name in enumerate(names)]
    good = np.array([pairs[k][1] == "i" for k in drawn])
    words = ("now inside the limits", "now outside")
    return Section(title, "", [], [Parallel("each a line across its values", axes, good, words)], folded=[listed])


def _changes(both: tuple[Read, Read]) -> tuple[list[Change], list[Change]]:
    """Return the shares and percentiles that differ between the two studies, and those that are equal."""
    every = [Change("all cases", "inside the limits, %", *(100 * float(_inside(r).mean()) for r in both))]
    for pair in _pairs(both):
        title, metric = f"{both[1].facts.scenario}/{pair[0]}", label(pair[1], both[1].facts.units.get(pair[1], ""))
        every.append(Change(title, f"{pair[1]} within its limit, %", *(100 * _within(r, pair).mean() for r in both)))
        for p in PERCENTILES:
            found = (float(np.quantile(r.metrics[pair], p / 100, method="inverted_cdf")) for r in both)
            every.append(Change(title, f"{metric}, {p} % of the variations", *found))
    return [c for c in every if c.old != c.new], [c for c in every if c.old == c.new]
