"""A stage of 700 Hz, damping 0.02, one step of delay at 10 kHz: a fast scan and a slow sine on the device itself."""

from __future__ import annotations

import secrets
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from start.devices import records
from start.devices.device import draw
from start.devices.judge import start
from start.devices.loop import Controller, case_of, cases_of

WANTED = {"triangle": (100.0, 0.25), "sine": (10.0, 0.1)}  # frequency (Hz) and percent RMS of the stroke
PERIODS = 50  # until the error of a triangle counts


@pytest.mark.stress
def test_a_light_stage_is_scanned_by_start_alone_and_by_a_repetitive_part(tmp_path: Path) -> None:
    seed = secrets.randbelow(1 << 31)
    modes = ((700.0, 0.02, 1.0),)
    device = replace(draw(seed, 0), modes=modes, delay=1.0, rate=1e4, slow_rate=1e4, noise=1e-4)
    rng = np.random.default_rng(seed)
    t, u, y = records.record(device, "chirp", rng)
    records.write(tmp_path / "record.csv", t, u, y)
    asked = [w for shape, (f, _) in WANTED.items() for w in ("--reference", f"{shape}:{f:g}")]
    told = start(tmp_path / "record.csv", tmp_path / "made", *asked)
    assert told["approved"], (seed, told["reasons"])
    assert told["feedback"] == "full", (seed, device.text)
    cases = cases_of(tmp_path / "made" / "loop")
    for shape, (frequency, most) in WANTED.items():
        (wanted,) = (r for r in told["references"] if r["shape"] == shape)
        case = case_of(cases, wanted)
        assert case is not None
        run = Controller(case).drive(device, float(u[0]), rng)
        first = round((PERIODS if shape == "triangle" else 1) / (frequency * case.step))
        assert len(run.r) > first + 1 / (frequency * case.step)
        speed = np.abs(np.diff(run.r[first:]))
        line = speed > 0.99 * speed.max() if shape == "triangle" else speed >= 0  # without the turn-arounds
        assert line.mean() > 0.8
        e = (run.y - run.r)[first:-1][line]
        assert 100 * np.sqrt(np.mean(e**2)) / (2 * wanted["amplitude"]) <= most, (seed, shape, device.text)
    command = ["design", "repetitive", str(tmp_path / "made" / "loop"), "-o", str(tmp_path / "learns"), "--json"]
    done = subprocess.run([sys.executable, "-m", "hystfmu.cli", *command], capture_output=True, text=True)
    assert done.returncode == 0, (seed, device.text, done.stdout, done.stderr)
