"""The loop around a fitted model: inverse, tuned controller, scenario with results and margins."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import AbstractContextManager
from dataclasses import dataclass
from pathlib import Path

import hystfmu as hy
from hystfmu.base.errors import InputError
from hystfmu.data import Dataset
from hystfmu.face.model import Model
from hystfmu.face.result import Results
from hystfmu.scenario.margin_table import MarginTable, margin_table
from hystfmu.start.device import COMPUTING, FREQUENCY, GAIN, Device, device, faster, slower
from hystfmu.start.loop import CORNER, loop_scenario
from hystfmu.start.speed import fastest
from hystfmu.start.tuning import Gains, tune


@dataclass(frozen=True)
class ClosedLoop:
    """A loop that has run.

    Attributes
    ----------
    inverse : Model
        Of the whole model.
    device : Device
    gains : Gains
    results : Results
        Of the cases of the scenario.
    margins : MarginTable
    """

    inverse: Model
    device: Device
    gains: Gains
    results: Results
    margins: MarginTable

    @property
    def passed(self) -> bool:
        """Whether all cases meet what is asked for, and the loop its margins."""
        return self.results.passed and bool(self.margins.verdicts) and not self.margins.broken()


def close(
    model: Model,
    data: Dataset,
    folder: Path,
    name: str,
    percent: float,
    other: Model | None,
    told: Callable[[str], None],
    shown: Callable[[str], AbstractContextManager[Callable[[float], None]]],
) -> ClosedLoop:
    """Invert, tune, and run the scenario.

    Parameters
    ----------
    model : Model
        Fitted to `data`.
    data : Dataset
    folder : Path
        For the scenario.
    name : str
        Of the scenario.
    percent : float
        Largest RMS error of the loop that is asked for, in percent of the stroke.
    other : Model or None
        Stands for the device in one case.
    told : function
        Called with a line where a step ends.
    shown : function
        Called with the name of a step that takes long; gives a context with a function of the fraction done.

    Raises
    ------
    InputError
        The model does not fit into a loop, or no controller holds it.
    """
    found, inverse = device(model, data), model.inverse()
    with shown("tuning"):
        scaled = [tuple(faster(n, f) for n in found.dynamics) for f in (1 - FREQUENCY, 1 + FREQUENCY)]
        gains = tune([found.dynamics, *(scaled if found.dynamics else [])], found.h, found.delay + COMPUTING)
    told(f"loop: Kp = {gains.Kp:g}, Ki = {gains.Ki:g} 1/s, step {found.h:g} s, Ms {gains.Ms_db:.1f} dB")
    frequency, record = fastest(found, gains, CORNER * percent), found.frequency
    if frequency < record:
        found = slower(found, frequency)
        told(
            f"references at {frequency:g} Hz: at the {record:g} Hz of the record a device that differs by "
            f"{100 * GAIN:g} % would miss {CORNER * percent:g} %"
        )
    into = loop_scenario(found, gains, percent, name, other).save(folder)
    with shown("running the loop") as progress:
        results = hy.run(into, engine="native", record=True, progress=progress)
    with shown("margins") as progress:
        try:
            margins = margin_table([into], progress=progress)
        except InputError as e:  # such as a case that its command drives into saturation
            margins = MarginTable([], [str(e)], [])
    return ClosedLoop(inverse, found, gains, results, margins)
