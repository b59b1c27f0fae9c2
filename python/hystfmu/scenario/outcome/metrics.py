"""Metrics of a run, computed from successive rows.

`hystfmu.Scenario.metric` explains the kinds. The area of an ellipse is at most 78.5 %.

With `lines`, rms and max use only the rows at which `against` moves at constant speed. In a scan, these rows are the
straight lines without the turn-arounds.

Sums are computed in the order of the rows. Therefore the division into chunks has no effect on the result.

This module also finds the unit of measure of each signal for reports. Blocks, models and FMUs state the units of
measure of some ports. A stated unit of measure also applies to connected ports.

Two signals have the same unit of measure if they are connected, if a metric subtracts them, or if a block passes them
without scaling. If the unit of measure of one of these signals is stated, it applies to all of them.
"""

from collections.abc import Callable, Iterator
from typing import NamedTuple, Protocol

import numpy as np

from hystfmu.base import Array, InputError
from hystfmu.graph import Graph
from hystfmu.scenario.outcome.trace import Trace
from hystfmu.scenario.system.case import split_end
from hystfmu.scenario.system.spec import MetricSpec
from hystfmu.scenario.system.system import Part, System, behind


class _Rows(NamedTuple):
    """Rows of a chunk inside the window of a metric. `sample` is the index of the first row at a sampling instant."""

    t: Array
    signal: Array
    against: Array
    sample: int
    ripple: int


class _Kind(Protocol):
    def add(self, rows: _Rows) -> None: ...

    def value(self) -> float: ...


class _Sum:
    """Sum of numbers, computed in the order in which they are added."""

    def __init__(self) -> None:
        self.value = 0.0

    def add(self, x: Array) -> None:
        """Add numbers. The array `x` is overwritten."""
        if len(x):
            x[0] += self.value
            self.value = float(np.add.accumulate(x, out=x)[-1])


class _Span:
    """Smallest and largest number."""

    def __init__(self) -> None:
        self.low, self.high = np.inf, -np.inf

    def add(self, x: Array) -> None:
        if len(x):
            self.low, self.high = min(self.low, float(x.min())), max(self.high, float(x.max()))

    @property
    def width(self) -> float:
        return self.high - self.low

    @property
    def largest(self) -> float:
        return max(abs(self.low), abs(self.high))


class _Final:
    def __init__(self) -> None:
        self._e = 0.0

    def add(self, rows: _Rows) -> None:
        self._e = float(rows.signal[-1] - rows.against[-1])

    def value(self) -> float:
        return abs(self._e)


class _Rms:
    def __init__(self) -> None:
        self._n, self._sum = 0, _Sum()

    def add(self, rows: _Rows) -> None:
        self._n += len(rows.t)
        self._sum.add((rows.signal - rows.against) ** 2)

    def value(self) -> float:
        return float(np.sqrt(self._sum.value / self._n)) if self._n else np.inf


class _Max:
    def __init__(self) -> None:
        self._span = _Span()

    def add(self, rows: _Rows) -> None:
        self._span.add(rows.signal - rows.against)

    def value(self) -> float:
        return self._span.largest


class _BetweenSamples:
    """Metric of the error between samples. Rows after a sampling instant are stored until the next sampling instant."""

    def __init__(self) -> None:
        self._t, self._e, self._from_sample, self._largest = np.zeros(0), np.zeros(0), False, 0.0

    def add(self, rows: _Rows) -> None:
        waiting = len(self._t)
        t, e = np.append(self._t, rows.t), np.append(self._e, rows.signal - rows.against)
        at = np.arange(waiting + rows.sample, len(t), rows.ripple)
        if self._from_sample:
            at = np.append(0, at)
        first, last = (int(at[0]), int(at[-1])) if len(at) else (0, 0)  # no line leads to the first sample
        if last > first:
            gap = e[first : last + 1] - np.interp(t[first : last + 1], t[at], e[at])
            self._largest = max(self._largest, float(np.abs(gap).max()))
        self._from_sample = len(at) > 0
        self._t, self._e = t[last:], e[last:]

    def value(self) -> float:
        rest = float(np.abs(self._e - self._e[0]).max())  # a run ends with a sample, so no stored rows are left
        return max(self._largest, rest)


class _Variation:
    def __init__(self) -> None:
        self._last: tuple[float, float] | None = None
        self._sums = _Sum(), _Sum()

    def add(self, rows: _Rows) -> None:
        samples = rows.signal[rows.sample :: rows.ripple], rows.against[rows.sample :: rows.ripple]
        if not len(samples[0]):
            return
        before = (samples[0][0], samples[1][0]) if self._last is None else self._last
        for of, x, last in zip(self._sums, samples, before, strict=True):
            of.add(np.abs(np.diff(x, prepend=last)))
        self._last = float(samples[0][-1]), float(samples[1][-1])

    def value(self) -> float:
        a, b = (s.value for s in self._sums)
        return a / b if b else (1.0 if a == 0 else np.inf)


class _LoopArea:
    """Ratio of the area of a loop to the area of the rectangle of its spans. A straight line closes the loop."""

    def __init__(self) -> None:
        self._origin: tuple[float, float] | None = None
        self._last = 0.0, 0.0
        self._spans, self._sums = (_Span(), _Span()), (_Sum(), _Sum())

    def add(self, rows: _Rows) -> None:
        if self._origin is None:
            self._origin = float(rows.against[0]), float(rows.signal[0])
        x, y = rows.against - self._origin[0], rows.signal - self._origin[1]
        self._spans[0].add(x)
        self._spans[1].add(y)
        x, y = np.append(self._last[0], x), np.append(self._last[1], y)
        self._sums[0].add(x[:-1] * y[1:])
        self._sums[1].add(x[1:] * y[:-1])
        self._last = float(x[-1]), float(y[-1])

    def value(self) -> float:
        box = self._spans[0].width * self._spans[1].width
        return abs(self._sums[0].value - self._sums[1].value) / 2 / box if box else 0.0


_KINDS: dict[str, Callable[[], _Kind]] = {
    "peak": _Max,
    "final": _Final,
    "rms_percent": _Rms,
    "rms": _Rms,
    "max_percent": _Max,
    "between_samples_percent": _BetweenSamples,
    "variation_ratio": _Variation,
    "loop_area_percent": _LoopArea,
}
# allowed change of an error that consists only of rounding (percent of stroke, or unit of measure of the signal)
ROUNDING = 1e-9
_OF_STROKE = ("rms_percent", "max_percent", "between_samples_percent")
_DIFFERENCE = ("rms", "final")  # in the unit of measure of two signals, which may be far below 1 (m, A)


class _Lines:
    """Selection of the rows at which the reference moves at constant speed."""

    STRAIGHT = 1e-6  # largest relative change of the speed between two steps

    def __init__(self) -> None:
        self._before = np.full(2, np.nan)

    def __call__(self, against: Array) -> Array:
        whole = np.append(self._before, against)
        self._before = whole[-2:]
        steps = np.diff(whole)
        return np.asarray(np.abs(np.diff(steps)) <= self.STRAIGHT * np.abs(steps[1:]))


class Measure:
    """One metric of a run, computed from chunks of rows."""

    def __init__(self, m: MetricSpec) -> None:
        self._m, self._of, self._span = m, _KINDS[m.kind](), _Span()
        self._percent = m.kind in _OF_STROKE
        self._lines = _Lines() if m.lines else None

    def add(self, chunk: Trace) -> None:
        """Add the next rows."""
        m = self._m
        skip = int(np.searchsorted(chunk.t, m.after * (1 - 1e-12)))
        if skip == len(chunk.t):
            return
        signal = chunk[m.signal][skip:]
        # `peak` is that of the signal alone, also if the metric names a reference
        nothing = np.broadcast_to(0.0, signal.shape)
        against = nothing if m.against is None or m.kind == "peak" else chunk[m.against][skip:]
        sample = -(chunk.first + skip) % chunk.ripple
        with np.errstate(over="ignore", invalid="ignore"):  # the metric of a diverged run is infinite or NaN
            if m.kind in _DIFFERENCE or (self._percent and m.stroke is None):
                self._span.add(against)
            on = slice(None) if self._lines is None else self._lines(against)
            self._of.add(_Rows(chunk.t[skip:][on], signal[on], against[on], sample, chunk.ripple))

    @property
    def rounding(self) -> float:
        """Change of the metric that may be rounding; 1e-9 of the largest abs(`against`) if this is below 1."""
        size = self._span.largest if self._m.kind in _DIFFERENCE else 1.0
        return ROUNDING * min(size or 1.0, 1.0)

    def value(self) -> float:
        """Return the metric for all rows so far. An InputError is raised if the stroke is zero."""
        value, m = self._of.value(), self._m
        if m.kind == "loop_area_percent":
            return 100 * value
        if not self._percent:
            return value
        stroke = m.stroke if m.stroke is not None else self._span.width
        if stroke == 0:
            raise InputError(f"the stroke is zero: {m.against} is constant; state 'stroke'")
        return 100 * value / stroke


def measure(m: MetricSpec, trace: Trace) -> float:
    """Compute one metric of a whole run. An InputError is raised if the stroke is zero."""
    found = Measure(m)
    found.add(trace)
    return found.value()


# kinds of metrics that are computed from `signal` - `against`
SUBTRACTED = ("rms_percent", "max_percent", "between_samples_percent", "rms", "final")
OF_SIGNAL = ("peak", "final", "rms")  # kinds of metrics in the unit of measure of `signal`
PASSED_ON = ("delay", "quantiser", "sum")  # blocks that delay, round or add their inputs without scaling


def unit_of(system: System, end: str) -> str:
    """Return the unit of measure of `unit.output`, `unit.input` or `unit.parameter`.

    The result is "" if no unit of measure is stated, or if signals that must have the same unit of measure state
    different ones. The entry "1" in the port table of a block in C stands for the unit of measure of the data, and is
    ignored here.
    """
    own = _stated(system, end)
    if own:
        return own
    found = {unit for other in _same_quantity(system, end) if (unit := _stated(system, other))}
    return found.pop() if len(found) == 1 else ""


def _stated(system: System, end: str) -> str:
    name, variable = split_end(end, "unit_of")
    for part in system.parts:
        for port in part.graph.ports if part.name == name else ():
            if variable == port.name or variable in port.scalar_names:
                return "" if port.unit == "1" else port.unit
    return ""


def _same_quantity(system: System, end: str) -> set[str]:
    """Return all signals that have the same unit of measure as `end`, including `end`."""
    pairs = list(_pairs(system))
    return behind([*pairs, *((b, a) for a, b in pairs)], end) | {end}


def _pairs(system: System) -> Iterator[tuple[str, str]]:
    names = system.names
    for link in system.links:
        to = system.parts[link.to]
        yield names[link.source], f"{to.name}.{to.inputs[link.input]}"
    for m in system.case.metrics.values():
        if m.kind in SUBTRACTED and m.against is not None:
            yield m.signal, m.against
    for part in system.parts:
        yield from ((f"{part.name}.{a}", f"{part.name}.{b}") for a, b in _passed_on(part))


def _passed_on(part: Part) -> Iterator[tuple[str, str]]:
    """Yield inputs and outputs of a unit with one block that does not scale signals."""
    if not isinstance(part.graph, Graph) or len(part.graph.nodes) != 1 or part.graph.nodes[0].type not in PASSED_ON:
        return
    (node,) = part.graph.nodes
    weights = node.value("k").tolist() if "k" in node.sizes else [1.0] * len(part.inputs)
    for name, weight in zip(part.inputs, weights, strict=False):
        if abs(weight) == 1.0:
            yield from ((name, output) for output in part.outputs)


def unit_of_metric(system: System, m: MetricSpec) -> str:
    """Return the unit of measure of a metric: percent, that of the signal, or "" for a ratio."""
    if m.kind.endswith("_percent"):
        return "%"
    return unit_of(system, m.signal) if m.kind in OF_SIGNAL else ""


def label(name: str, unit: str) -> str:
    """Return a name with its unit of measure, if there is one, for a table or an axis."""
    return f"{name} in {unit}" if unit else name
