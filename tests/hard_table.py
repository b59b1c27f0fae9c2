"""Tables of what loops do on hard devices, from the records of scenarios/models/run_hard.py."""

import tomllib
from math import isfinite
from pathlib import Path
from typing import Any

from page_table import table

SCENARIOS = Path(__file__).parents[1] / "scenarios"
RECORDS = {"loops": SCENARIOS / "loops" / "hard.record.toml", "stage": SCENARIOS / "stage" / "hard.record.toml"}
CASES = {
    "loops": {"nominal": "nominal", "damping_10": "damping 0.1", "damping_2": "damping 0.02",
        "second_mode": "second mode, 5 %", "gain_35": "gain 0.35", "double_mass": "double mass",
        "sensor_lag": "sensor lag 1 kHz", "jitter": "jitter of 20 %"},
    "stage": {
        "scan_100": "nominal", "damping_50": "damping 0.5", "damping_10": "damping 0.1", "damping_1": "damping 0.01",
        "second_mode": "second mode, 20 %", "gain_35": "gain 0.35", "double_mass": "double mass",
        "sensor_lag": "sensor lag 1 kHz", "jitter": "jitter of 20 %"},
}  # fmt: skip
RANGES = {"damping": "damping", "second_mode": "second mode, % of the gain", "gain": "gain"}
RECOMMENDED = (
    ("loops", "internal_model", "`internal_model`: any reference"),
    ("loops", "repetitive", "`repetitive`: a reference with a known period"),
    ("stage", "irc", "`stage/irc`: a lightly damped resonance"),
    ("stage", "irc_repetitive", "`stage/irc_repetitive`: scans"),
    ("stage", "ppf_repetitive", "`stage/ppf_repetitive`: scans"),
)
NAMES = {"damping": "damping", "gain": "gain", "second_mode": "second mode"}


def recorded(family: str) -> dict[str, dict[str, Any]]:
    """What was recorded, by loop: family `loops` or `stage`."""
    return tomllib.loads(RECORDS[family].read_text())


def number(name: str, value: float) -> str:
    """A value of a range as text: the second mode in percent."""
    return f"{100 * value:.2g}" if name == "second_mode" else f"{value:.2g}"


def between(name: str, ends: list[float]) -> str:
    """A range as text, rounded inwards, so that the text says no more than the record."""
    lo, hi = (100 * v if name == "second_mode" else v for v in ends)
    if lo == hi:
        return _rounded(lo, up=True) if lo else "none"
    return f"{_rounded(lo, up=True)} to {_rounded(hi, up=False)}"


def _rounded(value: float, up: bool) -> str:
    """Two digits, on the side that is inside."""
    text = f"{value:.2g}"
    if value and (float(text) < value) == up and float(text) != value:
        step = 10.0 ** (int(f"{value:e}".split("e")[1]) - 1)
        text = f"{float(text) + (step if up else -step):.2g}"
    return text


def errors(family: str, names: dict[str, str]) -> str:
    """Errors of the hard cases, settling and overshoot of a step, a row for every loop that has a record."""
    found = recorded(family)
    head = ["RMS, % of stroke", *CASES[family].values(), "step: settling, ms", "overshoot, %"]
    rows = []
    for name, text in names.items():
        if name in found:
            of = found[name]["cases"]
            cells = [f"{of[c]:.2g}" if isfinite(of[c]) else "unstable" for c in CASES[family]]
            rows.append([text, *cells, *_step(of, family)])
    return table(head, rows)


def _step(of: dict[str, float], family: str) -> list[str]:
    """Settling and overshoot; nothing where a step does not repeat, which the loop would have to learn."""
    if "settling_s" not in of:
        return ["", ""]
    longest = {"loops": "above 90", "stage": "above 20"}[family]
    settling = of["settling_s"]
    return [f"{1e3 * settling:.2g}" if isfinite(settling) else longest, f"{of['overshoot_percent']:.0f}"]


def breaks(found: dict[str, float]) -> str:
    """Where a loop breaks if one quantity alone differs from its nominal value."""
    said = []
    for name, text in NAMES.items():
        unit = " %" if name == "second_mode" else ""
        for side in ("below", "above"):
            if f"{name}_{side}" in found:
                said.append(f"{text} {side} {number(name, found[f'{name}_{side}'])}{unit}")
    return "; ".join(said) or "nowhere"


def ranges(family: str, names: dict[str, str]) -> str:
    """Where loops break, the ranges without an unstable draw, and the share of hard draws that is stable."""
    found = recorded(family)
    head = [
        "loop", "becomes unstable at", *(f"stable: {text}" for text in RANGES.values()), "stable difficult devices, %",
    ]  # fmt: skip
    rows = []
    for name, text in names.items():
        if name in found:
            of, hard = found[name]["range"], found[name]["hard"]
            share = f"{100 * hard['stable'] / hard['draws']:.1f}"
            stable = [between(k, of[k]) if k in of else "none" for k in RANGES]
            rows.append([text, breaks(found[name]["breaks"]), *stable, share])
    return table(head, rows)


def claims() -> str:
    """Ranges of the recommended loops alone."""
    head = ["recommended loop", *RANGES.values()]
    found = [(text, recorded(family)[name]["range"]) for family, name, text in RECOMMENDED]
    return table(head, [[text, *(between(k, of[k]) for k in RANGES)] for text, of in found])


def markdown(family: str, names: dict[str, str]) -> str:
    """Both tables."""
    return f"{errors(family, names)}\n\n{ranges(family, names)}"
