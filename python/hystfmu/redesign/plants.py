"""The loops of a scenario without their controllers, as the plants for which structures of controllers are tuned."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from hystfmu.base.arrays import Array
from hystfmu.design.frequency import beside
from hystfmu.design.plants import Complex, Plant, PlantSet
from hystfmu.design.race import Aim
from hystfmu.design.structures import Design
from hystfmu.redesign.corners import Corner
from hystfmu.redesign.roles import Roles
from hystfmu.scenario.engine.native import Native
from hystfmu.scenario.loop_margins import OpenedLoop
from hystfmu.scenario.outcome.trace import Stopped
from hystfmu.scenario.system.system import System

LOWEST, POINTS = 1e-5, 200  # angles over pi: the first, and how many before those at resonances
TONES = 15  # of the references that count
MISSED = 0.01  # share of the reference that hysteresis model and inverse miss
PROBE = 1e-3  # angle over pi at which the delay shows in the phase
LAST = 2  # rows at least


@dataclass(frozen=True)
class LoopPlant(Plant):
    """Everything in a loop except its controller, with static gain 1.

    Attributes
    ----------
    opened : OpenedLoop
        With a controller of gain 1.
    more : float
        Steps of delay beyond that of the case.
    """

    opened: OpenedLoop | None = field(default=None, repr=False)
    more: float = 0.0

    def response(self, z: Complex, h: float) -> Complex:
        """Return the response at z on the unit circle, shape (m,), for slope 1 of plant over inverse."""
        assert self.opened is not None
        return self.opened.response_at(np.angle(z).ravel(), 1.0, self.more).reshape(np.shape(z))


def loop_plants(found: Sequence[Corner], slopes: tuple[float, float]) -> PlantSet:
    """Return corners as a set of plants, the nominal one first.

    Parameters
    ----------
    found : sequence of Corner
        Of loops with a controller of gain 1.
    slopes : (float, float)
        Sector, over the nominal slope.
    """
    one: dict[tuple[str, float], Corner] = {}
    for c in found:
        one.setdefault((c.name, c.delay), c)
    plants = []
    for (name, delay), c in one.items():
        told = f"{name}, {delay:g} further step{'s' * (delay != 1)} of delay" if delay else name
        plants.append(LoopPlant(name=told, opened=c.opened, more=delay))
    h = found[0].opened.h
    poles = np.concatenate([np.linalg.eigvals(p.opened.held(p.more)[0]) for p in plants if p.opened is not None])
    base = np.geomspace(LOWEST, 1.0, POINTS) * np.pi
    angles = np.tile(np.union1d(base, beside(poles, base)), (len(plants), 1))
    response = np.array([p.response(np.exp(1j * a), h) for p, a in zip(plants, angles, strict=True)])
    return PlantSet(h, tuple(plants), slopes, angles, response)


def known(opened: OpenedLoop) -> Design:
    """Return the design data of a structure: the modes of the plant, and the whole steps of delay around it.

    A pair of poles is a mode with its share of the static gain; a single real pole is part of the rest.
    """
    A, B, C, _ = opened.plant
    f_n, zeta, share = [], [], []
    if len(A):
        poles, V = np.linalg.eig(A)
        residues = (C @ V).ravel() * np.linalg.solve(V, B.astype(complex)).ravel()
        for p, c in zip(poles, residues, strict=True):
            if p.imag > 0:
                f_n.append(float(abs(p) / (2 * np.pi)))
                zeta.append(float(-p.real / abs(p)))
                share.append(float((2 * -c / p).real))
        order = np.argsort(f_n)
        f_n, zeta, share = ([v[i] for i in order] for v in (f_n, zeta, share))
    modes = Plant(tuple(f_n), tuple(zeta), tuple(share))
    angle = np.array([PROBE * np.pi])
    z = np.exp(1j * angle)
    turned = float(np.angle(opened.response_at(angle) / modes.response(z, opened.h))[0])
    late = max(round(-turned / float(angle[0])), 0)
    return Design(Plant(modes.f_n, modes.zeta, modes.share, late * opened.h), opened.h, computing=0)


def aim(system: System, of: Roles) -> Aim:
    """Return the disturbances of the loop of a case: tones of its reference, a share of them as model error, noise.

    Parameters
    ----------
    system : System
        With a controller with which it runs.
    of : Roles
    """
    h = system.case.step
    try:
        r = Native(system, [of.reference]).run()[of.reference][:: system.case.ripple]
    except Stopped:
        r = np.zeros(LAST)
    r = r[max(len(r) - _rows(system, of, h), 0) :]
    power = np.abs(np.fft.rfft(r - r.mean())) ** 2 * 2 / len(r) ** 2
    chosen = np.sort(np.argsort(power)[::-1][: min(TONES, len(power) - 1)])
    chosen = chosen[chosen > 0] if (chosen > 0).any() else np.array([1])
    sigma = [n.value("sigma")[0] for p in system.parts for n in getattr(p.graph, "nodes", ()) if n.type == "noise"]
    noise = float(np.sqrt(np.square(sigma).sum())) if sigma else 0.0
    return Aim(chosen / (len(r) * h), MISSED**2 * power[chosen], power[chosen], noise)


def _rows(system: System, of: Roles, h: float) -> int:
    """Return the rows of a whole number of periods of the reference, or of the run."""
    frequency = 0.0
    for p in system.parts:
        if p.name in of.sources:
            frequency = float(p.own.nodes[0].value("frequency")[0])
    rows = round(system.case.stop / h)
    whole = int(rows * h * frequency) / frequency if frequency and rows * h * frequency >= 1 else rows * h
    return max(round(whole / h), LAST)


def sector(opened: Mapping[str, OpenedLoop], stated: Sequence[float] | None, nominal: float) -> tuple[float, float]:
    """Return the sector of slopes over the nominal one: that of the margins, or those along the paths of the cases."""
    found = np.array(list(stated) if stated else [v for o in opened.values() for v in o.slopes]) / nominal
    return min(float(found.min()), 1.0), max(float(found.max()), 1.0)


def in_unit(values: Array | float, nominal: float) -> Array:
    """Return gains from an error to a command for a plant of this slope."""
    return np.asarray(values) / nominal
