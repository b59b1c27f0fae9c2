"""Feed-forward by the inverse of linear dynamics: exact in the periodic steady state, or approximate with preview.

The exact sampled inverse of a lightly damped stage excites the resonances of the stage. A periodic reference, however,
consists of a few tones below these resonances. For these tones the inverse is exact in the steady state. This inverse
includes the delay and the hold of the command.

With preview, the wanted output is known some steps ahead. If the plant has several modes, a filter W(s) compensates the
zeros between the modes, provided that this filter is stable. An FIR filter F(z) compensates the rest of the dynamics.
The weights of F minimise abs(1 - z^lead F(z) W(z) G(z)) over a grid of frequencies, with no error for a constant
output. The plant G includes the hold of the command and the delay. The delay may contain a fraction of a step.
"""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from hystfmu.base import Array, InputError
from hystfmu.design.linear import linearise
from hystfmu.design.plants import Plant
from hystfmu.graph import Graph, Node
from hystfmu.graph.recursion import discretised
from hystfmu.model import Model


def scan_harmonics(n: Array, turn: float) -> Array:
    """Return the Fourier amplitude of each harmonic n of the triangle of the block ``reference`` with amplitude 1.

    The harmonic n is sin(2 pi n f t), where f is the frequency of the triangle.

    The acceleration of a triangle consists of impulses. If the turning points of the triangle are rounded, the impulses
    become rectangles, whose spectrum is a sinc function. The straight parts of the triangle are then steeper.

    Parameters
    ----------
    n : array, shape (m,)
        Numbers of the harmonics, from 1 on. Even harmonics have the amplitude 0.
    turn : float
        Fraction of the period in which the triangle is rounded, as in the block ``reference``.
    """
    return np.asarray(8 / (np.pi * n) ** 2 * np.sin(np.pi * n / 2) * np.sinc(n * turn / 2) / (1 - turn / 2))


def scan_feedforward(
    dynamics: Graph | Model,
    frequency: float,
    h: float,
    *,
    turn: float = 0.1,
    phase: float = 0.0,
    delay: float = 0.0,
    highest: float = 1200.0,
) -> dict[str, Array]:
    """Return the tones of the command for which the output of linear dynamics is a scan (triangle) of amplitude 1.

    Parameters
    ----------
    dynamics : Graph or Model
        Continuous-time dynamics from the held command to the position.
    frequency : float
        Frequency of the scan (Hz).
    h : float
        Step (s) during which the command is constant.
    turn, phase : float
        Parameters of the block ``reference``; phase in rad.
    delay : float
        Delay of the command in front of the dynamics (steps).
    highest : float
        Largest frequency of a tone (Hz), below the Nyquist frequency and in the frequency range in which the dynamics
        are known.

    Returns
    -------
    dict
        ``f`` (Hz), ``a``, ``ph`` (rad), shape (m,): parameters of the block ``reference`` with shape multisine.

    Raises
    ------
    InputError
        There is no tone below `highest`, or `highest` is above the Nyquist frequency.
    """
    if not frequency <= highest < 0.5 / h:
        raise InputError(f"The highest tone must lie from {frequency:g} to {0.5 / h:g} Hz. Got {highest:g} instead.")
    A, B, C, D = linearise(dynamics)
    n = np.arange(1.0, int(highest / frequency) + 1, 2)
    f, s = n * frequency, 2j * np.pi * n * frequency
    G = np.array([(C @ np.linalg.solve(x * np.eye(len(A)) - A, B) + D)[0, 0] for x in s])
    # a hold over one step delays the command by half a step
    response = G * np.sinc(f * h) * np.exp(-s * h * (delay + 0.5))
    b = scan_harmonics(n, turn)
    return {"f": f, "a": np.abs(b / response), "ph": n * phase + np.angle(b / response)}


ACCURATE = 1e-3  # sufficient error abs(1 - F W G) up to half the first natural frequency
MOST_AHEAD = 10  # largest number of steps of preview beyond the delay
# number of frequencies up to half the first natural frequency; largest frequency over the sampling rate
GRID, TOP = 150, 0.45
AROUND = 0.3  # weight around the natural frequencies, where the plant is less accurate
# above this multiple of the last natural frequency, the output should be 0; weight of these frequencies
BEYOND, QUIET = 1.6, 1e-4
DAMPED = 1e-3  # smallest damping ratio of zeros that the filter compensates


@dataclass(frozen=True)
class Preview:
    """Feed-forward of a wanted output that is known `lead` steps ahead."""

    lead: int  # number of steps of preview
    taps: Array  # weights of the last n samples, shape (n,), newest sample first; the sum of the weights is 1
    zeros: Node | None  # filter in front of the weights
    error: float  # largest abs(1 - F W G) up to half the first natural frequency


def preview(plant: Plant, h: float) -> Preview:
    """Design the feed-forward with preview for a plant whose command is constant over each step h (s).

    The delay of the plant includes the computing time.
    """
    whole = int(np.floor(plant.delay / h + 1e-9)) + 1
    seen = [i for i, f in enumerate(plant.f_n) if f * h < TOP]
    if not seen:
        return Preview(whole, np.ones(1), None, 0.0)
    zeros = _zeros(plant, seen) if len(seen) > 1 else None
    if len(seen) > 1 and zeros is None:
        main = max(seen, key=lambda i: plant.share[i])
        plant = replace(plant, f_n=(plant.f_n[main],), zeta=(plant.zeta[main],), share=(1.0,))
        seen = [0]
    first, last = min(plant.f_n[i] for i in seen), max(plant.f_n[i] for i in seen)
    edge = min(0.5 * first, TOP / h)
    f = np.union1d(np.linspace(0, edge, GRID)[1:], np.linspace(edge, TOP / h, 2 * GRID))
    z = np.exp(2j * np.pi * f * h)
    G = plant.response(z, h)
    if zeros is not None:
        b, a = discretised(zeros, h).fraction()
        G = G * np.polyval(b, z) / np.polyval(a, z)
    inside, beyond = f <= edge, f > BEYOND * last
    weight = np.where(inside, 1.0, np.where(beyond, QUIET, AROUND))
    best: Preview | None = None
    for ahead in range(1, MOST_AHEAD + 1):
        lead, n = whole + ahead, 2 * ahead + 1
        columns = G[:, None] * z[:, None] ** (lead - np.arange(n))
        # the sum of all weights is 1, so a constant output has no error
        rows = weight[:, None] * (columns[:, 1:] - columns[:, :1])
        left = weight * (np.where(beyond, 0.0, 1.0) - columns[:, 0])
        parts = np.vstack([rows.real, rows.imag]), np.concatenate([left.real, left.imag])
        others = np.linalg.lstsq(*parts, rcond=None)[0]
        taps = np.concatenate([[1 - others.sum()], others])
        found = Preview(lead, taps, zeros, float(np.abs(1 - columns @ taps)[inside].max()))
        if best is None or found.error < best.error:
            best = found
        if best.error <= ACCURATE:
            break
    assert best is not None
    return best


def transfer_function(plant: Plant, name: str) -> Node:
    """Return a plant without its delay as a block `transfer_function` called `name`, which starts in the steady state.

    The static part of the plant (`Plant.rest`) would be direct feed-through. Therefore a mode that is much faster than
    the other modes replaces the static part.
    """
    f_n, zeta, share = list(plant.f_n), list(plant.zeta), list(plant.share)
    if abs(plant.rest) > 1e-9:
        f_n, zeta, share = [*f_n, FAST * max(f_n)], [*zeta, 0.7], [*share, plant.rest]
    dens = [_second_order(f, d) for f, d in zip(f_n, zeta, strict=True)]
    b = _over_common(share, dens)
    values: dict[str, Any] = {"b": b.tolist(), "a": _times(dens).tolist(), "hold": "zoh", "start": "steady"}
    return Node(name, "transfer_function", {"na": 2 * len(dens), "nb": len(b) - 1}, values)


FAST = 8.0  # natural frequency of the mode that replaces the static part, over the highest natural frequency


def _second_order(f: float, zeta: float) -> Array:
    w = 2 * np.pi * f
    return np.array([1 / w**2, 2 * zeta / w, 1.0])


def _times(polynomials: list[Array]) -> Array:
    found = np.ones(1)
    for p in polynomials:
        found = np.convolve(found, p)
    return found


def _over_common(share: list[float], dens: list[Array]) -> Array:
    """Return the numerator of the sum of share / den over the product of all denominators."""
    b = np.zeros(2 * len(dens) - 1)
    for i, k in enumerate(share):
        b = b + k * _times([d for j, d in enumerate(dens) if j != i])
    return b


def _zeros(plant: Plant, seen: list[int]) -> Node | None:
    """Return the filter that compensates all modes except the first, and the zeros between the modes.

    `seen` contains the indices of the modes. Return None if this filter is not stable.
    """
    total = sum(plant.share[i] for i in seen)
    order = sorted(seen, key=lambda i: plant.f_n[i])
    dens = [_second_order(plant.f_n[i], plant.zeta[i]) for i in order]
    b = _over_common([plant.share[i] / total for i in order], dens)
    roots = np.roots(b)
    if len(roots) < len(b) - 1 or any(-r.real < DAMPED * abs(r) for r in roots):
        return None
    top = _times(dens[1:])
    values: dict[str, Any] = {"b": top.tolist(), "a": b.tolist(), "hold": "foh", "start": "steady"}
    return Node("zeros", "transfer_function", {"na": len(b) - 1, "nb": len(top) - 1}, values)
