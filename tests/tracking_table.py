"""The tracking tables of the README: one row for each loop, from baselines and margins of the scenarios."""

from __future__ import annotations

import tomllib
from pathlib import Path

from hystfmu.base.errors import InputError
from hystfmu.scenario import Scenario, build
from hystfmu.scenario.loop_margins import OpenedLoop, open_loop

SCENARIOS = Path(__file__).parents[1] / "scenarios"
LOOPS = {
    "open_loop": "open loop",
    "cascade": "inverse only",
    "sliding_mode_2005": "law of 2005",
    "super_twisting": "super-twisting",
    "sliding_mode": "sliding mode with integral",
    "lead_lag": "lead-lag with observer",
    "pid": "PID",
    "pid_observer": "PID with observer",
    "h_infinity": "H-infinity loop shaping",
    "internal_model": "internal model",
    "iterative_learning": "iterative learning",
    "repetitive": "internal model, repetitive",
}
CORNERS = [f"{gain}_{f}" for gain in ("up", "down") for f in (400, 600)]
SIGNALS = {"10": "10 Hz", "100": "100 Hz", "broadband": "broadband"}


def baseline(scenario: str) -> dict[str, dict[str, float]]:
    """Metrics of every case."""
    cases = tomllib.loads((SCENARIOS / scenario / "baseline.toml").read_text())["case"]
    return {name: case["metrics"] for name, case in cases.items()}


def table(rate: str) -> str:
    """One rate: "" is 10 kHz."""
    head = ["RMS, % of stroke"]
    for text in SIGNALS.values():
        head += [text, "worst corner"] + ["with two steps"] * (text != "broadband")
    lines = [f"| {' | '.join([*head, 'Ms, dB', 'delay margin, steps'])} |", "|" + "---|" * (len(head) + 2)]
    names = [name for name in LOOPS if (SCENARIOS / (name + rate) / "baseline.toml").exists()]
    return "\n".join([*lines, *(f"| {LOOPS[name]} | {' | '.join(cells(name + rate))} |" for name in names)])


def cells(name: str) -> list[str]:
    """Errors and margins of one loop as text."""
    found = {case: metrics["tracking"] for case, metrics in baseline(name).items()}
    texts = []
    for signal in SIGNALS:
        nominal = signal if signal == "broadband" else f"sine_{signal}"
        groups = [[nominal], [f"{c}_{signal}" for c in CORNERS]]
        if signal != "broadband":
            groups.append([f"{c}_two_steps_{signal}" for c in CORNERS])
        texts += [f"{max(found[c] for c in group):.2g}" if group[0] in found else "" for group in groups]
    try:
        margins = loop(name, "sine_10").margins()
    except InputError:  # no feedback
        return [*texts, "", ""]
    return [*texts, f"{margins.Ms_db:.1f}", f"{margins.delay_steps:.1f}"]


def markdown() -> str:
    """Both rates."""
    return f"At 10 kHz:\n\n{table('')}\n\nAt 1 kHz:\n\n{table('_1khz')}"


def loop(name: str, case: str) -> OpenedLoop:
    """Open the loop of a case."""
    found = next((c for c in Scenario(SCENARIOS / name).cases if c.name == case), None)
    if found is None:
        raise InputError(f"{name}: no case {case}")
    return open_loop(build(found))
