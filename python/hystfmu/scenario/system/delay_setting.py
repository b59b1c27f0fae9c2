"""The number of steps of a delay as a setting: `--set delay.n=1.3`, also a fraction, also 0.

The size of a block is part of its structure. A unit of the block `delay` is an exception, so that cases and studies can
vary the delay of a loop: a fraction of a step is counted in fine steps, and with 0 the unit becomes a connection.
"""

from __future__ import annotations

from hystfmu.base.errors import InputError
from hystfmu.scenario.system.case import Case
from hystfmu.scenario.system.spec import UnitSpec

SIZE = "n"


def sizes(case: Case) -> set[str]:
    """Return the settings ``"unit.n"`` of a case that change the structure of a unit."""
    return {f"{name}.{SIZE}" for name, spec in case.units.items() if spec.block == "delay"}


def delayed(spec: UnitSpec, steps: object, ripple: int, where: str) -> UnitSpec:
    """Return the unit of a delay with another number of steps.

    Parameters
    ----------
    spec : UnitSpec
        Unit of the block `delay`.
    steps : object
        Number of steps of the unit; a multiple of 1 / `ripple` for a unit with the step of the scenario.
    ripple : int
        Fine steps per step.
    where : str
        Place of the setting, for messages.

    Raises
    ------
    InputError
        Not a number, negative, or no multiple of a fine step.
    """
    parts = ripple if spec.every == 1 and not spec.fine else 1
    count = parts * steps if isinstance(steps, int | float) and not isinstance(steps, bool) else -1.0
    whole = round(count) if 0 <= count <= 1e9 else -1
    if whole < 0 or abs(count - whole) > 1e-6:
        raise InputError(f"{where}: must be a number of steps of at least 0, in steps of {1 / parts:g}. Got {steps!r}.")
    rest = {k: v for k, v in spec.set.items() if k != SIZE}
    if whole == 0:
        return spec.model_copy(update={"block": "scaling", "dims": {"n": 1}, "values": {}, "set": {}})
    if whole % parts == 0:
        return spec.model_copy(update={"dims": {SIZE: whole // parts}, "set": rest})
    return spec.model_copy(update={"dims": {SIZE: whole}, "fine": True, "set": rest})
