"""The tables of python/docs/tracking.md: one row for each loop, from baselines and margins of the scenarios."""

import textwrap
import tomllib
from functools import cache
from pathlib import Path

import page_table

from hystfmu.base.errors import InputError
from hystfmu.scenario import Cases, build
from hystfmu.scenario.loop.opened import OpenedLoop
from hystfmu.scenario.loop.opening import open_loop

SCENARIOS = Path(__file__).parents[1] / "scenarios"
LOOPS = {
    "open_loop": "open loop", "cascade": "inverse only", "sliding_mode_2005": "law of 2005 (PD)",
    "super_twisting": "super-twisting (PID)", "sliding_mode": "sliding mode with integral (PID)",
    "lead_lag": "lead-lag with observer", "pid": "PID", "pid_observer": "PID with observer",
    "h_infinity": "H-infinity loop shaping", "internal_model": "internal model",
    "iterative_learning": "iterative learning", "repetitive": "internal model, repetitive",
}  # fmt: skip
LEARNING = ("iterative_learning", "repetitive")
"""Loops that learn a period; their errors are compared with each other."""
OURS = "internal_model"
"""Of the loops that learn no period, the one that is recommended."""
CORNERS = [f"{gain}_{f}" for gain in ("up", "down") for f in (400, 600)]
BOUC_WEN = "bouc_wen_"
"""Prefix of the cases with the other plant, behind dynamics and an inverse identified in its own class."""
ROD = "magnetostrictive/"
"""Folder of the loops around the magnetostrictive rod."""
SIGNALS = {"10": "10 Hz", "100": "100 Hz", "broadband": "broadband"}


def baseline(scenario: str) -> dict[str, dict[str, float]]:
    """Metrics of every case."""
    cases = tomllib.loads((SCENARIOS / scenario / "baseline.toml").read_text())["case"]
    return {name: case["metrics"] for name, case in cases.items()}


def head() -> list[str]:
    """Columns after the name: errors, then margins."""
    texts = []
    for text in SIGNALS.values():
        texts += [text, f"{text}, worst corner"] + [f"{text}, with two steps"] * (text != "broadband")
    return [*texts, "Ms, dB", "delay margin, steps"]


@cache
def rows(rate: str, plant: str = "", family: str = "") -> dict[str, list[str]]:
    """Cells of every loop of one rate, "" is 10 kHz, of one folder, on one plant, "" is that of the folder."""
    names = [name for name in LOOPS if (SCENARIOS / f"{family}{name}{rate}" / "baseline.toml").exists()]
    return {name: cells(f"{family}{name}{rate}", plant) for name in names}


def best(found: dict[str, list[str]], column: int) -> list[str]:
    """Loops with the smallest printed error of a column."""
    values = {name: float(texts[column]) for name, texts in found.items() if texts[column]}
    return [name for name, value in values.items() if value == min(values.values())]


def errors() -> list[int]:
    """Columns in which the smallest value wins."""
    return [k for k, text in enumerate(head()) if not text.startswith(("Ms", "delay"))]


def table(rate: str, plant: str = "", family: str = "") -> str:
    """One rate and plant, the smallest errors of the loops that learn a period and of the others in bold."""
    found = rows(rate, plant, family)
    shown = {name: list(texts) for name, texts in found.items()}
    for learns in (True, False):
        group = {name: texts for name, texts in found.items() if (name in LEARNING) == learns}
        for k in errors() if group else ():
            for name in best(group, k):
                shown[name][k] = f"**{found[name][k]}**"
    return page_table.table(["RMS, % of stroke", *head()], [[LOOPS[name], *texts] for name, texts in shown.items()])


def wins() -> str:
    """Sentence that names what beats the recommended loop, by column, among those that learn no period."""
    found = {name: texts for name, texts in rows("").items() if name not in LEARNING}
    ours = found.pop(OURS)
    said = []
    for k in errors():
        names = [name for name, texts in found.items() if texts[k] and float(texts[k]) < float(ours[k])]
        if names:
            text = f"- {head()[k]}: {', '.join(f'{LOOPS[name]} with {found[name][k]}' for name in names)}"
            said.append("\n".join(textwrap.wrap(text, 120, subsequent_indent="  ", break_on_hyphens=False)))
    first = f"Loops that do not learn a periodic reference have smaller errors than the {LOOPS[OURS]} in these columns:"
    return "\n".join([first, "", *said]) if said else ""


def cells(name: str, plant: str = "") -> list[str]:
    """Errors and margins of one loop as text."""
    recorded = {case: metrics["tracking"] for case, metrics in baseline(name).items()}
    found = {case.removeprefix(plant): error for case, error in recorded.items() if case.startswith(plant)}
    texts = []
    for signal in SIGNALS:
        nominal = signal if signal == "broadband" else f"sine_{signal}"
        groups = [[nominal], [f"{c}_{signal}" for c in CORNERS]]
        if signal != "broadband":
            groups.append([f"{c}_two_steps_{signal}" for c in CORNERS])
        texts += [f"{max(found[c] for c in group):.2g}" if found.keys() >= {*group} else "" for group in groups]
    try:
        margins = loop(name, f"{plant}sine_10").margins()
    except InputError:  # no feedback
        return [*texts, "", ""]
    return [*texts, f"{margins.Ms_db:.1f}", f"{margins.delay_steps:.1f}"]


def markdown() -> str:
    """Both rates, all plants."""
    parts = ["At 10 kHz:", table(""), wins(), "At 1 kHz:", table("_1khz")]
    parts += ["Bouc-Wen plant at 10 kHz:", table("", BOUC_WEN), "Bouc-Wen plant at 1 kHz:", table("_1khz", BOUC_WEN)]
    parts += ["Magnetostrictive rod at 10 kHz:", table("", family=ROD)]
    return "\n\n".join(parts)


@cache
def cases(name: str) -> Cases:
    """Read a scenario; a table for each plant asks for it."""
    return Cases(SCENARIOS / name)


def loop(name: str, case: str) -> OpenedLoop:
    """Open the loop of a case."""
    found = next((c for c in cases(name).cases if c.name == case), None)
    if found is None:
        raise InputError(f"{name}: no case {case}")
    return open_loop(build(found))
