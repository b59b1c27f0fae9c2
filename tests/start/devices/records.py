"""Records of a device: the same device at rest, driven by what a laboratory would play, sampled with noise."""

from pathlib import Path

import numpy as np
from start.devices.device import Device, Simulated

KINDS = ("decaying_sine", "staircase", "reversals", "chirp")
SECONDS, MOST_ROWS = 4.0, 20_000
CHIRP = 0.05  # amplitude, of half the range


def rate_of(device: Device, kind: str) -> float:
    """Samples a second of a record (Hz); only a chirp needs twice the first mode."""
    return device.rate if kind == "chirp" else device.slow_rate


def record(device: Device, kind: str, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return t (s), u (V) and y (um) of a record."""
    rate = rate_of(device, kind)
    n = min(round(SECONDS * rate), MOST_ROWS)
    x = {"decaying_sine": _decaying, "staircase": _staircase, "reversals": _reversals, "chirp": _chirp}[kind](
        n, rate, device, rng
    )
    u = device.command(np.clip(x, -1, 1))
    y = Simulated(device, 1 / rate, float(u[0])).run(u)
    return np.arange(n) / rate, u, y + device.noise_um * rng.normal(size=n)


def write(path: Path, t: np.ndarray, u: np.ndarray, y: np.ndarray) -> None:
    """Write a record as CSV."""
    rows = "".join(f"{a:.9g},{b:.7g},{c:.9g}\n" for a, b, c in zip(t.tolist(), u.tolist(), y.tolist(), strict=True))
    path.write_text("t [s],u [V],y [um]\n" + rows)


def _decaying(n: int, rate: float, device: Device, rng: np.random.Generator) -> np.ndarray:
    k = np.arange(n) / n
    return np.exp(-rng.uniform(2, 3.5) * k) * np.sin(2 * np.pi * int(rng.integers(6, 15)) * k)


def _staircase(n: int, rate: float, device: Device, rng: np.random.Generator) -> np.ndarray:
    """Levels up and down, at each of them two minor loops; by jumps or by ramps."""
    levels = np.linspace(-1, 1, int(rng.integers(5, 9)))
    size = rng.uniform(0.1, 0.3)
    targets = [-1.0]
    for sign, stairs in ((-1, levels), (1, levels[::-1])):
        for v in stairs:
            targets += [v, v + sign * size, v, v + sign * size / 2, v]
    jumps = rng.random() < 0.3
    return _through(n, np.array(targets), 0.0 if jumps else float(rng.uniform(0.2, 0.8)))


def _reversals(n: int, rate: float, device: Device, rng: np.random.Generator) -> np.ndarray:
    """The whole range once, then random levels above and below each other in turn, by ramps of about one speed."""
    targets = [0.0, 1.0, -1.0]
    for k in range(int(rng.integers(40, 70))):
        targets.append(rng.uniform(targets[-1], 1) if k % 2 == 0 else rng.uniform(-1, targets[-1]))
    targets.append(0.0)
    at = np.array(targets)
    lengths = np.cumsum([0, *(np.abs(np.diff(at)) + 0.1)])
    return np.interp(np.linspace(0, lengths[-1], n), lengths, at)


def _chirp(n: int, rate: float, device: Device, rng: np.random.Generator) -> np.ndarray:
    """Reversals, then a chirp beyond twice the first mode from the memory that they leave."""
    rows = min(round(rate), round(0.4 * n))
    k = np.arange(rows)
    f, first = device.modes[0][0], 3 * rate / rows
    last = min(rng.uniform(2.0, 3.0) * f, 0.45 * rate)
    turns = first * k / rate + (last - first) * k**2 / (2 * rate * rows)
    return np.concatenate([_reversals(n - rows, rate, device, rng), CHIRP * np.sin(2 * np.pi * turns)])


def _through(n: int, targets: np.ndarray, ramp: float) -> np.ndarray:
    """Through levels of equal time, of which `ramp` is the way to the next one."""
    place = np.linspace(0, len(targets) - 1, n, endpoint=False)
    k = place.astype(int)
    way = np.clip((place - k) / ramp, 0, 1) if ramp else np.ones(n)
    return targets[k] + way * (targets[k + 1] - targets[k])
