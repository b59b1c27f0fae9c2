"""Finds the ranges of damping, second mode and gain in which the linearised loop of a scenario is stable.

Everything else is drawn as the study file `loops/hard_draws.toml`, or `stage/hard_draws.toml`, states: frequencies of
the modes, delay, weights and thresholds of the hysteresis.  The slopes of plant over inverse are those that the case
itself fills with the extreme weights and thresholds.  Instability is sought at the ends of all ranges, where it begins,
and in random draws.
"""

import functools
import itertools
import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from hystfmu.design import linearise
from hystfmu.graph import Graph, Input, Node, Output
from hystfmu.scenario import Cases, build
from hystfmu.scenario.loop.opened import OpenedLoop
from hystfmu.scenario.loop.opening import open_loop

SCENARIOS = Path(__file__).parents[1]
CONTINUOUS = ("amplifier", "modes")  # blocks of the plant side with dynamics that stay
HALVINGS = 7  # of a range that is partly stable
DELAYS = [0.0, 0.5, 1.0]  # steps, up to what the designs know of
TUNED = (0.8, 1.2)  # gains of draws.toml
STATED = 0.9  # of the way from nominal to the end of a range that holds
DRAWS = 150  # beside the ends of the ranges


@dataclass(frozen=True)
class Axis:
    """A quantity with its nominal value and the range that is asked for.

    Attributes
    ----------
    nominal, least, largest : float
    log : bool
        Distances are ratios, and ways geometric.
    beyond : (float, float)
        Where the search for the value at which the loop breaks ends, on both sides.
    """

    nominal: float
    least: float
    largest: float
    log: bool
    beyond: tuple[float, float]

    def towards(self, end: float, part: float) -> float:
        """Return the value at a part of the way from nominal to an end."""
        if self.log:
            return float(self.nominal * (end / self.nominal) ** part)
        return self.nominal + part * (end - self.nominal)

    def part(self, end: float, value: float) -> float:
        """Return at which part of the way from nominal to an end a value lies."""
        if self.log:
            return math.log(value / self.nominal) / math.log(end / self.nominal)
        return (value - self.nominal) / (end - self.nominal)


Box = dict[str, tuple[float, float]]
Parts = dict[tuple[str, int], float]
LOOP_AXES = {
    "damping": Axis(0.7, 0.01, 0.9, True, (1e-3, 5.0)),
    "second_mode": Axis(0.0, 0.0, 0.01, False, (0.0, 1.0)),
    "gain": Axis(1.0, 0.35, 1.2, True, (0.01, 10.0)),
}
STAGE_AXES = {
    "damping": Axis(0.02, 0.01, 0.9, True, (1e-3, 5.0)),
    "second_mode": Axis(0.1, 0.01, 0.2, False, (0.0, 1.0)),
    "gain": Axis(1.0, 0.35, 1.2, True, (0.01, 10.0)),
}


class Loop:
    """The linearised loop of a scenario on drawn devices.

    Parameters
    ----------
    name : str
        Folder below `scenarios`.
    """

    def __init__(self, name: str) -> None:
        self.name, self.folder = name, SCENARIOS / name
        self.stage = name.startswith("stage/")
        self.axes = STAGE_AXES if self.stage else LOOP_AXES
        self._cache: dict[tuple[float, ...], Any] = {}

    @property
    def learns(self) -> bool:
        """Whether a memory of a period stands in the loop; its lead is for the delay that it knows of."""
        return self.name.endswith("repetitive") or self.name == "iterative_learning"

    def case(self, settings: Mapping[str, Any]) -> Any:
        """Return the hard case without other changes, with settings."""
        name = "scan_100" if self.stage else "nominal"
        return next(c for c in Cases(self.folder / "hard.toml", dict(settings)).cases if c.name == name)

    @functools.cached_property
    def opened(self) -> OpenedLoop:
        """The loop of the nominal device; without delay between command and plant, unless it learns."""
        return open_loop(build(self.case({} if self.learns else {"delay.n": 0})))

    @functools.cached_property
    def slopes(self) -> tuple[float, ...]:
        """Slopes of plant over inverse along the path of the case with the extreme weights and thresholds, for gain 1.

        A loop that is unstable for one of them alone has limit cycles that few draws find.
        """
        found = list(self.opened.slopes)
        for w, r in itertools.product((0.8, 1.2), (0.9, 1.1)):
            settings = {"plant.hysteresis_w": f"*{w}", "plant.hysteresis_r": f"*{r}"}
            found += open_loop(build(self.case(settings))).slopes
        return min(found), 1.0, max(found)

    def _plant(self, f: tuple[float, float], zeta: float, k: tuple[float, float]) -> Any:
        key = (*f, zeta, *k)
        if key not in self._cache:
            if len(self._cache) > 20_000:
                self._cache.clear()
            part = next(p for p in self.opened.system.parts if p.name == "plant")
            first = [n for n in part.own.nodes if n.type in CONTINUOUS and n.type != "modes"]
            g0 = next(n for n in part.own.nodes if n.type == "modes")
            share = np.array(k) / sum(k)
            modes = Node("g0", "modes", g0.dims, {"f_n": f, "zeta": [zeta, g0.values["zeta"][1]], "k": share})
            nodes = [*first, modes]
            wires = [(f"{a.name}.y", f"{b.name}.u") for a, b in itertools.pairwise(nodes)]
            ends = [Input("u", (f"{nodes[0].name}.u",))], [Output("y", "g0.y")]
            self._cache[key] = linearise(Graph(nodes, wires, *ends))
        return self._cache[key]

    def stable(self, device: Mapping[str, float], slope: float | None = None, opened: OpenedLoop | None = None) -> bool:
        """Whether the loop is stable on a device, for one slope at gain 1 or at the ends and the middle of the sector.

        Parameters
        ----------
        device : mapping
            `damping`, `second_mode`, `gain`, `f_1` and `f_2` (Hz), `delay` (steps).
        slope : float, optional
        opened : OpenedLoop, optional
            By default the loop with its memory.
        """
        k = (0.9 if self.stage else 1.0, device["second_mode"])
        nominal = 1.0 if self.stage else k[0]  # static gain for which slopes are 1
        opened = replace(opened or self.opened, plant=self._plant((device["f_1"], device["f_2"]), device["damping"], k))
        gain = device["gain"] * sum(k) / nominal
        late = device["delay"] - (DELAYS[-1] if self.learns else 0.0)
        slopes = self.slopes if slope is None else (slope,)
        return all(opened.stable(gain * s, late) for s in slopes)

    @property
    def nominal(self) -> dict[str, float]:
        """The device that the design knows."""
        modes = {"f_1": 500.0, "f_2": 1600.0} if self.stage else {"f_1": 500.0, "f_2": 1500.0}
        return {name: axis.nominal for name, axis in self.axes.items()} | modes | {"delay": 1.0}

    @functools.cached_property
    def others(self) -> dict[str, list[float]]:
        """What is drawn beside the axes: ends, and places between them where a mode may stand."""
        places = 3 if self.learns else 7  # a memory takes long, and its loop lies in the one without it
        low, high = (0.8, 1.2) if self.stage else (400 / 500, 600 / 500)
        f = {k: [self.nominal[k] * p for p in np.linspace(low, high, n)] for k, n in (("f_1", 3), ("f_2", places))}
        return f | {"delay": DELAYS[-1:] if self.learns else DELAYS}

    def devices(self, box: Box, seed: int = 0) -> Iterator[dict[str, float]]:
        """Yield devices of a box: the ends first, where a range is left, then random draws."""
        ends = [sorted(set(box[name])) for name in self.axes]
        for values in itertools.product(*ends, *self.others.values()):
            yield dict(zip([*self.axes, *self.others], values, strict=True))
        rng = np.random.default_rng(seed)
        for _ in range(DRAWS // 3 if self.learns else DRAWS):
            drawn = {}
            for name, axis in self.axes.items():
                lo, hi = box[name]
                p = rng.random()
                drawn[name] = float(lo * (hi / lo) ** p) if axis.log else lo + p * (hi - lo)
            for name, places in self.others.items():
                drawn[name] = float(rng.uniform(min(places), max(places)))
            yield drawn

    def holds(self, box: Box, opened: OpenedLoop) -> bool:
        """Whether a loop is stable on every device of a box."""
        return all(self.stable(d, opened=opened) for d in self.devices(box))

    def box(self, parts: Parts) -> Box:
        """Return the box that states ends at these parts of the way from nominal to what is asked for."""
        found = {}
        for name, a in self.axes.items():
            ends = (a.least, a.largest)
            found[name] = tuple(a.towards(end, parts[name, k] / STATED) for k, end in enumerate(ends))
        return found  # type: ignore[return-value]

    def widest(self) -> Box:
        """Return a box that holds: the gains of draws.toml, then all ends out as far as that goes, then each alone.

        A memory of a period takes longer to check: its box lies in that of the loop without it.
        """
        ends = [(name, k) for name in self.axes for k in (0, 1)]
        parts = self._wider(dict.fromkeys(ends, 1.0), replace(self.opened, memories=()))
        if self.opened.memories:
            parts = self._wider(parts, self.opened)
        return self.box(parts)

    def _wider(self, most: Parts, opened: OpenedLoop) -> Parts:
        """Move the ends out to at most these parts of the way."""
        parts, gain = dict.fromkeys(most, 0.0), self.axes["gain"]
        ends = ((gain.least, TUNED[0]), (gain.largest, TUNED[1]))
        tuned = {("gain", k): min(most["gain", k], gain.part(*end)) for k, end in enumerate(ends)}
        for target in (tuned, most, *({e: most[e]} for e in most if most[e] > 0)):

            def moved(share: float, target: Parts = target, at: Parts = parts) -> Parts:
                return at | {e: at[e] + share * (target[e] - at[e]) for e in target}

            lo, hi = 0.0, 1.0
            if self.holds(self.box(moved(hi)), opened):
                lo = hi
            halvings = HALVINGS // 2 if opened.memories else HALVINGS
            for _ in range(halvings if lo < hi else 0):
                middle = (lo + hi) / 2
                lo, hi = (middle, hi) if self.holds(self.box(moved(middle)), opened) else (lo, middle)
            parts = moved(lo)
        return parts

    def breaks(self, name: str, side: int) -> float | None:
        """Return the value nearest to nominal at which the nominal loop becomes unstable; None: not in what is sought.

        Everything else is nominal, the slope 1.
        """
        axis, last = self.axes[name], 0.0
        end = axis.beyond[side]
        if axis.towards(end, 1.0) == axis.nominal:
            return None
        for part in np.linspace(0, 1, 121)[1:]:
            if not self._alone(name, axis.towards(end, part)):
                lo, hi = last, float(part)
                for _ in range(20):
                    middle = (lo + hi) / 2
                    lo, hi = (middle, hi) if self._alone(name, axis.towards(end, middle)) else (lo, middle)
                return axis.towards(end, hi)
            last = float(part)
        return None

    def _alone(self, name: str, value: float) -> bool:
        return self.stable(self.nominal | {name: value}, 1.0)


def shrunk(axes: Mapping[str, Axis], box: Box) -> Box:
    """Return a box whose ends lie a tenth of the way nearer to nominal."""
    return {name: (axes[name].towards(lo, STATED), axes[name].towards(hi, STATED)) for name, (lo, hi) in box.items()}
