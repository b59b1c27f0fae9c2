"""References for the test of a loop: shape, frequency, amplitude and spectrum."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

import hystfmu as hy
from hystfmu.base import Array, InputError
from hystfmu.graph import Graph, blocks
from hystfmu.start.device import PERIODS, SAMPLES, Device
from hystfmu.start.requirements import JUMPS, TURN, Wanted

STROKE = 0.8  # share of the range of the output that references use
SETTLED = 2  # periods of a reference before metrics count
RINGS = 7.0  # time constants until a mode that the start excites is gone: to a thousandth
LEARNT = 50  # of a periodic one that the user asks for: a repetitive part learns
LEVELS = (-1.0, 0.0, 1.0, 0.5, -0.5)  # of a staircase, of the amplitude
STEP = 0.25  # of the amplitude, on both sides of the middle
LEAST_SAMPLES = SAMPLES // 5  # steps in a period of a reference that the user asks for
MOST_TONES, MOST_ROWS = 40, 100_000
DEFAULT = tuple(Wanted(shape) for shape in ("sine", "nested", "triangle", "step"))


@dataclass(frozen=True)
class Tried:
    """A reference that is tested in the loop, as a block of the scenario."""

    name: str
    shape: str
    frequency: float  # frequency (Hz), amplitude and offset (unit of measure of y)
    amplitude: float
    offset: float
    block: blocks.Reference
    stop: float  # end of the simulation (s); `after`: first time at which errors are evaluated (s)
    after: float
    jumps: bool = False  # whether the reference jumps. The loop shapes a reference with jumps.
    strength: float = 1.0  # RMS value relative to a sine with this amplitude

    def powers(self, f: Array) -> Array:
        """Return the power of the reference at the frequencies f (Hz), shape (k,).

        The power of each harmonic is added at the nearest frequency in f.
        """
        n = np.arange(1, MOST_TONES, 2)
        a = 0.5 / n**2.0  # half cosines between random levels, or shaped steps
        if self.shape == "triangle":
            a = 8 / (np.pi * n) ** 2 * np.abs(np.sinc(n * TURN / 2)) / (1 - TURN / 2)
        if self.shape == "sine":
            a = np.eye(len(n))[0]
        found = np.zeros(len(f))
        np.add.at(found, np.abs(n[:, None] * self.frequency - f).argmin(axis=1), (self.amplitude * a) ** 2 / 2)
        return found

    def beyond(self, f: float, h: float) -> float:
        """Return the power of a reference without jumps above the frequency f (Hz), computed from samples at step h.

        A corner, as in a triangle, has power far above the frequency of the reference.
        """
        if self.jumps:
            return 0.0
        r = _samples(self.block, self.stop, h)[_rows(self.after, h) :]
        window = np.hanning(len(r))
        power = 2 * np.abs(np.fft.rfft(window * (r - r.mean()))) ** 2 / (len(r) * np.sum(window**2))
        return float(power[np.fft.rfftfreq(len(r), h) > f].sum())


def references(found: Device, wanted: Sequence[Wanted]) -> tuple[Tried, ...]:
    """Return the references for the test of a loop, by default `DEFAULT` with the mean cycle frequency of the record.

    References without jumps are first, because the first reference also tests the loop with other devices.

    Raises
    ------
    InputError
        A reference is too fast for the step of the record, or outside the range of the output.
    """
    made: list[Tried] = []
    for w in wanted or DEFAULT:
        t = _tried(found, w)
        same = sum(m.shape == t.shape for m in made)
        made.append(replace(t, name=f"{t.name}_{same + 1}") if same else t)
    return tuple(sorted(made, key=lambda t: t.jumps))


def _tried(found: Device, wanted: Wanted) -> Tried:
    """Scale a reference to the range of the output. The reference starts at the output at rest."""
    f, h = wanted.frequency or found.frequency, found.h
    amplitude, offset = STROKE * (found.high - found.low) / 2, (found.high + found.low) / 2
    if wanted.shape == "file":
        return _from_file(found, wanted.file)
    if wanted.shape in JUMPS:
        # the first level leads from rest, which may be an end of the range, to the middle of the range
        ends = (-STEP, STEP) if wanted.shape == "step" else LEVELS
        levels = [offset + amplitude * v for v in ends]
        T = _rows(1 / f, h) * h
        block = blocks.Reference(m=len(levels) + 1, shape="steps", amplitude=1.0, levels=[found.rest, *levels], T=T)
        size, middle = (max(levels) - min(levels)) / 2, (max(levels) + min(levels)) / 2
        stop, after = (len(levels) + 1) * T, 2 * T
        return Tried(wanted.shape, wanted.shape, f, size, middle, block, stop, after, jumps=True)
    if f * h * LEAST_SAMPLES > 1:
        raise InputError(
            f"The reference must have at least {LEAST_SAMPLES} steps of {h:g} s in a period. "
            f"Got {1 / (f * h):.3g} with {wanted.shape}:{f:g}."
        )
    begin = float(np.clip((found.rest - offset) / amplitude, -1, 1))
    periods = (LEARNT, LEARNT + 2) if wanted.frequency else (SETTLED, PERIODS)
    sized: dict[str, Any] = {"amplitude": amplitude, "offset": offset, "frequency": f}
    if wanted.shape == "nested":
        periods = (SETTLED, PERIODS)
        block = blocks.Reference(m=2 * PERIODS + 4, shape="random_reversals", seed=1, **sized)
    elif wanted.shape == "triangle":
        block = blocks.Reference(m=1, shape="triangle", phase=begin * math.pi / 2, turn=TURN, **sized)
    else:
        block = blocks.Reference(m=1, shape="sine", phase=math.asin(begin), **sized)
    decays = [2 * math.pi * f * zeta for f, zeta in zip(found.plant.f_n, found.plant.zeta, strict=True)]
    rings = RINGS / min(decays, default=math.inf)
    first = max(periods[0], math.ceil(rings * f))  # the start excites the modes
    after, stop = (_rows(n / f, h) * h for n in (first, first + periods[1] - periods[0]))
    strength = _strength(block, amplitude, stop, h) if wanted.shape == "nested" else 1.0
    return Tried(wanted.shape, wanted.shape, f, amplitude, offset, block, stop, after, strength=strength)


def _strength(block: blocks.Reference, amplitude: float, stop: float, h: float) -> float:
    """Return the RMS value of nested reversals relative to the RMS value of a sine with this amplitude."""
    return min(float(np.std(_samples(block, stop, h))) / (amplitude / math.sqrt(2)), 1.0)


def _samples(block: blocks.Reference, stop: float, h: float) -> Array:
    return Graph.single(block.node).run(np.zeros((_rows(stop, h), 0)), h)[:, 0]


def _rows(seconds: float, h: float) -> int:
    return math.ceil(seconds / h - 1e-9)


def _from_file(found: Device, file: str) -> Tried:
    """Read the columns t and r of a CSV file, and interpolate r at the steps of the loop."""
    read = hy.read(file, input="r", output=None)
    t = np.arange(round((read.t[-1] - read.t[0]) / found.h) + 1) * found.h
    if len(t) > MOST_ROWS:
        raise InputError(f"{file}: The reference must last at most {MOST_ROWS} steps. Got {len(t)}.")
    r = np.interp(t, read.t - read.t[0], read.u)
    if r.min() < found.low or r.max() > found.high:
        raise InputError(
            f"{file}: The reference must stay in the range [{found.low:.4g}, {found.high:.4g}] of the record. "
            f"Got {r.min():.4g} to {r.max():.4g}."
        )
    block = blocks.Reference(m=len(r), shape="steps", amplitude=1.0, levels=r.tolist(), T=found.h)
    stop = len(r) * found.h
    size, middle = float(np.ptp(r)) / 2, float(r.max() + r.min()) / 2
    turns = max(np.count_nonzero(np.diff(np.sign(np.diff(r)))) / 2, 0.5)
    return Tried("file", "file", turns / stop, size, middle, block, stop, 0.1 * stop)
