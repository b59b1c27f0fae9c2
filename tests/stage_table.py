"""The table of scenarios/stage/README.md: one row for each controller, from baselines and the records beside it."""

from __future__ import annotations

import tomllib
from math import isfinite
from pathlib import Path
from typing import Any

from tracking_table import baseline

STAGE = Path(__file__).parents[1] / "scenarios" / "stage"
PAGE = STAGE / "README.md"
CONTROLLERS = {
    "integral_notch": "integral and notch, plain",
    "open_loop": "feed-forward and inverse",
    "charge_drive": "charge drive, IRC",
    "law_2005": "law of 2005",
    "h_infinity": "H-infinity loop shaping",
    "irc": "IRC",
    "ppf": "PPF",
    "ppf_repetitive": "PPF, repetitive",
    "irc_repetitive": "IRC, repetitive",
}
SCANS = (10, 50, 100, 200)
HEAD = [
    *(f"{f} Hz" for f in SCANS),
    "largest, 100 Hz",
    "modes -20; +20 %",
    "two steps",
    "settling, ms",
    "noise, nm",
    "variation",
    "Ms, dB",
    "Ms, modes -20; +20 %",
    "bandwidth, Hz",
]
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


def _table(head: list[str], rows: dict[str, list[str]]) -> str:
    lines = [f"| {' | '.join(head)} |", "|" + "---|" * len(head)]
    return "\n".join([*lines, *(f"| {' | '.join([name, *cells])} |" for name, cells in rows.items())])


def markdown() -> str:
    """Both tables."""
    errors = _table(["RMS on the lines, % of stroke", *HEAD], {text: row(name) for name, text in CONTROLLERS.items()})
    head = [f"{d}, {known} %" for known in (5, 20) for d in DRAWS]
    share = _table(["1000 draws at 100 Hz", *head], {text: draws(name) for name, text in CONTROLLERS.items()})
    return f"{errors}\n\n{share}"
