"""What `hystfmu start` says of a record, and what its loop does on the device that the record is of."""

import json
import resource
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
from start.devices import records
from start.devices.device import Device, draw
from start.devices.loop import Controller, Run, case_of, cases_of, counts_after, without_feedback

WORSE = 3.0  # times the error without feedback: sustained oscillation, where it does not come from the noise
NOISES = 5.0  # standard deviations of the sensor's noise: RMS at a constant reference, of a loop that oscillates
LEAST = 0.1  # percent of the span of the reference, for both
DECAYS, SHORTEST = 8.0, 2000  # time constants of the modes, and steps, until the rest counts as oscillation
WINDOW = 2000  # steps
DRIFT = 3  # degree of the polynomial of what a slow integrator and creep still do in the window
LONGEST = 900  # s, of `hystfmu start`


def figures(seed: int, index: int, kind: str, folder: Path) -> dict[str, Any]:
    """Record a drawn device, start from the record, run the loop on the device; return what a table needs."""
    device = draw(seed, index)
    rng = np.random.default_rng([seed, index, records.KINDS.index(kind)])
    t, u, y = records.record(device, kind, rng)
    folder.mkdir(parents=True, exist_ok=True)
    records.write(folder / "record.csv", t, u, y)
    said = start(folder / "record.csv", folder / "made")
    found = {"device": device.text, "rate": records.rate_of(device, kind), "rows": len(t), **said}
    if (folder / "made" / "loop" / "scenario.toml").exists():
        found |= on_device(folder / "made" / "loop", said["references"], device, float(u[0]), rng)
    return found


def start(csv: Path, out: Path, *options: str) -> dict[str, Any]:
    """Run `hystfmu start`; return its verdict, from verdict.json."""
    before = _cpu()
    command = [sys.executable, "-m", "hystfmu.cli", "start", str(csv), "-o", str(out), "--json", *options]
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=LONGEST)
    except subprocess.TimeoutExpired:
        return _none(f"longer than {LONGEST} s", None, _cpu() - before)
    if done.returncode not in (0, 1):
        return _none((done.stderr.strip().splitlines() or ["nothing said"])[-1], done.returncode, _cpu() - before)
    told = json.loads(done.stdout)
    verdict = json.loads((out / "verdict.json").read_text())
    return {
        "approved": verdict["approved"],
        "feedback": verdict["feedback"],
        "reasons": verdict["reasons"],
        "controller": verdict.get("controller"),
        "references": verdict["references"],
        "status": done.returncode,
        "seconds": round(_cpu() - before, 1),
        "one_verdict": (done.returncode == 0) == verdict["approved"] == told["verdict"]["approved"],
    }


def _cpu() -> float:
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def _none(reason: str, status: int | None, seconds: float) -> dict[str, Any]:
    """No verdict at all."""
    return {
        "approved": False, "feedback": "none", "reasons": [reason], "controller": None, "references": [],
        "status": status, "seconds": round(seconds, 1), "one_verdict": False,
    }  # fmt: skip


def on_device(
    loop: Path, references: list[dict[str, Any]], device: Device, u0: float, rng: np.random.Generator
) -> dict[str, Any]:
    """Run every reference on the device.

    Returns
    -------
    dict
        `runs`: name, shape, error reached, error without feedback, error stated, bound (percent of the span of the
        reference), and share of the range by which commands leave that of the record; `unstable`: what was seen.
    """
    cases = cases_of(loop)
    runs, unstable = [], []
    for wanted in references:
        case = case_of(cases, wanted)
        if case is None:
            continue
        controller = Controller(case)
        hold = wanted["shape"] == "sine" and controller.can_hold
        settle = max(SHORTEST, round(DECAYS * device.slowest_decay / case.step))
        run = controller.drive(device, u0, rng, settle + WINDOW if hold else 0)
        span = 2 * wanted["amplitude"] if wanted.get("amplitude") else float(np.ptp(run.r))
        reached = _error(run, case, span)
        bare = without_feedback(cases, case)
        without = _error(Controller(bare).drive(device, u0, rng), bare, span) if bare else None
        runs.append(
            {
                **{key: wanted.get(key) for key in ("name", "shape", "frequency", "rms_percent", "bound_percent")},
                "device": reached,
                "without": without,
                "beyond": _beyond(run, device),
            }
        )
        unstable += _oscillations(run, wanted["name"], reached, without, span, device)
    return {"runs": runs, "unstable": unstable}


def _error(run: Run, case: Any, span: float) -> float | None:
    """RMS error in percent of the span of the reference, in the window of the case; None where it is not finite."""
    if not run.finite:
        return None
    e = (run.y - run.r)[round(counts_after(case) / case.step) : round(case.stop / case.step) + 1]
    return float(100 * np.sqrt(np.mean(e**2)) / span)


def _beyond(run: Run, device: Device) -> float:
    """Largest share of the range by which a command leaves that of the record."""
    u = run.u[np.isfinite(run.u)]
    return float(max(u.max() - device.high, device.low - u.min(), 0) / (device.high - device.low))


def _oscillations(
    run: Run, name: str, reached: float | None, without: float | None, span: float, device: Device
) -> list[str]:
    """Say where the loop is unstable or in a limit cycle."""
    if reached is None or not run.finite:
        return [f"{name}: not finite"]
    noise = 100 * device.noise_um / span
    found = []
    if without is not None and reached > max(WORSE * without, NOISES * noise, LEAST):
        found.append(f"{name}: {reached:.3g} % with feedback, {without:.3g} % without")
    if len(run.held):
        e = run.held[-WINDOW:]
        k = np.arange(len(e))
        rest = 100 * float(np.std(e - np.polyval(np.polyfit(k / WINDOW, e, DRIFT), k / WINDOW))) / span
        if rest > max(NOISES * noise, LEAST):
            found.append(f"{name}: {rest:.3g} % at a constant reference, noise {noise:.3g} %")
    return found
