"""Table of the effect of switching: sliding modes, their linear laws and the PID in the worst corner."""

import textwrap
import tomllib

from page_table import table
from tracking_table import BOUC_WEN, CORNERS, LOOPS, SCENARIOS, SIGNALS, baseline

RECORD = SCENARIOS / "loops" / "switching.record.toml"
PLANTS = {"backlash": ("", "ten backlashes"), "bouc_wen": (BOUC_WEN, "Bouc-Wen")}


def recorded() -> dict[str, dict[str, dict[str, float]]]:
    """What scenarios/models/run_switching.py found."""
    return tomllib.loads(RECORD.read_text())


def worst(name: str, plant: str, signal: str) -> float:
    """Largest recorded error of a shipped loop in the corners."""
    found = baseline(name)
    return max(found[f"{PLANTS[plant][0]}{corner}_{signal}"]["tracking"] for corner in CORNERS)


def markdown() -> str:
    """Each law, its linear law and the PID, by plant and signal."""
    columns = [(p, s) for p in PLANTS for s in SIGNALS]
    head = ["worst corner, % of stroke", *(f"{PLANTS[p][1]}, {SIGNALS[s]}" for p, s in columns)]
    found, rows = recorded(), []
    for law in [name for name in LOOPS if name in found]:
        rows.append([LOOPS[law], *(f"{worst(law, p, s):.3g}" for p, s in columns)])
        rows.append(["its linear law", *(f"{found[law][p][s]:.3g}" for p, s in columns)])
    rows.append(["tuned PID", *(f"{worst('pid', p, s):.3g}" for p, s in columns)])
    drawn = [
        f"- For {found[name]['draws']} random laws {text}, the ratio to the error of the linear law is at least "
        f"{found[name]['smallest_ratio']:.2g}, and its median is {found[name]['median_ratio']:.2g}. The ratio to the "
        "smaller of the two errors, that of the linear law or that of the tuned loop, is at least "
        f"{found[name]['smallest_to_both']:.2g}."
        for name, text in (("drawn_pid", "without an observer"), ("drawn_pid_observer", "with a disturbance observer"))
    ]
    lines = [
        table(head, rows),
        "",
        "The list states ratios of the error of a random law to the errors of its linear law and of the tuned loop.",
        'The tuned loop is the PID loop of the first table, or for laws with an observer the loop "PID with observer":',
        "",
    ]
    return "\n".join([*lines, *("\n".join(textwrap.wrap(text, 120, subsequent_indent="  ")) for text in drawn)])
