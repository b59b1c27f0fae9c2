"""Resonant devices drawn at random, simulated in C on a grid 20 times finer than the step of the loop."""

import ctypes as C
import functools
import subprocess
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from compiled import alone, objects
from scipy.linalg import expm

PLAYS, LAGS, MODES, LATE = 16, 4, 2, 256  # as in device.c
FINE = 20
SOURCE = Path(__file__).with_name("device.c")
FLAGS = ["-std=c99", "-O2", "-fPIC", "-Wall", "-Wextra", "-Werror", "-ffp-contract=off"]
RANGE = 0.2  # of half the range of the record, by which the amplifier goes beyond it


class Raw(C.Structure):
    """`device` of device.c."""

    _fields_ = (
        *((name, C.c_int64) for name in ("fine", "delay", "n_plays", "n_lags", "n_modes", "at")),
        *((name, C.c_double) for name in ("low", "high", "middle", "half", "w0", "q2", "q3", "gain", "offset")),
        *((name, C.c_double * PLAYS) for name in ("r", "w", "z")),
        *((name, C.c_double * LAGS) for name in ("share", "keep", "lag")),
        ("part", C.c_double * MODES),
        ("A", C.c_double * (4 * MODES)),
        ("B", C.c_double * (2 * MODES)),
        ("mode", C.c_double * (2 * MODES)),
        ("late", C.c_double * LATE),
    )


@functools.cache
def library() -> C.CDLL:
    """Compile once for all runs."""
    (made,) = objects([SOURCE], FLAGS)
    shared = made.with_suffix(".so")
    with alone(made.parent):
        if not shared.exists():
            part = shared.with_suffix(".part")
            subprocess.run(["cc", "-shared", str(made), "-o", str(part)], check=True, timeout=60)
            part.rename(shared)
    found = C.CDLL(str(shared))
    found.device_run.argtypes = [C.c_void_p, C.c_int64, C.c_void_p, C.c_void_p]
    found.device_run.restype = None
    found.device_step.argtypes = [C.c_void_p, C.c_double]
    found.device_step.restype = C.c_double
    found.device_rest.argtypes = [C.c_void_p, C.c_double]
    found.device_rest.restype = None
    found.device_output.argtypes = [C.c_void_p]
    found.device_output.restype = C.c_double
    return found


@dataclass(frozen=True)
class Device:
    """Parameters of a device; x is the command over half its range, in [-1, 1].

    Attributes
    ----------
    low, high : float
        Range of the command (V).
    w0 : float
        Share of the output that follows the command at once.
    r, w : tuple of float
        Thresholds (of x) and weights of plays.
    q2, q3 : float
        Bend v + q2 v^2 + q3 v^3.
    share, tau : tuple of float
        Creep: static gains and time constants (s) of lags.
    modes : tuple of (f, zeta, part)
        Frequency (Hz), damping and share of the gain.
    delay : float
        Steps of the loop between a command and the device.
    gain, offset : float
        Of the output (um).
    noise : float
        Standard deviation of the sensor's white noise, share of the span of the output.
    rate : float
        Samples a second (Hz).
    slow_rate : float
        The same for records without chirp.
    """

    low: float
    high: float
    w0: float
    r: tuple[float, ...]
    w: tuple[float, ...]
    q2: float
    q3: float
    share: tuple[float, ...]
    tau: tuple[float, ...]
    modes: tuple[tuple[float, float, float], ...]
    delay: float
    gain: float
    offset: float
    noise: float
    rate: float
    slow_rate: float

    @property
    def text(self) -> str:
        """One line for a table."""
        modes = ", ".join(f"{f:.0f} Hz zeta {z:.3f} ({100 * p:.0f} %)" for f, z, p in self.modes)
        percent = f"noise {100 * self.noise:.3f} %; creep {100 * sum(self.share):.1f} %"
        return f"{modes}; delay {self.delay:.2f} steps; {percent}"

    @property
    def slowest_decay(self) -> float:
        """Longest time constant of the modes (s)."""
        return max(1 / (2 * np.pi * f * z) for f, z, _ in self.modes)

    @property
    def noise_um(self) -> float:
        """Standard deviation of the noise (um)."""
        return self.noise * 2 * abs(self.gain)

    def command(self, x: np.ndarray) -> np.ndarray:
        """Command (V) of x in [-1, 1]."""
        return (self.low + self.high) / 2 + (self.high - self.low) / 2 * np.asarray(x)


class Simulated:
    """A device at rest under the command `u` (V), sampled every `h` seconds; `y` is its present output (um)."""

    def __init__(self, device: Device, h: float, u: float) -> None:
        d, fine = device, h / FINE
        self._lib = library()
        self._raw = Raw(fine=FINE, delay=round(FINE * d.delay), n_plays=len(d.r), n_lags=len(d.tau))
        raw = self._raw
        raw.n_modes = len(d.modes)
        raw.middle, raw.half = (d.low + d.high) / 2, (d.high - d.low) / 2
        raw.low, raw.high = d.low - RANGE * raw.half, d.high + RANGE * raw.half
        raw.w0, raw.q2, raw.q3, raw.gain, raw.offset = d.w0, d.q2, d.q3, d.gain, d.offset
        raw.r[: len(d.r)], raw.w[: len(d.w)] = d.r, d.w
        raw.share[: len(d.share)] = d.share
        raw.keep[: len(d.tau)] = np.exp(-fine / np.array(d.tau)).tolist()
        for i, (f, zeta, part) in enumerate(d.modes):
            A, B = _held(2 * np.pi * f, zeta, fine)
            raw.part[i] = part
            raw.A[4 * i : 4 * i + 4], raw.B[2 * i : 2 * i + 2] = A.ravel().tolist(), B.tolist()
        self._at = C.addressof(raw)
        self._lib.device_rest(self._at, u)
        self.y = float(self._lib.device_output(self._at))

    def run(self, u: np.ndarray) -> np.ndarray:
        """Sample the output (um), then hold the command (V), row by row."""
        u = np.ascontiguousarray(u, dtype=np.float64)
        y = np.empty(len(u))
        self._lib.device_run(self._at, len(u), u.ctypes.data, y.ctypes.data)
        return y

    def step(self, u: float) -> float:
        """Hold u (V) for a step of the loop; return the output (um) at its end."""
        self.y = self._lib.device_step(self._at, u)
        return self.y


def _held(w: float, zeta: float, h: float) -> tuple[np.ndarray, np.ndarray]:
    """Discretise w^2 / (s^2 + 2 zeta w s + w^2) exactly for a held input; the states are y and y' / w."""
    M = np.zeros((3, 3))
    M[0, 1], M[1] = w, [-w, -2 * zeta * w, w]
    P = expm(M * h)
    return P[:2, :2], P[:2, 2]


def draw(seed: int, index: int) -> Device:
    """Draw a device: plays, bend, creep, one or two modes, delay, noise."""
    rng = np.random.default_rng([seed, index])
    low = float(rng.choice([0.0, -10.0, -20.0, -100.0]))
    high = low + rng.uniform(80, 220)
    plays = rng.uniform(0.1, 0.4)  # share of the output that has memory
    w = rng.exponential(size=10)
    f = float(np.exp(rng.uniform(np.log(100), np.log(1500))))
    part = rng.uniform(0.02, 0.1) if rng.random() < 0.5 else 0.0
    modes = [(f, rng.uniform(0.01, 0.1), 1 - part)]
    if part:
        modes.append((f * rng.uniform(2, 4), rng.uniform(0.01, 0.03), part))
    tau = np.exp(np.linspace(np.log(0.05), np.log(5.0), 3)) * rng.uniform(0.7, 1.4)
    share = rng.dirichlet(np.ones(3)) * rng.uniform(0.01, 0.05)
    usual = f <= 10_000 / 8 and rng.random() < 0.5
    rate = 10_000.0 if usual else float(np.clip(f * np.exp(rng.uniform(np.log(8), np.log(40))), 1e3, 5e4))
    seldom = rng.random() < 0.25
    slow_rate = f * rng.uniform(0.5, 2) if seldom else rate
    return Device(
        low=low, high=high, w0=1 - plays, r=tuple(np.sort(rng.uniform(0.02, 0.8, size=10)).tolist()),
        w=tuple((plays * w / w.sum()).tolist()), q2=rng.uniform(-0.12, 0.12), q3=rng.uniform(-0.06, 0.06),
        share=tuple(share.tolist()), tau=tuple(tau.tolist()), modes=tuple(modes), delay=rng.uniform(0, 2),
        gain=float(np.exp(rng.uniform(np.log(3), np.log(100)))), offset=rng.uniform(-20, 50),
        noise=float(np.exp(rng.uniform(np.log(1e-4), np.log(5e-4)))), rate=_round(rate), slow_rate=_round(slow_rate),
    )  # fmt: skip


def _round(rate: float) -> float:
    """A rate whose step has few digits, as a file states it."""
    return 1 / float(f"{1 / rate:.3g}")
