"""A covariate that is a temperature: a port in K of the block, and the heat port of the actuator."""

from functools import cache
from pathlib import Path

import bench
import exported
import library
import numpy as np
import pytest
import simulate

import hystfmu as hy
from hystfmu.data.signals import training

ROOM, WARM = 20.0, 55.0  # degC


@cache
def model() -> hy.Model:
    """Plays whose gain and offset follow a temperature that wanders, in numpy."""
    h, rng = 1e-3, np.random.default_rng(2)
    u = 50 + 45 * training(40, 3, 0.05)
    n = len(u)
    T = np.interp(np.arange(n), np.linspace(0, n, 16), rng.uniform(15, 65, 16))
    x, warm = u / 50 - 1, (T - 40) / 25
    z = 0.4 * x + 0.1 * hy.synthetic.plays(x, np.linspace(0.05, 0.5, 6)).sum(axis=1)
    y = 20 * (1 + 0.2 * warm) * z + 3 * warm
    data = hy.Dataset(h * np.arange(n), u, y, unit_u="V", unit_y="um", covariates={"T [degC]": T})
    return hy.fit(data, "actuator", N=8, operator="plays", bend=1, dynamics="no", creep="no")


def simulated(package: Path, declared: str, joined: str) -> dict[str, np.ndarray]:
    text = f"model Bench\n{bench.FEED}{declared}equation\n{joined}end Bench;\n"
    return simulate.solve_text(text, 0.1, 1e-3, 1e-9, packages=(library.ROOT, package)).instants()


@pytest.mark.turn("exported actuators")
def test_a_temperature_is_a_port_in_kelvin(tmp_path: Path) -> None:
    """Joined to a constant of 293.15 K, the block gives what the model predicts at 20 degC."""
    package = model().export_modelica(tmp_path / "Piezo")
    assert exported.complaints(package) == []
    ports = (package / "Ports.mo").read_text()
    assert 'RealInput T(unit = "K", displayUnit = "degC")' in ports
    source = """  block Room "Sensor of the room"
    HystFMU.Interfaces.RealOutput T(unit = "K") = 293.15;
  end Room;
  Room room;
  HystFMU.Sources.Sine command(amplitude = 40, offset = 50, frequency = 10);
  Piezo.Model tested;
"""
    v = simulated(package, source, "  connect(room.T, tested.T);\n  connect(command.r, tested.u);\n")
    at = np.arange(0, len(v["time"]) - 1)
    u = v["tested.u"][at]
    expected = model().predict(np.column_stack([u, np.full(len(u), ROOM)])).reshape(len(u), -1)[:, 0] * 1e-6
    assert np.ptp(expected) > 1e-5
    assert np.abs(v["tested.y"][at] - expected).max() <= 1e-9 * np.ptp(expected)


@pytest.mark.stress
def test_an_actuator_follows_the_temperature_of_its_heat_port(tmp_path: Path) -> None:
    """Two of one model, one at 293.15 K without a port, one on a body of 328.15 K."""
    package = model().export_modelica(tmp_path / "Piezo")
    start = float((package / "Actuator.mo").read_text().partition("v_start = ")[2].partition(",")[0].rstrip(")"))
    parts = f"""  model Body "Surroundings"
    HystFMU.Interfaces.HeatPort port(T = {WARM + 273.15!r});
  end Body;
  Body body;
  HystFMU.Sources.Sine command(amplitude = 40, offset = {start!r}, frequency = 10);
  Feed feed(R = 150);
  Feed other(R = 150);
  HystFMU.Plants.Fixed wall;
  Piezo.Actuator room(tau = 1e-4);
  Piezo.Actuator warm(tau = 1e-4, useHeatPort = true);
"""
    joined = "  connect(body.port, warm.heatPort);\n"
    for feed, actuator in (("feed", "room"), ("other", "warm")):
        joined += f"  connect(command.r, {feed}.u);\n  connect({feed}.p, {actuator}.pin_p);\n"
        joined += f"  connect({feed}.n, {actuator}.pin_n);\n  connect(wall.flange, {actuator}.flange_a);\n"
    v = simulated(package, parts, joined)
    inner = slice(5, -2)
    for actuator, degrees in (("room", ROOM), ("warm", WARM)):
        u = v[f"{actuator}.v"]
        expected = model().predict(np.column_stack([u, np.full(len(u), degrees)])).reshape(len(u), -1)[:, 0] * 1e-6
        error = np.abs(v[f"{actuator}.flange_b.s"] - expected)[inner].max() / np.ptp(expected)
        print(f"{actuator}: {error:.1e} of the span of {np.ptp(expected):.2e} m")
        assert error <= 1e-2
    assert np.ptp(v["warm.flange_b.s"]) > 1.2 * np.ptp(v["room.flange_b.s"])
