"""The controller that `hystfmu start` wrote, in a loop around a simulated device.

The units of the scenario run as they are, all but the plant: what a deployed controller would be.  The device answers
in the place of the plant; its own delay adds to the step of computing that the scenario has.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from start.devices.device import Device, Simulated

import hystfmu as hy
from hystfmu.scenario.system.case import Case
from hystfmu.scenario.system.system import build, fuse

WITHOUT_FEEDBACK = "inverse_only"  # the case of `start` that has none
SHAPES = {"nested": "random_reversals", "staircase": "steps", "step": "steps"}  # of verdict.json, in the block
MOST_STEPS = 100_000
SENSOR = "sensor"  # adds the noise of a scenario; the simulated device has its own
SIGNALS = ("reference", "misfit")  # units that differ between references


def cases_of(folder: Path) -> dict[str, Case]:
    """Read the cases of a scenario by their names."""
    return {case.name: case for case in hy.Scenario.load(folder).ready().cases}


def case_of(cases: Mapping[str, Case], wanted: Mapping[str, Any]) -> Case | None:
    """Return the case that runs a reference of verdict.json: the one of its name, else one with its numbers set.

    A staircase that no case has cannot be told from its frequency alone: None.
    """
    if wanted["name"] in cases:
        return cases[wanted["name"]]
    shape = SHAPES.get(wanted["shape"], wanted["shape"])
    if shape == "steps":
        return None
    base = next((c for c in cases.values() if c.name in ("sine", "nominal")), next(iter(cases.values())))
    numbers = {key: wanted[key] for key in ("frequency", "amplitude", "offset")}
    return _with_reference(base, {"shape": shape, **numbers})


def without_feedback(cases: Mapping[str, Case], case: Case) -> Case | None:
    """Return the case with what the case without feedback has in its place, where the scenario has such a case."""
    if WITHOUT_FEEDBACK not in cases:
        return None
    first, base = next(iter(cases.values())), cases[WITHOUT_FEEDBACK]
    changed = {n: u for n, u in base.units.items() if n not in SIGNALS and u != first.units.get(n)}
    return replace(case, units={**case.units, **changed})


def _with_reference(case: Case, values: Mapping[str, Any]) -> Case:
    name = _unit(case)
    unit = case.units[name].model_copy(update={"set": {**case.units[name].set, **values}})
    return replace(case, units={**case.units, name: unit})


def _unit(case: Case) -> str:
    """Name of the unit that makes the reference."""
    return "reference" if "reference" in case.units else _ends(case)[0].partition(".")[0]


def _ends(case: Case) -> tuple[str, str]:
    """Wanted and measured output: what the first RMS error compares, else the loop of the margins."""
    for metric in case.metrics.values():
        if metric.kind == "rms_percent" and metric.against is not None:
            return metric.against, metric.signal
    return case.loops[0]


def counts_after(case: Case) -> float:
    """Time (s) from which errors count."""
    return next((m.after for m in case.metrics.values() if m.kind == "rms_percent"), 0.0)


@dataclass(frozen=True)
class Run:
    """Samples of a run: wanted output `r`, true output `y` (um), command `u` (V), and rows at a constant reference."""

    r: np.ndarray
    y: np.ndarray
    u: np.ndarray
    held: np.ndarray
    """y - r at the rows after the reference was stopped, shape (m,); empty where it was not."""

    @property
    def finite(self) -> bool:
        """Whether no number left the range of float64."""
        return bool(np.isfinite(self.y).all() and np.isfinite(self.u).all() and np.isfinite(self.held).all())


class Controller:
    """All units of a case but the plant, as one co-simulation unit: measured output in, command out."""

    def __init__(self, case: Case) -> None:
        system = build(case)
        wanted, measured = _ends(case)
        names = [p.name for p in system.parts]
        plant = names.index(measured.partition(".")[0])
        seen = names.index(SENSOR) if SENSOR in names else plant  # whose output the controller reads
        owner = {p.first + i: k for k, p in enumerate(system.parts) for i in range(len(p.outputs))}
        source = {(n.to, n.input): n.source for n in system.links}
        (command,) = (n.source for n in system.links if n.to == plant and owner[n.source] != _named(names, "misfit"))
        needed = {names.index(wanted.partition(".")[0]), owner[command]}
        more = set(needed)
        while more:  # what leads to the command; what only models the device stays out
            more = {owner[n.source] for n in system.links if n.to in more} - needed - {plant, seen}
            needed |= more
        parts = tuple(sorted(needed))
        for k in parts:  # a source may run at the step of the loop: its values are those of its time
            part = system.parts[k]
            assert part.period == case.ripple or not part.inputs, f"{part.name} steps at a rate of its own"
        graph, outside = fuse(system, parts)
        self.unit, self.case = hy.Unit(graph), case
        self._measured = [
            f"{names[k]}_{system.parts[k].inputs[i]}" for k, i in outside if owner.get(source.get((k, i), -1)) == seen
        ]
        self._command, self._wanted = (
            _output(system.parts[owner[at]], at) for at in (command, system.column(wanted, "the reference"))
        )
        amplitudes = [v for v in self.unit.variables if v.startswith(_unit(case)) and v.endswith("_amplitude")]
        self._amplitude = amplitudes[0] if amplitudes else None

    def drive(self, device: Device, u0: float, rng: np.random.Generator, hold: int = 0) -> Run:
        """Close the loop around the device at rest under `u0` (V).

        With `hold` the reference stops after the run where it crosses its middle, and as many steps follow.
        """
        h, unit, measured = self.case.step, self.unit, self._measured
        n = min(round(self.case.stop / h), MOST_STEPS)
        plant = Simulated(device, h, u0)
        noise = (device.noise_um * rng.normal(size=2 * n + hold + 1)).tolist()
        rows: list[tuple[float, float, float]] = []
        unit.reset()
        unit.initialize(0.0, **dict.fromkeys(measured, plant.y + noise[0]))
        middle = hold and self._middle()
        end = stopped = None
        k = 0
        while True:
            u, r = unit.get(self._command), unit.get(self._wanted)
            rows.append((r, plant.y, u))
            if k >= n and hold and stopped is None and (k >= 2 * n or _crosses(rows, middle)):
                unit.set(str(self._amplitude), 0.0)
                stopped, end = k, k + hold
            if k >= (n if not hold else end if end is not None else k + 1):
                break
            y = plant.step(u)
            k += 1
            for name in measured:
                unit.set(name, y + noise[k])
            try:
                unit.do_step((k - 1) * h, h)
            except hy.InputError:  # a command or an error that is no finite number any more
                rows.append((r, float("nan"), u))
                break
        r, y, u = np.array(rows).T
        last = stopped if stopped is not None else len(r)
        return Run(r[:last], y[:last], u[:last], (y - r)[last:])

    def _middle(self) -> float:
        """Value around which the reference moves."""
        return float(self.unit.get(str(self._amplitude).replace("_amplitude", "_offset")))

    @property
    def can_hold(self) -> bool:
        """Whether the reference can be stopped."""
        return self._amplitude is not None


def _crosses(rows: list[tuple[float, float, float]], middle: float) -> bool:
    return (rows[-1][0] - middle) * (rows[-2][0] - middle) <= 0


def _named(names: list[str], name: str) -> int:
    return names.index(name) if name in names else -1


def _output(part: Any, at: int) -> str:
    return f"{part.name}_{part.outputs[at - part.first]}"
