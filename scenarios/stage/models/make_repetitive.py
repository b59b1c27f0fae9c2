"""Designs the repetitive part of a controller of the stage for its own damped loop, over natural frequency and slope.

    python scenarios/stage/models/make_repetitive.py irc ...

writes scenarios/stage/irc_repetitive/repetitive.toml.  The correction is added to the command, behind the controller:
what it acts on is P = z^-1 G / (1 + C G), for modes from -20 to +20 % and slopes of the actuator over its inverse.
For a loop of your own: hystfmu design repetitive.
"""

import sys
from pathlib import Path

import control

import hystfmu as hy

STAGE = Path(__file__).parents[1]
RATE = 10_000  # Hz
FACTORS, SLOPES = (0.8, 0.9, 1.0, 1.1, 1.2), (0.86, 1.0, 1.3)
CUTOFF, GAIN, N_Q, N_L = 1100.0, 0.3, 24, 45  # Hz, share of the error learnt in a period, taps on each side
SCANS = {10: (0.4, 0.3), 50: (0.2, 0.12), 200: (0.15, 0.125)}  # other than 100 Hz: end of the run, of the transient
ONCE = ("staircase", "slow")  # cases without a period: nothing is learnt
HEAD = """# Written by models/make_repetitive.py: {name} with a repetitive part that adds to its command.
# max |Q - L P| = {left:.4f} over modes of -20 to +20 % and slopes of {low:g} to {high:g}.
extends = "../{name}/scenario.toml"

[units.command]
block = "sum"
dims = {{ n = 4 }}
values = {{ k = [1.0, 1.0, 1.0, -1.0] }}
text = "wanted output of the actuator: sum of feed-forward, controller and repetitive part"

[connections]
"repetitive.y_d" = "reference.r"
"repetitive.y" = "adc.y"
"command.u_3" = "repetitive.r"
"command.u_4" = "reference.r"
"""


UNIT = """
[{where}units.repetitive]
block = "repetitive"
dims = {{ n = {n}, n_q = {n_q}, n_l = {n_l} }}
inputs = {{ active = {active:.1f} }}
text = "learns {gain:g} of the error in a period, up to {cutoff:g} Hz"

[{where}units.repetitive.values]
q = {q}
l = {l}
"""
CASE = """
[[case]]
name = "scan_{f}"
stop = {stop}
after = {after}
"""


def loops(name: str) -> list[control.StateSpace]:
    """Return open loops whose complementary sensitivity is P."""
    found = []
    for factor in FACTORS:
        opened = hy.Scenario.load(STAGE / name).open_loop("scan_100", set={"plant.g0_f_n": f"*{factor}"})
        late = control.ss(*opened.held(1.0), opened.h)
        for slope in SLOPES:
            P = slope * late * control.feedback(control.ss([], [], [], [[1.0]], opened.h), opened.open_loop(slope, 0.0))
            found.append(control.feedback(P, 1, sign=1))
    return found


def design(name: str) -> hy.design.RepetitiveFilters:
    """Return the filters for a controller."""
    return hy.design.repetitive_filters(loops(name), CUTOFF, GAIN, N_Q, N_L)


def main(names: list[str]) -> None:
    """Write the files."""
    for name in names:
        found = design(name)
        q, l = ([float(f"{v:.8e}") for v in taps] for taps in (found.q, found.l))  # noqa: E741
        taps = {"n_q": N_Q, "n_l": N_L, "gain": GAIN, "cutoff": CUTOFF, "q": q, "l": l}
        text = HEAD.format(name=name, left=max(found.contraction), low=SLOPES[0], high=SLOPES[-1])
        text += UNIT.format(where="", n=round(RATE / 100), active=1, **taps)
        for f, (stop, after) in SCANS.items():
            text += CASE.format(f=f, stop=stop, after=after)
            text += UNIT.format(where="case.", n=round(RATE / f), active=1, **taps)
        for case in ("scan_100", "low_100", "high_100", "two_steps_100", "staircase", "slow", "bouc_wen_*"):
            text += f'\n[[case]]\nname = "{case}"\n'
            if case in ONCE:
                text += UNIT.format(where="case.", n=round(RATE / 100), active=0, **taps)
        file = STAGE / f"{name}_repetitive" / "repetitive.toml"
        file.write_text(text)
        print(f"{file.relative_to(STAGE)}: max |Q - L P| = {max(found.contraction):.4f}")


if __name__ == "__main__":
    main(sys.argv[1:])
