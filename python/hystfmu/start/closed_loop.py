"""Designs and simulates the closed loop for a fitted model, and decides whether the loop is approved.

The design considers a set of plants that agree with the record. A controller is used only if the loop has the required
margins for all these plants, and if the tracking error stays bounded in the simulation with every device. Otherwise the
loop consists of feed-forward and inverse, and a note states the reason.

The table of compared controller structures states the expected error for each reference, overshoot and settling time.
"""

from collections.abc import Callable
from contextlib import AbstractContextManager
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

import hystfmu as hy
from hystfmu.base import InputError
from hystfmu.data import Dataset
from hystfmu.design.feedforward import preview
from hystfmu.design.plants import PlantSet, plant_set
from hystfmu.design.race import Aim, Limits, Race, Tuned, race
from hystfmu.design.structures import STRUCTURES, Design
from hystfmu.face.model import Model
from hystfmu.scenario import Result, Results
from hystfmu.scenario.loop.table import MarginTable, margin_table
from hystfmu.start.device import FINE, Device, device
from hystfmu.start.loop import LoopPlan, draws
from hystfmu.start.promise import HARMONICS, Misfit, Promise, expected_percent, misfit, promises
from hystfmu.start.references import Tried, references
from hystfmu.start.requirements import JUMPS, OVERSHOOT, Amplifier, Requirements

WITHIN = 0.02  # of a step: settled


@dataclass(frozen=True)
class StepResponse:
    """Largest overshoot and longest settling time over all steps of a reference."""

    name: str  # name of the reference
    overshoot: float  # overshoot beyond the new level, in percent of the step
    # time until the output stays within 2 % of the step (s). It is infinite if the output does not settle before the
    # next step.
    settling: float


def step_response(tried: Tried, result: Result) -> StepResponse:
    """Return overshoot and settling time in the simulation `result` with a reference `tried` that has steps."""
    trace = result.trace
    if trace is None:
        return StepResponse(tried.name, np.inf, np.inf)
    r, y = trace["reference.r"], trace[result.system.case.metrics["tracking"].signal]
    at = np.flatnonzero(np.diff(r)) + 1
    at = at[trace.t[at] > tried.after - 0.5 * result.system.case.step]  # not the way from rest
    overshoot, settling = 0.0, 0.0
    for first, end in zip(at, [*at[1:], len(r)], strict=True):
        size = r[first] - r[first - 1]
        beyond = (y[first:end] - r[first]) / size
        overshoot = max(overshoot, 100 * float(beyond.max()))
        outside = np.flatnonzero(np.abs(beyond) > WITHIN)
        last = int(outside[-1]) + 1 if len(outside) else 0
        settling = max(settling, np.inf if first + last >= end else float(trace.t[first + last] - trace.t[first]))
    return StepResponse(tried.name, overshoot, settling)


@dataclass(frozen=True)
class Contender:
    """One row of the table that compares controller structures."""

    tuned: Tuned
    errors: dict[str, float]  # expected RMS error in percent of peak to peak, for each reference without jumps
    step: StepResponse | None  # response to the first reference with jumps, simulated with the identified device


WORSE, NOISY = 2.0, 3.0  # times the error without feedback, and times that of the noise: a drawn device stays bounded
SLOWER = (1.0, 2.0, 4.0, 8.0, 16.0)  # times that a jump is shaped more
TRIED = 3  # structures, best first, that run before the loop is left without feedback
SLOW = 0.02  # of the band: a bandwidth below is a slow integrator


@dataclass(frozen=True)
class ClosedLoop:
    """A designed loop with the results of its simulation."""

    device: Device
    race: Race  # comparison of structures, best first; empty if no feedback is allowed
    contenders: tuple[Contender, ...]  # the structures of `race` with their results for the table
    tuned: Tuned | None  # controller of the loop; None for feed-forward alone
    promises: tuple[Promise, ...]  # expected errors of the real loop, one for each reference
    steps: tuple[StepResponse, ...]  # overshoot and settling time for each reference with jumps
    results: Results  # of the cases of the scenario
    margins: MarginTable
    reasons: tuple[str, ...]  # properties that the record does not show, and reasons for missing feedback

    @property
    def approved(self) -> bool:
        """True if the loop is approved.

        A loop is approved if the model reproduces its record, the loop has the required margins for all plants of the
        set, the tracking error stays bounded in the simulation with every device, and all requirements are met.
        """
        return self.results.passed and not self.margins.broken() and not self.misfitted

    @property
    def misfitted(self) -> tuple[str, ...]:
        """Reasons why the model does not reproduce its record. If it does, there are none."""
        return tuple(dict.fromkeys(p.why for p in self.promises if not p.follows))

    @property
    def references(self) -> tuple[str, ...]:
        """Names of the cases that test a reference."""
        return tuple(p.name for p in self.promises)

    @property
    def feedback(self) -> str:
        """``full``, ``slow`` or ``none``.

        ``slow`` means that no mode is known, and that the bandwidth is far below the coherent band or that there is no
        such band.
        """
        if self.tuned is None:
            return "none"
        seen = self.device.plant.f_n or self.tuned.bandwidth >= SLOW * self.device.band > 0
        return "full" if seen else "slow"


def close(
    model: Model,
    data: Dataset,
    folder: Path,
    name: str,
    asked: Requirements,
    told: Callable[[str], None],
    shown: Callable[[str], AbstractContextManager[Callable[[float], None]]],
) -> ClosedLoop:
    """Invert the model that was fitted to `data`, tune a controller, and simulate the loop as a scenario in `folder`.

    `name` is the name of the scenario; for `told` and `shown` see `hystfmu.start.run.start`. An InputError is raised if
    the model cannot be used in a loop, a reference is not possible, or a requirement is not met.
    """
    amplifier = asked.amplifier or Amplifier()
    found = device(model, data, asked.resonance, (amplifier.low, amplifier.high))
    tried = references(found, asked.wanted)
    missed = misfit(model, data, found.frequency, found.noise, found.plant)
    late = replace(found.plant, delay=found.plant.delay + asked.delay * found.h)
    ahead = preview(late, found.h)
    plants = plant_set(
        found.plant,
        found.h,
        found.slopes,
        errors=found.errors,
        delay_error=found.delay_error,
        unseen=found.unseen,
        computing=asked.delay,
    )
    aim = _aim(found, missed, tried)
    with shown("tuning"):
        outcome = _raced(found, plants, aim, asked)
    reasons = list(found.notes)
    faults: list[str] = []
    tuned = outcome.winner
    if asked.controller not in (None, "none") and tuned is None:
        faults.append(f"controller {asked.controller}: {outcome.refused[str(asked.controller)]}")
    if asked.bandwidth and (tuned is None or tuned.bandwidth < asked.bandwidth):
        reached = max((t.bandwidth for t in outcome.found), default=0.0)
        faults.append(f"the required bandwidth is {asked.bandwidth:g} Hz; the largest one found is {reached:.3g} Hz")
    plan = _Runs(found, ahead, missed, tried, asked, name)
    lost = ""
    with shown("running the loop") as progress:
        for tuned in (*outcome.found[:TRIED], None):
            results, into, fault = plan.run(tuned, folder, progress)
            margins = MarginTable([], [], [])
            if tuned is None:
                break
            if not fault:
                margins, fault = _margins(into)
            if not fault:
                break
            lost = lost or f"{tuned.structure.text} is not usable: {fault}"
        if asked.controller not in (None, "none") and tuned is None and lost:
            faults.append(f"controller {asked.controller}: {lost}")
    if tuned is None:
        lost = "the option --controller is none" if asked.controller == "none" else lost or reasons.pop(0)
        reasons.insert(0, f"no feedback: {lost}")
    said = promises(found, plants, aim, tuned, tried, results, data, model)
    steps = tuple(step_response(t, r) for t in tried if t.jumps for r in results if r.case == t.name)
    faults += _missed(said, steps, asked)
    faults += [line for t in tried for r in results if r.case == t.name and (line := plan.too_fast(t, r))]
    if faults:  # a loop that misses a requirement is no result: all outputs state this
        raise InputError("; ".join(faults))
    told(f"loop: {_said(tuned)}" if tuned else f"loop: feed-forward and inverse; {reasons[0]}")
    table = plan.contenders(outcome, plants, aim)
    return ClosedLoop(found, outcome, table, tuned, said, steps, results, margins, tuple(reasons))


def _margins(into: Path) -> tuple[MarginTable, str]:
    """Return the margins of a scenario, and a line of text about the first violated limit ("" if there is none)."""
    try:
        table = margin_table([into])
    except InputError as e:  # such as a case that its command drives into saturation
        return MarginTable([], [str(e)], []), str(e)
    return table, next(iter(table.broken()), "")


def _raced(found: Device, plants: PlantSet, aim: Aim, asked: Requirements) -> Race:
    if asked.controller == "none":
        return Race((), {})
    names = tuple(STRUCTURES) if asked.controller is None else (asked.controller,)
    limits = Limits(asked.ms, bandwidth=asked.bandwidth or 0.0)
    return race(plants, Design(found.plant, found.h, asked.delay), aim, limits, names)


def _aim(found: Device, missed: Misfit, tried: tuple[Tried, ...]) -> Aim:
    """Return the disturbances for which the loop is tuned.

    These are the spectra of model error and reference, each as the mean over all references, and the sensor noise.
    """
    f = np.unique(np.concatenate([t.frequency * HARMONICS for t in tried]))
    f = f[f < 0.45 / found.h]
    if found.band:
        f = f[f <= max(found.band, 2 * found.frequency)]
    power = np.zeros(len(f))
    for t in tried:
        for line, p in zip(*missed.lines(t.frequency), strict=True):
            if line <= f[-1]:
                power[np.abs(f - line).argmin()] += p / len(tried)
    reference = np.mean([t.powers(f) for t in tried], axis=0)
    return Aim(f, power, reference, found.noise)


def _said(t: Tuned) -> str:
    return (
        f"{t.structure.text}, Ki {t.Ki:g} 1/s, bandwidth {t.bandwidth:.3g} Hz, Ms {t.ms_db:.1f} dB, "
        f"{t.set_ms_db:.1f} dB over all devices that agree with the record"
    )


class _Runs(LoopPlan):
    """Simulations of the scenario of a loop."""

    def run(self, tuned: Tuned | None, folder: Path, progress: Callable[[float], None]) -> tuple[Results, Path, str]:
        """Simulate the scenario, write its baseline, and return results, folder and the first violated limit."""
        limits = self.bounds() if tuned is not None else {}
        if self.asked.error is not None:
            first = self.tried[0].amplitude
            limits |= {t.name: self.asked.error * t.amplitude / first for t in self.tried if not t.jumps}
        loop = self.scenario(tuned, limits, self.shaped(tuned))
        into = loop.save(folder)
        results = hy.run(into, engine="native", record=True, progress=progress)
        names = {d.name for d in draws(self.found)}
        bad = [r for r in results if r.case in names and not r.passed]
        return results, into, f"case {bad[0].case}: {bad[0].failures()[0]}" if bad else ""

    def contenders(self, outcome: Race, plants: PlantSet, aim: Aim) -> tuple[Contender, ...]:
        """Return the tuned structures with the expected error for each reference and a simulated step response."""
        rows = []
        jump, smooth = next((t for t in self.tried if t.jumps), None), [t for t in self.tried if not t.jumps]
        for tuned in outcome.found:
            errors = {t.name: expected_percent(self.found, plants, aim, self.missed, tuned, t) for t in smooth}
            run = self.scenario(tuned, {}).run(jump.name, engine="native") if jump else None
            rows.append(Contender(tuned, errors, step_response(jump, run) if jump and run else None))
        return tuple(rows)

    def shaped(self, tuned: Tuned | None) -> float:
        """Return the factor by which the time constant of the reference filter is multiplied.

        It is the smallest tested factor with which the overshoot meets its limit and the slew rate of the amplifier is
        sufficient, or 1 if no tested factor is large enough.
        """
        jumps = [t for t in self.tried if t.jumps]
        for slower in SLOWER if jumps else ():
            loop = self.scenario(tuned, {}, slower)
            runs = [loop.run(t.name, engine="native") for t in jumps]
            steps = [step_response(t, r) for t, r in zip(jumps, runs, strict=True)]
            slow = not any(self.too_fast(t, r) for t, r in zip(jumps, runs, strict=True))
            if slow and all(s.overshoot <= (self.asked.overshoot or OVERSHOOT) for s in steps):
                return slower
        return SLOWER[0]

    def too_fast(self, t: Tried, result: Result) -> str:
        """Return a line of text if the slew rate of the amplifier is too low for a reference, else ""."""
        amplifier, trace = self.asked.amplifier, result.trace
        if amplifier is None or trace is None:
            return ""
        u = trace[self.command][trace.t >= t.after][::FINE]
        needs = float(np.abs(np.diff(u)).max(initial=0.0)) / self.found.h
        if needs <= amplifier.slew:
            return ""
        return f"{t.name}: needs a slew rate of {needs:.3g}; the amplifier has {amplifier.slew:.3g}"

    def bounds(self) -> dict[str, float]:
        """Return the largest allowed tracking error in percent for the simulation with each device.

        This is twice the error without feedback, plus an allowance for the sensor noise.
        """
        loop = self.scenario(None, {})
        noise = 100 * NOISY * self.found.noise / (2 * self.tried[0].amplitude)
        alone = {d.name: loop.run(d.name, engine="native").value("tracking") for d in draws(self.found)}
        return {name: float(f"{WORSE * error + noise:.3g}") for name, error in alone.items()}


def _missed(said: tuple[Promise, ...], steps: tuple[StepResponse, ...], asked: Requirements) -> list[str]:
    """Return a line of text for each requirement that the loop does not meet."""
    lines = []
    for p in said:
        if asked.error is None or p.shape in JUMPS:
            continue
        if p.rms_percent is None:
            lines.append(f"{p.name}: the required error is {asked.error:g} %; the error on the device is not known")
        elif p.rms_percent > asked.error:
            lines.append(
                f"{p.name}: the required error is {asked.error:g} %; the expected one is {p.rms_percent:.3g} %"
            )
    for s in steps:
        if asked.overshoot is not None and s.overshoot > asked.overshoot:
            lines.append(f"{s.name}: the largest allowed overshoot is {asked.overshoot:g} %; got {s.overshoot:.3g} %")
        if asked.settling is not None and not s.settling <= asked.settling:
            lines.append(f"{s.name}: the largest allowed settling time is {asked.settling:g} s; got {s.settling:.3g} s")
    return lines
