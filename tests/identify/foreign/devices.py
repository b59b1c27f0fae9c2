"""Devices of the literature with random parameters: y of rows of u in [-1, 1], from rest at 0."""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from plants import plays

from foreign.solvers import FINER, along, filtered, fine, in_time, lag, late, mode, relays

Run = Callable[[np.ndarray, np.ndarray], np.ndarray]


@dataclass(frozen=True)
class Device:
    """One device.

    Attributes
    ----------
    h : float
        Time between rows (s).
    band : (float, float)
        Frequencies that its records excite (Hz).
    run : function
        Output (n,) of the input (n,) and of covariates (n, m) in [-1, 1].
    covariates : tuple of str
        Names of covariates.
    """

    h: float
    band: tuple[float, float]
    run: Run
    covariates: tuple[str, ...] = ()


def alone(h: float, band: tuple[float, float], of: Callable[[np.ndarray], np.ndarray], finer: bool = True) -> Device:
    """Device of the input alone, whose solver runs on the fine grid."""
    return Device(h, band, lambda u, beside: of(fine(u))[::FINER] if finer else of(u))


def coleman_hodgdon(rng):
    """Piezo of Coleman & Hodgdon 1987, y' = a |u'| (b u - y) + c u', behind a mode of 250 Hz and two rows of delay."""
    h, zeta, a, b, c = 2e-4, rng.uniform(0.03, 0.1), rng.uniform(1.0, 3.0), rng.uniform(0.9, 1.2), rng.uniform(0.4, 0.7)

    def run(u, beside):
        z = along(fine(u), lambda z, u, s: a * s * (b * u - z) + c)
        return late(mode(z, 250.0, zeta, h / FINER)[::FINER], 2.0)

    return Device(h, (2.0, 60.0), run)


def battery(rng):
    """Open-circuit voltage beside one state of Plett 2004, h' = g |u'| (sgn u' - h); u is the state of charge."""
    g, M, k, c = rng.uniform(2.0, 6.0), rng.uniform(0.05, 0.15), rng.uniform(2.0, 4.0), rng.uniform(0.1, 0.3)
    return alone(
        1.0,
        (5e-4, 1e-2),
        lambda u: np.tanh(k * u) / k + c * u**3 + 0.3 * u + M * along(u, lambda z, u, s: g * (1 - s * z)),
    )


def jiles_atherton(rng):
    """Anhysteretic Langevin curve and pinning (Jiles & Atherton 1986), behind a first-order lag of eddy currents."""
    a, k, c, T = rng.uniform(0.12, 0.25), rng.uniform(0.1, 0.25), rng.uniform(0.1, 0.3), rng.uniform(1e-3, 3e-3)
    alpha = rng.uniform(0.05, 0.15)

    def slope(m, u, s):
        x = (u + alpha * m) / a
        small = abs(x) < 1e-3
        curve = x / 3 if small else 1 / math.tanh(x) - 1 / x
        rise = (1 / 3 if small else 1 / x**2 - 1 / math.sinh(x) ** 2) / a
        gap = curve - m
        pinned = gap / (s * k * (1 - c) - alpha * gap) if gap * s > 0 else 0.0
        return ((1 - c) * pinned + c * rise) / (1 - alpha * c * rise)

    return alone(5e-4, (1.0, 50.0), lambda u: lag(along(u, slope), T, 5e-4 / FINER))


def slip_stage(rng):
    """Stage of 35 Hz with Maxwell slip of its own displacement: x'' = w^2 (u - x - sum k_i stop_i[x]) - 2 zeta w x'."""
    w, zeta = 2 * np.pi * 35.0, rng.uniform(0.05, 0.15)
    r, k = rng.uniform(0.02, 0.3, 4).tolist(), rng.uniform(0.1, 0.3, 4).tolist()

    def run(u):
        # stops are kept beside the states; semi-implicit steps, because stops have corners
        h, x, v, slid, out = 1e-3 / FINER, 0.0, 0.0, [0.0] * 4, np.empty(len(u))
        for i, value in enumerate(u.tolist()):
            slid = [min(max(z, x - a), x + a) for z, a in zip(slid, r, strict=True)]
            force = value - x - sum(b * (x - z) for b, z in zip(k, slid, strict=True))
            v = (v + h * w * w * force) / (1 + 2 * zeta * w * h)
            x += h * v
            out[i] = x
        return out

    return alone(1e-3, (0.3, 15.0), run)


def lugre(rng):
    """Friction force of Canudas de Wit et al. 1995 over a displacement; bristles break at a Stribeck force."""
    stiff, damp, viscous = rng.uniform(20.0, 60.0), rng.uniform(0.02, 0.1), rng.uniform(0.005, 0.02)
    coulomb, static, v_s = 1.0, rng.uniform(1.1, 1.5), rng.uniform(0.3, 1.0)

    def run(u):
        h, z, out = 1e-3 / FINER, 0.0, np.empty(len(u))
        for i, v in enumerate((np.diff(u, prepend=u[0]) / h).tolist()):
            level = (coulomb + (static - coulomb) * math.exp(-((v / v_s) ** 2))) / stiff
            moved = (z + h * v) / (1 + h * abs(v) / level)  # implicit in z: stiff where the speed is large
            out[i] = stiff * moved + damp * (moved - z) / h + viscous * v
            z = moved
        return out

    return alone(1e-3, (0.3, 10.0), run)


def butterfly(rng):
    """Strain of a ferroelectric: square of a polarisation with a Gaussian Preisach density, and a linear term."""
    centre, width, spread, linear = rng.uniform(0.3, 0.5), rng.uniform(0.1, 0.2), rng.uniform(0.1, 0.25), 0.1

    def run(u):
        p = relays(
            u, lambda a, b: np.exp(-((((a - b) / 2 - centre) / width) ** 2) / 2 - ((a + b) / 2 / spread) ** 2 / 2)
        )
        return p**2 + linear * p * u

    return alone(1e-2, (0.02, 1.0), run, finer=False)


def ipmc(rng):
    """Bending of an ionic polymer: plays, a fast lag, and back-relaxation by a slow one."""
    r, w = np.sort(rng.uniform(0.05, 0.6, 10)), rng.uniform(0.3, 1.7, 10)
    fast, slow, share = rng.uniform(0.02, 0.06), rng.uniform(1.0, 3.0), rng.uniform(0.4, 0.8)

    def run(u, beside):
        v = fine((2 * u + plays(u, r) @ w) / 10)
        h = 1e-2 / FINER
        return (lag(v, fast, h) - share * lag(v, slow, h))[::FINER]

    return Device(1e-2, (0.02, 2.0), run)


def mr_damper(rng):
    """Magnetorheological damper of Spencer et al. 1997 at a fixed current; u is the displacement of the piston."""
    c0, c1, k0, k1 = rng.uniform(0.05, 0.15), rng.uniform(1.0, 3.0), rng.uniform(0.05, 0.3), rng.uniform(0.02, 0.1)
    alpha, A, beta, n = rng.uniform(0.5, 1.5), rng.uniform(10.0, 30.0), rng.uniform(6.0, 12.0), 2.0

    def rate(z, y, u, v):
        moved = (alpha * z + c0 * v + k0 * (u - y)) / (c0 + c1)
        d = v - moved
        return A * d - beta * (abs(d) * z + d * abs(z)) * abs(z) ** (n - 1), moved

    def run(u):
        h = 2e-3 / FINER
        z, y = in_time(u, h, rate).T
        v = np.diff(u, append=2 * u[-1] - u[-2]) / h
        return c1 * (alpha * z + c0 * v + k0 * (u - y)) / (c0 + c1) + k1 * u

    return alone(2e-3, (0.2, 5.0), run)


def memory_alloy(rng):
    """Martensite of a shape-memory alloy over temperature: Duhem with saturating branches (Likhachev & Koval 1992)."""
    up, down = rng.uniform(0.1, 0.4), rng.uniform(-0.4, -0.1)
    width, elastic = rng.uniform(0.15, 0.3), rng.uniform(0.1, 0.3)

    def slope(z, u, s):
        centre = up if s > 0 else down
        rise = math.exp(-(((u - centre) / width) ** 2) / 2) / (width * math.sqrt(2 * math.pi)) * 3
        return rise * (1 - z) if s > 0 else rise * z

    return alone(0.1, (2e-3, 5e-2), lambda u: along(u, slope, 0.5) + elastic * u)


def bouc_wen_g0(rng):
    """Bouc-Wen operator and a linear term behind dynamics: one of the two plants of the specification."""
    beta, share, n, a = rng.uniform(0.7, 1.5), rng.uniform(0.3, 0.8), rng.uniform(1.1, 2.0), rng.uniform(0.3, 0.6)
    f, zeta, rows = rng.uniform(120.0, 300.0), rng.uniform(0.1, 0.8), rng.uniform(0.0, 3.0)

    def run(u, beside):
        u = fine(u)
        z = along(u, lambda z, u, s: 1 - beta * (math.copysign(1 - share, z * s) + share) * abs(z) ** n)
        return late(mode(a * u + z, f, zeta, 3e-4 / FINER)[::FINER], rows)

    return Device(3e-4, (1.0, 120.0), run)


def two_modes(rng):
    """Plays behind two modes and a delay."""
    r, w = np.sort(rng.uniform(0.05, 0.6, 10)), rng.uniform(0.3, 1.7, 10)
    f, zeta, share = rng.uniform(100.0, 200.0), rng.uniform(0.02, 0.1), rng.uniform(0.05, 0.2)

    def run(u, beside):
        v = fine((3 * u + plays(u, r) @ w) / 10)
        h = 3e-4 / FINER
        y = (1 - share) * mode(v, f, zeta, h) + share * mode(v, 2.7 * f, zeta, h)
        return late(y[::FINER], 1.3)

    return Device(3e-4, (1.0, 120.0), run)


def elastomer(rng):
    """Dielectric elastomer: viscoelastic answer to the square of the voltage."""
    T, share, bias = (0.05, 0.4, 3.0), rng.uniform(0.05, 0.2, 3), rng.uniform(0.3, 0.8)

    def run(u):
        v = (1 + bias * u) ** 2 / 4
        return v + sum(k * filtered(v, [1.0], [t, 1.0], 1e-2 / FINER) for k, t in zip(share, T, strict=True))

    return alone(1e-2, (0.03, 3.0), run)


def warm_stack(rng):
    """Bent plays whose gain follows the temperature and whose offset follows the load."""
    r, w = np.sort(rng.uniform(0.05, 0.6, 10)), rng.uniform(0.3, 1.7, 10)
    bend, warm, load = rng.uniform(0.05, 0.2), rng.uniform(0.1, 0.3), rng.uniform(0.05, 0.15)

    def run(u, beside):
        v = (3 * u + plays(u, r) @ w) / 10
        return (1 + warm * beside[:, 0]) * (v + bend * v**2) + load * beside[:, 1]

    return Device(1e-3, (0.2, 5.0), run, ("T", "load"))


DEVICES = {
    "Coleman-Hodgdon piezo, mode, delay": coleman_hodgdon, "battery, one state": battery,
    "Jiles-Atherton, eddy lag": jiles_atherton, "slip stage": slip_stage, "LuGre": lugre,
    "ferroelectric butterfly": butterfly, "IPMC, back-relaxation": ipmc, "Spencer's MR damper": mr_damper,
    "shape-memory alloy": memory_alloy, "Bouc-Wen + G0": bouc_wen_g0, "plays + two modes": two_modes,
    "dielectric elastomer": elastomer, "stack, temperature and load": warm_stack,
}  # fmt: skip


def draw(name: str, seed: int) -> Device:
    """Device of a class with parameters from a seed."""
    return DEVICES[name](np.random.default_rng([seed, list(DEVICES).index(name)]))
