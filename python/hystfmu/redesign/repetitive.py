"""Add a repetitive controller to the loop of a scenario.

The search finds filters with the largest gain and cutoff for which the loop is stable in all corners. A corner is a
worst-case parameter set of the loop (see `hystfmu.redesign.corners`).
"""

import math
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from hystfmu.base import Array, Complex, InputError
from hystfmu.design.loop import beside, grid
from hystfmu.design.repetitive import RepetitiveFilters, filter_angles, learning_filters, taps_at, zero_phase_at
from hystfmu.face.scenario import Scenario
from hystfmu.redesign.corners import Corner, Roles, corners, first_loop, reference_of, roles
from hystfmu.redesign.insert import UNIT, repeating, with_repetitive
from hystfmu.scenario import Results, build, run
from hystfmu.scenario.loop.opened import OpenedLoop
from hystfmu.scenario.loop.opening import open_loop
from hystfmu.scenario.system.spec import MarginsSpec
from hystfmu.scenario.system.system import System

# gains (fraction of the error that is corrected in each period); the first stable gain is used
GAINS = (0.3, 0.2, 0.1, 0.05)
REST = 0.999  # value of Q at frequency 0, so that a constant correction in front of an integrator decays
FLOOR = 1e-3  # regularisation, as a fraction of the mean square of the responses
ABOVE_MODE = 1.2  # largest default cutoff over the fastest mode; a record contains little above twice that mode
HARMONICS = 10  # largest default cutoff for a plant without dynamics, over the frequency of the reference
KEPT = 0.5  # smallest cutoff over the largest stable cutoff, before a smaller gain is tried
PHASES = 96  # number of phases of the period in the search for a peak between harmonics
HIGHEST = 0.4  # largest default cutoff over the sampling frequency
STEP = 2**0.25  # ratio of neighbouring cutoffs in the search
SIDE_Q, SIDE_L = 2.6, 5.0  # number of taps on each side of Q and L, times cutoff over sampling frequency
MOST = 1500  # largest number of taps on each side


def highest(opened: OpenedLoop, n: int) -> float:
    """Return the upper limit of the default cutoff (Hz) for an opened loop and a period of n steps."""
    A = opened.plant[0]
    fastest = float(np.abs(np.linalg.eigvals(A)).max() / (2 * np.pi)) if len(A) else None  # natural frequency (Hz)
    wanted = HARMONICS / (n * opened.h) if fastest is None else ABOVE_MODE * fastest
    return min(wanted, HIGHEST / opened.h)


class Search:
    """Search for a cutoff and a gain with which the loop is stable in all corners. The first corner is nominal.

    `h` is the step (s). `n` is the number of steps in a period. `peak` is the largest allowed peak of the sensitivity
    of the nominal loop with learning.
    """

    def __init__(self, found: Sequence[Corner], h: float, n: int, peak: float = math.inf) -> None:
        self._found, self._h, self._n, self._peak = found, h, n, peak
        poles = np.concatenate([c.opened.poles(c.slope, c.delay) for c in found])
        angles = np.union1d(grid(), beside(poles, grid()))
        self._z: Complex = np.exp(1j * angles)
        self._T = np.array([c.learnt(angles) for c in found])
        first = [c for c in found if c.name == found[0].name and c.delay == 0]
        nominal = min(first, key=lambda c: abs(c.slope - c.opened.nominal))
        self._S = np.abs(1 / (1 + nominal.without_memory(angles)))
        self._T_nominal = nominal.learnt(angles)
        self._design = np.array([c.learnt(filter_angles()) for c in found if c.delay == 0])

    def at(self, cutoff: float, gain: float) -> RepetitiveFilters:
        """Design filters for a cutoff (Hz) and a gain, and compute the convergence factor of each corner.

        The convergence factor is the largest factor by which an error changes per period.
        """
        n_q, n_l = (min(math.ceil(k / (cutoff * self._h)), self._n - 1, MOST) for k in (SIDE_Q, SIDE_L))
        made = learning_filters(self._design, self._h, cutoff, gain, n_q, n_l, REST, FLOOR)
        Q, L = zero_phase_at(made.q, self._z), taps_at(made.l, self._z)
        return RepetitiveFilters(made.q, made.l, tuple(np.abs(Q - L * self._T).max(axis=1).tolist()))

    def best(self, cutoff: float | None, gain: float | None, top: float) -> tuple[RepetitiveFilters, float, float]:
        """Return filters, cutoff and gain: the largest stable gain, and the largest stable cutoff for this gain.

        A reduction of the error at the harmonics increases the sensitivity between the harmonics. If possible, the
        chosen cutoff and gain also meet the limit of the sensitivity. If the loop is unstable for all tested filters,
        an InputError is raised.
        """
        if cutoff is not None and not 0 < cutoff < 0.5 / self._h:
            raise InputError(f"The cutoff must be a float in (0, {0.5 / self._h:g}) Hz. Got {cutoff:g} instead.")
        first: tuple[RepetitiveFilters, float, float] | None = None
        for g in GAINS if gain is None else (gain,):
            highest = 0.0
            for f in self._cutoffs(top) if cutoff is None else (cutoff,):
                if f < KEPT * highest:
                    break
                found = self.at(f, g)
                if max(found.contraction) < 1:
                    first, highest = first or (found, f, g), highest or f
                    if self._peak_with(found) <= self._peak:
                        return found, f, g
        if first is None:
            raise InputError(self._refusal(cutoff, gain, top))
        return first

    def _peak_with(self, filters: RepetitiveFilters) -> float:
        """Return the peak of the sensitivity of the nominal loop with learning, as the maximum over all periods."""
        Q, L = zero_phase_at(filters.q, self._z), taps_at(filters.l, self._z)
        turn = np.exp(2j * np.pi * np.arange(PHASES) / PHASES)[:, None]
        return float((np.abs((1 - turn * Q) / (1 - turn * (Q - L * self._T_nominal))) * self._S).max())

    def worst(self, filters: RepetitiveFilters, cutoff: float) -> tuple[str, float]:
        """Return the corner in which errors decrease slowest, and the factor per period, up to half the cutoff."""
        top = max(math.floor(self._n * cutoff * self._h / 2), 1)
        angles = 2 * np.pi * np.arange(1, top + 1) / self._n
        z = np.exp(1j * angles)
        Q, L = zero_phase_at(filters.q, z), taps_at(filters.l, z)
        left = [float(np.abs(Q - L * c.learnt(angles)).max()) for c in self._found]
        k = int(np.argmax(left))
        return self._found[k].name, left[k]

    def _cutoffs(self, top: float) -> Array:
        """Return the cutoffs of the search (Hz), from `top` down to the frequency of the reference."""
        lowest = 1 / (self._n * self._h)
        k = max(math.floor(math.log(max(top / lowest, 1.0), STEP)), 0)
        return np.array([float(f"{top / STEP**i:.4g}") for i in range(k + 1)])

    def _refusal(self, cutoff: float | None, gain: float | None, top: float) -> str:
        """Return an error message that states the corner in which an error grows, and a stable cutoff or gain."""
        g, f = gain or GAINS[0], cutoff or top
        left = self.at(f, g).contraction
        k = int(np.argmax(left))
        reachable = []
        if cutoff is not None:
            lower = next(
                (float(x) for x in self._cutoffs(min(f, HIGHEST / self._h)) if max(self.at(x, g).contraction) < 1), None
            )
            reachable += [f"a cutoff of {lower:.4g} Hz"] if lower is not None else []
        lower = next((x for x in (g / 2, g / 4, g / 8) if max(self.at(f, x).contraction) < 1), None)
        reachable += [f"a gain of {lower:g}"] if lower is not None else []
        what = f"use {' or '.join(reachable)}" if reachable else "no tested cutoff or gain is stable"
        case = self._found[k].opened.system.case
        return (
            f"{case.scenario}: Errors must shrink from period to period in every corner. Got a factor of {left[k]:.4g} "
            f"at {self._found[k].name} with cutoff {f:.4g} Hz and gain {g:g}; {what}."
        )


# default and smallest number of periods in a run, and largest number of rows
PERIODS, LEAST_PERIODS, ROWS = 30, 10, 2_000_000
OFF = (0.2, 0.1, 0.05, 0.02, 0.0)  # relative errors of the natural frequencies; the first stable one is used
PERIODIC = ("sine", "triangle")
WORSE = 2.0  # largest allowed ratio of the errors with and without learning


@dataclass(frozen=True)
class Repetitive:
    """A loop with a repetitive controller, and the results of its simulation.

    Attributes
    ----------
    scenario : Scenario
        Scenario of the loop. Its block `repetitive` contains the filter taps.
    filters : RepetitiveFilters
        Filter taps, and the convergence factor in each corner.
    corners : tuple of str
        Names of the corners, in the order of `filters.contraction`.
    steps : int
        Number of steps in a period.
    period : float
        Period of the reference (s).
    cutoff, gain : float
        Upper frequency of learning (Hz), and fraction of the error that is corrected in each period.
    off : float
        Largest relative error of the natural frequencies of the plant.
    worst : (str, float)
        Corner in which errors decrease slowest, and their factor per period, for harmonics up to half the cutoff.
    before : dict of str to float
        Value of the first metric of each case without learning.
    results : Results
        Results of the cases with learning.
    """

    scenario: Scenario
    filters: RepetitiveFilters
    corners: tuple[str, ...]
    steps: int
    period: float
    cutoff: float
    gain: float
    off: float
    worst: tuple[str, float]
    before: dict[str, float]
    results: Results


def repetitive(
    scenario: Scenario | str | Path,
    *,
    name: str | None = None,
    period: float | None = None,
    cutoff: float | None = None,
    gain: float | None = None,
    off: float | None = None,
    progress: Callable[[float], None] = lambda fraction: None,
) -> Repetitive:
    """Add a repetitive controller to the loop of a scenario. The new loop is stable in all corners.

    The block `repetitive` adds corrections to the command of the controllers. If there is an inverse, the block is in
    front of the inverse. Errors decrease from period to period in every case with a periodic reference. This is also
    true for the incremental gains (`slopes`) and delays in `[margins]` of the scenario, and for shifted natural
    frequencies of the plant.

    Parameters
    ----------
    scenario : Scenario or path
        Scenario with a loop that is stable without the repetitive controller.
    name : str, optional
        Name of the new scenario; by default the old name followed by ``_repetitive``.
    period : float in (0, inf), optional
        Period of the reference (s). It must be a whole number of steps. The default is the period of the reference in
        the first case with a closed loop, rounded to a whole number of steps.
    cutoff : float in (0, inf), optional
        Highest frequency (Hz) at which the repetitive control learns. The default is the largest value for which the
        loop is stable in all corners. The default does not exceed 1.2 times the natural frequency of the fastest mode.
        For a plant without dynamics, it does not exceed ten times the frequency of the reference.
    gain : float in (0, 1], optional
        Learning gain: share of the error that one period corrects. The default is 0.3. The default is smaller if the
        loop is unstable with 0.3 for every cutoff, or if the peak of the sensitivity exceeds the limit in `[margins]`.
    off : float, optional
        Largest relative error of the natural frequencies of the plant, in [0, 0.9]. The default is the largest of 0.2,
        0.1, 0.05, 0.02 and 0 for which the loop is stable without learning.
    progress : function, optional
        Function that is called with the completed fraction of the work, 0 to 1.

    Returns
    -------
    Repetitive

    Raises
    ------
    InputError
        The scenario has no loop, the loop is unstable without the repetitive controller, the loop already has a period
        memory, or the reference is not periodic. The error is also raised if the loop is unstable in a corner with the
        given cutoff and gain. In this case the message states stable values.

    Examples
    --------
    >>> import hystfmu as hy
    >>> made = hy.redesign.repetitive("scenarios/stage/irc", period=0.01)  # doctest: +SKIP
    >>> made.scenario.save("mine").name  # doctest: +SKIP
    'mine'
    """
    for what, value, most in (("gain", gain, 1.0), ("off", off, 0.9)):
        if value is not None and not (0 <= value <= most and (value > 0 or what == "off")):
            left = "[" if what == "off" else "("
            raise InputError(
                f"The '{what}' of repetitive() must be a float in {left}0, {most:g}]. Got {value} instead."
            )
    loop = scenario if isinstance(scenario, Scenario) else Scenario.load(scenario)
    table = loop.table
    systems = {c.name: build(c) for c in loop.ready().cases}
    first, opened = first_loop(systems, (table.get("margins") or {}).get("case"), period)
    of, h = roles(opened), opened.h
    n = _steps(systems[first], of, period)
    kept = _kept(systems, first, of)

    def with_taps(taps: RepetitiveFilters, text: str, periods: int) -> Scenario:
        made = with_repetitive(repeating(table, kept, of.sources, n, periods), of, n, taps, text)
        words = f"{table.get('text', '')} with a repetitive part".strip()
        return loop.changed({**made, "name": name or f"{table['name']}_repetitive", "text": words})

    ready = with_taps(RepetitiveFilters(np.zeros(1), np.zeros(1), ()), "not designed yet", 1).ready()
    loops = {c.name: open_loop(build(c)) for c in ready.cases}
    found, off = _stable_corners({first: loops[first], **loops}, ready.spec.margins, OFF if off is None else (off,))
    progress(0.3)
    asked = ready.spec.margins.Ms_db if ready.spec.margins is not None else None
    search = Search(found, h, n, 10 ** (asked / 20) if asked is not None else math.inf)
    filters, cutoff, gain = search.best(cutoff, gain, highest(opened, n))
    progress(0.5)
    text = f"learns {gain:g} of the error in a period of {n * h:g} s, up to {cutoff:.4g} Hz"
    periods = max(LEAST_PERIODS, min(PERIODS, ROWS // (n * opened.system.case.ripple)))
    made = with_taps(filters, text, periods)
    results = run(made, engine="native", progress=lambda x: progress(0.5 + 0.25 * x))
    silent = run(
        made, engine="native", set={f"{UNIT}.l": [0.0] * len(filters.l)}, progress=lambda x: progress(0.75 + x / 4)
    )
    before = {r.case: r.value() for r in silent}
    _hold(results, before, first)
    return Repetitive(
        made,
        filters,
        tuple(c.name for c in found),
        n,
        n * h,
        cutoff,
        gain,
        off,
        search.worst(filters, cutoff),
        before,
        results,
    )


def _stable_corners(
    loops: Mapping[str, OpenedLoop], limits: MarginsSpec | None, shares: Sequence[float]
) -> tuple[list[Corner], float]:
    """Return the corners for the first value in `shares` with which all loops are stable, and this value.

    `shares` contains relative errors of the natural frequencies of the plant.
    """
    for share in shares[:-1]:
        with suppress(InputError):
            return corners(loops, limits, share), share
    return corners(loops, limits, shares[-1]), shares[-1]


def _steps(system: System, of: Roles, period: float | None) -> int:
    """Return the number of steps in a period of the reference."""
    h, where = system.case.step, system.case.title
    if period is not None:
        if not (np.isfinite(period) and period > 0):
            raise InputError(f"The 'period' of repetitive() must be a float in (0, inf). Got {period} instead.")
        n = max(round(period / h), 1)
        if abs(period / h - n) > 1e-6 * n:
            low, high = (max(f(period / h), 4) for f in (math.floor, math.ceil))
            raise InputError(
                f"{where}: The period must be a whole number of steps of {h:g} s. Got {period / h:.6g}; near are "
                f"{1 / (high * h):.6g} and {1 / (low * h):.6g} Hz."
            )
    else:
        frequency, shape = reference_of(system, of)
        if shape not in PERIODIC or not frequency > 0:
            raise InputError(
                f"{where}: The reference must be a sine or triangle, or its period given. Got {shape or 'neither'}."
            )
        n = round(1 / (frequency * h))
    if not 4 <= n <= 1_000_000:
        raise InputError(f"{where}: The period must be 4 to 1000000 steps of {h:g} s. Got {n}.")
    return n


def _kept(systems: Mapping[str, System], first: str, of: Roles) -> list[str]:
    """Return the cases that have this loop and a reference with the period of the first case.

    If some of these cases have a limit, return only the cases with a limit.
    """
    asked = {k for k, s in systems.items() if any(m.limit is not None for m in s.case.metrics.values())}
    frequency, _ = reference_of(systems[first], of)
    kept = [first]
    for name, system in systems.items():
        own, shape = reference_of(system, of)
        same = not of.sources or (shape in PERIODIC and math.isclose(own, frequency))
        if name == first or not same or (asked and name not in asked):
            continue
        try:
            if roles(open_loop(system, (1.0, 1.0))) == of:
                kept.append(name)
        except InputError:  # a case without a loop is omitted
            continue
    return kept


def _hold(results: Results, before: Mapping[str, float], first: str) -> None:
    """Raise an InputError if learning increases the error of the nominal run and the run misses its limit.

    This function does not test other cases.
    """
    for r in (r for r in results if r.case == first):
        value, asked = r.value(), r.verdicts[0].limit if r.verdicts else None
        if not value <= max(WORSE * before[r.case], asked or 0.0):
            got = "a run that stopped" if not r.verdicts else f"{value:.3g} instead of {before[r.case]:.3g}"
            raise InputError(
                f"{r.system.case.title}: Learning must not increase the error. Got {got}: use a lower gain or cutoff."
            )
