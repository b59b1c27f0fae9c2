"""Small records of devices of many kinds: plays, rubber, battery, friction; by solvers of the tests."""

from collections.abc import Callable

import numpy as np
import plants
from foreign.solvers import lag, mode

Record = tuple[np.ndarray, np.ndarray, np.ndarray]


def reversals(n: int, seed: int, turns: int = 36) -> np.ndarray:
    """The whole range [-1, 1] once, then random levels above and below each other in turn, on straight lines."""
    rng = np.random.default_rng(seed)
    levels = [0.0, 1.0, -1.0]
    for k in range(turns):
        levels.append(rng.uniform(levels[-1], 1) if k % 2 == 0 else rng.uniform(-1, levels[-1]))
    return np.interp(np.linspace(0, len(levels) - 1, n), np.arange(len(levels)), levels)


def plays(x: np.ndarray) -> np.ndarray:
    """Half of x and a sum of plays."""
    return 0.5 * x + plants.plays(x, np.array([0.1, 0.25, 0.5])) @ [0.25, 0.2, 0.15]


def _noisy(y: np.ndarray, share: float, seed: int) -> np.ndarray:
    return y + share * np.ptp(y) * np.random.default_rng(seed).normal(size=len(y))


def _static(y_of: Callable[[np.ndarray], np.ndarray], n: int = 900, noise: float = 3e-4, h: float = 1e-3) -> Record:
    x = reversals(n, 3)
    return h * np.arange(n), 60 + 60 * x, _noisy(y_of(x), noise, 4)


def _elastomer() -> Record:
    """Force over the square of the voltage, rubber with two relaxations, mass: 45 Hz, damping .05."""
    n, h = 1500, 2e-3
    x = reversals(n, 5)
    force = (0.6 + 0.4 * x) ** 2
    y = 0.8 * mode(force, 45, 0.05, h) + 0.12 * lag(force, 0.1, h) + 0.08 * lag(force, 1.0, h)
    return h * np.arange(n), 3 + 2 * x, 0.4 * _noisy(y, 5e-4, 6)


def _creep_alone() -> Record:
    """All of the output comes late: no part answers at once."""
    n, h = 500, 0.1
    x = reversals(n, 7, 20)
    y = plays(x)
    return h * np.arange(n), 50 + 50 * x, 10 * _noisy(0.6 * lag(y, 0.3, h) + 0.4 * lag(y, 3.0, h), 3e-4, 8)


def _battery() -> Record:
    """Voltage over current: resistance and two relaxations of minutes, a row a second."""
    n = 500
    x = reversals(n, 9, 10)
    y = 3.7 + 0.05 * x + 0.02 * lag(x, 20, 1.0) + 0.03 * lag(x, 200, 1.0)
    return 1.0 * np.arange(n), 2 * x, _noisy(y, 3e-4, 10)


def _with_chirp(n: int, h: float) -> np.ndarray:
    """Reversals, then a chirp to 400 Hz in the same number of rows."""
    k = np.arange(n // 2)
    x = np.concatenate([reversals(n // 2, 11), 0.05 * np.sin(2 * np.pi * h * (5 * k + 395 * k**2 / n))])
    x[: n // 2] -= np.linspace(0, x[n // 2 - 1], n // 2)
    return np.clip(x, -1, 1)


def _stage(chirp: bool) -> Record:
    """Plays in front of 150 Hz, damping .03, at 4 kHz; with a chirp or without."""
    n, h = 4000, 2.5e-4
    x = _with_chirp(n, h) if chirp else reversals(n, 11)
    return h * np.arange(n), 60 + 60 * x, 20 * _noisy(mode(plays(x), 150, 0.03, h), 2e-4, 12)


def _bent_stage() -> Record:
    """Plays and their cube in front of 150 Hz, damping .3, at 2 kHz, with a chirp."""
    n, h = 1500, 5e-4
    x = _with_chirp(n, h)
    v = plays(x)
    return h * np.arange(n), 60 + 60 * x, 20 * _noisy(mode(v + 2 * v**3, 150, 0.3, h), 5e-4, 12)


def _decaying() -> Record:
    k = np.arange(600)
    x = np.exp(-0.004 * k) * np.sin(2 * np.pi * k / 75)
    return 1e-3 * k, 50 + 50 * x, 10 * _noisy(plays(x), 3e-4, 13)


RECORDS: dict[str, Callable[[], Record]] = {
    "static_plays": lambda: _static(plays), "falling_plays": lambda: _static(lambda x: -12 * plays(x)),
    "short": lambda: _static(plays, n=220), "bouc_wen": lambda: _static(plants.bouc_wen),
    "bent": lambda: _static(lambda x: np.tanh(plays(x)) * 30), "straight": lambda: _static(lambda x: 2 * x + 1),
    "noisy": lambda: _static(plays, noise=0.02), "butterfly": lambda: _static(lambda x: plays(x) ** 2),
    "creep_alone": _creep_alone, "elastomer": _elastomer, "battery": _battery, "decaying_sine": _decaying,
    "stage_reversals": lambda: _stage(False), "stage_chirp": lambda: _stage(True), "bent_stage": _bent_stage,
}  # fmt: skip
