"""The tracking tables of the README, from the recorded baselines of the scenarios: RMS in percent of stroke."""

from __future__ import annotations

import tomllib
from pathlib import Path

from hystfmu.scenario import Scenario, build
from hystfmu.scenario.loop_margins import OpenedLoop, open_loop

SCENARIOS = Path(__file__).parents[1] / "scenarios"
CASES = {
    "sine_10": "10 Hz",
    "sine_50": "50 Hz",
    "sine_100": "100 Hz",
    "mismatch_up_10": "10 Hz, mismatch +",
    "mismatch_down_10": "10 Hz, mismatch -",
    "mismatch_up_100": "100 Hz, mismatch +",
    "mismatch_down_100": "100 Hz, mismatch -",
    "mismatch_up_delay_10": "10 Hz, mismatch +, one step of delay",
    "mismatch_down_delay_10": "10 Hz, mismatch -, one step of delay",
    "mismatch_up_delay_100": "100 Hz, mismatch +, one step of delay",
    "mismatch_down_delay_100": "100 Hz, mismatch -, one step of delay",
    "disturbance_10": "10 Hz, disturbance",
}
COLUMNS = {"open_loop": "open loop", "cascade": "inverse only", "sliding_mode_2005": "law of 2005"}
OURS = "pid_observer"
BOUC_WEN = {case: text for case, text in CASES.items() if "delay" not in case and "disturbance" not in case}
"""Its mismatch +: see `bouc_wen_up` in scenarios/loops."""
ASKED = {
    "": {"sine_10": 0.05, "sine_50": 0.05, "sine_100": 0.05}
    | {f"mismatch_{d}_10": 0.07 for d in ("up", "down")}
    | {f"mismatch_{d}_100": 0.75 for d in ("up", "down")},
    "_1khz": {"sine_10": 0.3, "sine_50": 1.4, "sine_100": 3.0},
}
"""Percent of stroke that is asked for."""


def baseline(scenario: str) -> dict[str, dict[str, float]]:
    """Metrics of every case."""
    cases = tomllib.loads((SCENARIOS / scenario / "baseline.toml").read_text())["case"]
    return {name: case["metrics"] for name, case in cases.items()}


def table(rate: str, plant: str = "") -> str:
    """One rate and plant: "" is 10 kHz, and backlash."""
    compared = [baseline(s + plant + rate) for s in COLUMNS]
    ours = baseline(OURS + plant + rate)
    head = ["", *COLUMNS.values(), "ours", "ours, largest", "its ripple", "asked for"]
    lines = [f"| {' | '.join(head)} |", "|" + "---|" * len(head)]
    for row, text in (BOUC_WEN if plant else CASES).items():
        case = row.replace("mismatch_up", "bouc_wen_up") if plant else row
        known = [b.get(case) or b[f"identified_{case}"] for b in compared]
        cells = [f"{b['tracking']:.2g}" for b in known]
        cells += [f"**{ours[case]['tracking']:.2g}**", f"{ours[case]['worst']:.2g}", f"{ours[case]['ripple']:.2g}"]
        asked = ASKED[rate].get(row)
        lines.append(f"| {text} | {' | '.join(cells)} | {'' if asked is None else f'{asked:g}'} |")
    return "\n".join(lines)


def markdown() -> str:
    """Both plants at both rates."""
    plants = {"": "The ten-backlash plant", "_bouc_wen": "The Bouc-Wen plant"}
    rates = {"": "10 kHz", "_1khz": "1 kHz"}
    return "\n\n".join(f"{plants[p]} at {rates[r]}:\n\n{table(r, p)}" for p in plants for r in rates)


LOOPS = {
    "sliding_mode_2005": "law of 2005",
    "pid": "PID",
    "lead_lag": "lead-lag with observer",
    "pid_observer": "PID with observer",
    "pid_robust": "PID, tuned for margins",
}
NOMINAL, WITH_STEP = "sine_10", 1  # steps of delay in the table
CORNERS = [f"{gain}_{f}" for gain in ("up", "down") for f in (400, 600)]
MISMATCH = ("mismatch_up", "mismatch_down")


def survival() -> str:
    """Margins of the loops with a step of delay, the delay up to which their corners are stable, their worst errors."""
    head = ["10 kHz, a step of delay", "Ms, dB", "delay margin, steps", "corners stable up to, steps"]
    head += ["worst corner, 10 Hz", "worst corner, 100 Hz"]
    lines = [f"| {' | '.join(head)} |", "|" + "---|" * len(head)]
    for name, text in LOOPS.items():
        found = baseline(name)
        corners = [c for c in CORNERS if f"{c}_10" in found]
        own = WITH_STEP if corners else 0  # the robust loops have the step in all cases
        nominal = loop(name, NOMINAL).margins(delay=WITH_STEP - own)
        stable = [loop(name, f"{c}_10").stable_to() + own for c in corners or MISMATCH]
        after = "_{}" if corners else "_delay_{}"
        worst = [max(found[c + after.format(f)]["tracking"] for c in corners or MISMATCH) for f in (10, 100)]
        cells = [f"{nominal.Ms_db:.1f}", f"{nominal.delay_steps:.1f}", f"{min(stable):g}"]
        lines.append(f"| {text} | {' | '.join([*cells, *(f'{w:.2g}' for w in worst)])} |")
    return "\n".join(lines)


def loop(name: str, case: str) -> OpenedLoop:
    """Open the loop of a case."""
    (found,) = (c for c in Scenario(SCENARIOS / name).cases if c.name == case)
    return open_loop(build(found))
