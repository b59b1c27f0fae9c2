"""Limits of the linearised loop as constraints of a study: peak of the sensitivity, stability in the corners."""

from __future__ import annotations

import math
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import replace
from typing import Any

import numpy as np

from hystfmu.base.errors import InputError
from hystfmu.scenario import build
from hystfmu.scenario.loop.opened import SLOPES, OpenedLoop
from hystfmu.scenario.loop.opening import open_loop
from hystfmu.scenario.system.case import split_end
from hystfmu.scenario.system.system import System
from hystfmu.scenario.system.unit_graph import sizes, with_values
from hystfmu.studies.spec import LoopSpec, Study

RADIUS = 1 - 1e-6  # largest modulus of a pole that counts as stable: creep of 10 s has its pole at 1 - 1e-5


class LoopLimits:
    """Limits of the linearised loop in the objective of a study, computed for any variation."""

    def __init__(self, study: Study, spec: LoopSpec) -> None:
        self._spec = spec
        self._systems = {name: build(study.scenario_cases[name]) for name in {spec.case, *spec.corners}}

    def excess(self, settings: Mapping[str, Any]) -> dict[str, float]:
        """Return the excess of a variation over each limit. A limit is met if its excess is at most 0.

        The settings ``{"unit.parameter": value}`` have the form of `set` of a scenario.
        """
        spec = self._spec
        nominal = self._opened(spec.case, settings)
        found = {"Ms_db": math.inf}
        with suppress(InputError):  # without an inverse the case runs to have slopes, which one that diverges has not
            peak = nominal.margins(delay=spec.delay)
            found = {"Ms_db": peak.Ms_db - spec.Ms_db if peak.stable else math.inf}
        corners = [self._opened(name, settings) for name in spec.corners]
        lo, hi = spec.slopes
        slopes = np.linspace(lo, hi, SLOPES)
        radii = [_radius(c, float(s), d) for c in corners for s in slopes for d in spec.delays]
        return found | {"radius": max(radii, default=0.0) - RADIUS}

    def _opened(self, case: str, settings: Mapping[str, Any]) -> OpenedLoop:
        lo, hi = self._spec.slopes
        return open_loop(_changed(self._systems[case], settings), (lo, hi))


def loop_metrics(system: System, settings: Mapping[str, Any]) -> dict[str, float]:
    """Return the margins of the loop of a case with other settings. The loop is opened at the input of the plant.

    ``Ms_db`` is the peak of the sensitivity for the nominal slope (dB); it is infinite for an unstable loop. ``radius``
    is the largest modulus of a pole for the slopes along the path of the case.
    """
    fine = {k: float(settings[k]) % 1 for k in sizes(system.case) & settings.keys()}  # a loop is opened at one rate
    whole = {k: v - fine[k] if k in fine else v for k, v in settings.items()}
    opened = open_loop(build(replace(system.case, overrides={**system.case.overrides, **whole})))
    delay = sum(fine.values())
    found = opened.margins(delay=delay)
    slopes = np.linspace(*opened.slopes, SLOPES)
    radius = max(opened.radius(float(s), delay) for s in slopes)
    return {"Ms_db": found.Ms_db if found.stable else math.inf, "radius": radius}


def _radius(opened: OpenedLoop, slope: float, delay: float) -> float:
    """Return the largest modulus of a pole.

    For a loop with a memory of a period, the bound may exceed 1 although the loop is stable. Therefore the result is
    computed for the loop without this memory.
    """
    if opened.memories and opened.stable(slope, delay):
        opened = replace(opened, memories=())
    return opened.radius(slope, delay)


def _changed(system: System, settings: Mapping[str, Any]) -> System:
    parts = list(system.parts)
    for key, value in settings.items():
        unit, name = split_end(key, "parameters")
        parts = [replace(p, graph=with_values(p.graph, {name: value})) if p.name == unit else p for p in parts]
    return replace(system, parts=tuple(parts))
