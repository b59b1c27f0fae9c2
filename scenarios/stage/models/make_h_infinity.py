"""Designs the H-infinity controller of the stage by loop shaping and writes scenarios/stage/h_infinity/controller.toml.

    python scenarios/stage/models/make_h_infinity.py

The plant is the two modes with the amplifier, and the delay and hold of a step and a half as a Pade approximant; the
weight is an integral with a roll-off.
"""

from __future__ import annotations

import sys
from pathlib import Path

import control
import numpy as np
from hystfmu.design import loop_shaping

STAGE = Path(__file__).parents[1]
MODES = ((500.0, 0.02, 0.9), (1600.0, 0.01, 0.1))
F_B, DELAY, PADE = 1e4, 1.5e-4, 2
KI, ROLL_OFF = 400.0, 800.0  # 1/s, Hz
HEAD = """# Written by models/make_h_infinity.py: loop shaping with the weight {ki:g} / s and a roll-off at {roll_off:g} Hz.
# The margin b is {b:.3f} of at most {b_opt:.3f}.
extends = "../scans.toml"

[units.controller]
block = "transfer_function"
dims = {{ na = {na}, nb = {nb} }}
text = "H-infinity controller"

[units.controller.values]
b = {numerator}
a = {denominator}
hold = "foh"
"""


def design(ki: float = KI, roll_off: float = ROLL_OFF, ratio: float = 1.1):  # noqa: ANN201
    """Return the controller and its margins."""
    G = sum(control.tf([k * (w := 2 * np.pi * f) ** 2], [1, 2 * z * w, w**2]) for f, z, k in MODES)
    G = G * control.tf(*control.pade(DELAY, PADE)) * control.tf([1], [1 / (2 * np.pi * F_B), 1])
    W = control.tf([ki], [1 / (2 * np.pi * roll_off), 1, 0])
    return loop_shaping(G, W, ratio)


def write(ki: float = KI, roll_off: float = ROLL_OFF) -> None:
    """Write controller.toml."""
    found = design(ki, roll_off)
    K = control.tf(found.controller)
    b, a = (np.trim_zeros(np.ravel(v), "f") for v in (K.num[0][0], K.den[0][0]))
    b = b[max(0, len(b) - len(a) + 1) :]  # rounding of a strictly proper numerator
    text = HEAD.format(
        ki=ki, roll_off=roll_off, b=found.b, b_opt=found.b_opt, na=len(a) - 1, nb=len(b) - 1,
        numerator=[float(f"{v:.15g}") for v in b], denominator=[float(f"{v:.15g}") for v in a],
    )
    (STAGE / "h_infinity" / "controller.toml").write_text(text)
    print(f"b {found.b:.3f} of {found.b_opt:.3f}")


if __name__ == "__main__":
    write(*(float(v) for v in sys.argv[1:]))
