"""The table of scenarios/stage/README.md: one row for each controller, from baselines and the records beside it."""

import tomllib
from math import inf, isfinite
from pathlib import Path
from typing import Any

from page_table import table
from tracking_table import baseline

STAGE = Path(__file__).parents[1] / "scenarios" / "stage"
PAGE = STAGE / "README.md"
CONTROLLERS = {
    "integral_notch": "integral and notch, plain", "open_loop": "feed-forward and inverse",
    "charge_drive": "charge drive, IRC", "law_2005": "law of 2005 (PD)", "h_infinity": "H-infinity loop shaping",
    "irc": "IRC", "ppf": "PPF", "ppf_repetitive": "PPF, repetitive", "irc_repetitive": "IRC, repetitive",
}  # fmt: skip
CHARGE = "charge_drive"
"""Has little hysteresis to invert, of whatever class."""
SCANS = (10, 50, 100, 200)
HEAD = [
    *(f"{f} Hz" for f in SCANS), "largest, 100 Hz", "modes -20; +20 %", "two steps", "settling, ms", "noise, nm",
    "variation", "Ms, dB", "Ms, modes -20; +20 %", "bandwidth, Hz",
]  # fmt: skip
LIMITS = HEAD[HEAD.index("Ms, dB") :]
"""Columns of a loop, in which no value wins: a limit holds for all."""
OURS = ("ppf_repetitive", "irc_repetitive")
DRAWS = ["median", "95 %", "worst", "unstable", "inside"]


def row(name: str) -> list[str]:
    """Errors and margins of one controller as text."""
    found, loops = baseline(f"stage/{name}"), recorded("loops")[name]
    lines = {case: m["lines"] for case, m in found.items()}
    texts = [f"{lines[f'scan_{f}']:.2g}" for f in SCANS]
    texts += [f"{found['scan_100']['worst']:.2g}", f"{lines['low_100']:.2g}; {lines['high_100']:.2g}"]
    settling = loops["settling_s"]
    texts += [f"{lines['two_steps_100']:.2g}", f"{1e3 * settling:.0f}" if isfinite(settling) else "above 20"]
    texts += [f"{1e3 * found['slow']['error']:.2g}", f"{found['scan_100']['variation']:.2f}"]
    if "Ms_db" not in loops:  # no feedback
        return [*texts, "", "", ""]
    Ms = {k: f"{loops[k]:.1f}" if isfinite(loops[k]) else "unstable" for k in ("Ms_db", "Ms_low_db", "Ms_high_db")}
    return [*texts, Ms["Ms_db"], f"{Ms['Ms_low_db']}; {Ms['Ms_high_db']}", f"{loops['bandwidth_hz']:.0f}"]


def recorded(what: str) -> dict[str, dict[str, Any]]:
    """What a script of scenarios/stage/models recorded, by controller."""
    return tomllib.loads((STAGE / f"{what}.record.toml").read_text())


def draws(name: str) -> list[str]:
    """What 1000 draws of the stage gave, for modes known to 5 and to 20 %."""
    texts = []
    for known in (5, 20):
        d = recorded("draws")[name][f"known_to_{known}"]
        lo, hi = d["interval"]
        texts += [*(f"{d[k]:.2g}" for k in ("median", "p95", "worst")), str(d["unstable"])]
        texts.append(f"{100 * d['inside'] / d['draws']:.1f} ({100 * lo:.1f} to {100 * hi:.1f})")
    return texts


def _value(cell: str) -> float:
    """Return what a cell counts: the larger one of two, infinite where it is above what was measured."""
    if not cell or cell.startswith("above"):
        return inf
    return max(float(part.split(" (")[0]) for part in cell.split("; "))


def winners(head: list[str], found: dict[str, list[str]]) -> dict[str, list[str]]:
    """Rows with the best printed value, by column: the largest share inside, the smallest of everything else."""
    best = {}
    for k, column in enumerate(head):
        sign = -1 if column.startswith("inside") else 1
        values = {name: sign * _value(texts[k]) for name, texts in found.items() if texts[k]}
        least = [name for name, value in values.items() if value == min(values.values())]
        if column not in LIMITS and len(least) < len(values):
            best[column] = least
    return best


def _table(title: str, head: list[str], found: dict[str, list[str]]) -> str:
    """Rows with the best values of every column in bold."""
    best = winners(head, found)
    rows = []
    for name, texts in found.items():
        cells = [f"**{t}**" if name in best.get(c, ()) else t for c, t in zip(head, texts, strict=True)]
        rows.append([CONTROLLERS[name], *cells])
    return table([title, *head], rows)


def wins(head: list[str], found: dict[str, list[str]]) -> str:
    """Sentence that names the columns in which no repetitive part is best."""
    best = {c: names for c, names in winners(head, found).items() if not set(names) & set(OURS)}
    if not best:
        return ""
    rows = [
        f"- {c}: {', '.join(f'{CONTROLLERS[n]} ({found[n][head.index(c)]})' for n in names)}"
        for c, names in best.items()
    ]
    return "\n".join(["In these columns, another controller is better than both repetitive controllers:", "", *rows])


def bouc_wen(name: str) -> list[str]:
    """Errors of one controller at 100 Hz on the other actuator as text."""
    lines = {case: m["lines"] for case, m in baseline(f"stage/{name}").items()}
    return [f"{lines[f'bouc_wen_{case}_100']:.2g}" for case in ("scan", "low", "high", "two_steps")]


def markdown() -> str:
    """All tables."""
    nominal = {name: row(name) for name in CONTROLLERS}
    errors = _table("RMS on the lines, % of stroke", HEAD, nominal)
    head = [f"{d}, {known} %" for known in (5, 20) for d in DRAWS]
    drawn = {name: draws(name) for name in CONTROLLERS}
    other = {name: bouc_wen(name) for name in CONTROLLERS if name != CHARGE}
    second = _table("Bouc-Wen actuator, 100 Hz", ["RMS on the lines", "modes -20 %", "modes +20 %", "two steps"], other)
    parts = [errors, wins(HEAD, nominal), second, _table("1000 draws at 100 Hz", head, drawn), wins(head, drawn)]
    return "\n\n".join(part for part in parts if part)
