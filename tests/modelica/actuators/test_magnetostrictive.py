"""The current-driven actuator: its example against the same equations solved elsewhere, and its energies."""

import numpy as np
import pytest
import simulate

STOP, STEP = 5e-3, 1e-6  # s, of the other solver: a tenth of the time constant of the current


def solved() -> dict[str, np.ndarray]:
    """Drive, rod and load by Runge-Kutta steps: rows of (current, e, free stroke, position)."""
    L, i_max, share, R, tau, k = 0.01, 4.0, 0.9, 2.0, 1e-4, 6e7
    r, w, w0, scale, width = np.linspace(0.05, 0.5, 10), np.full(10, 0.1), 0.3, 50e-6 / 1.025, 0.5e-3
    d = 50e-6 / (share * L * i_max)

    def rates(t: float, x: np.ndarray) -> tuple[np.ndarray, tuple[float, float, float, float]]:
        z, flux, e, s, v, plays = x[0], x[1], x[2], x[3], x[4], x[5:]
        free = scale * (w0 * e / i_max + w @ plays)
        i = (flux - free / d) / ((1 - share) * L)
        command = 0.9 * np.exp(-20 * t) * np.sin(2 * np.pi * 50 * t)
        pins = np.clip(100 * (4 * command - i) + z, -100, 100)
        F = k * (s - free)
        de = (i + d * F - e) / tau
        u, du = e / i_max, de / i_max
        dplays = max(du, 0) * np.clip(1 + (u - plays - r) / width, 0, 1)
        dplays += min(du, 0) * np.clip(1 + (plays - u - r) / width, 0, 1)
        moved = (-F - 200 * v - 300 * v - 2e6 * s) / 0.2
        return np.concatenate([[(pins - z) / 1e-3, pins - R * i, de, v, moved], dplays]), (i, e, free, s)

    x, rows = np.zeros(15), []
    for n in range(round(STOP / STEP) + 1):
        t = n * STEP
        a, shown = rates(t, x)
        rows.append(shown)
        b = rates(t + STEP / 2, x + STEP / 2 * a)[0]
        c = rates(t + STEP / 2, x + STEP / 2 * b)[0]
        x = x + STEP / 6 * (a + 2 * b + 2 * c + rates(t + STEP, x + STEP * c)[0])
    return dict(zip(("rod.pin_p.i", "rod.e", "rod.hysteresis.y", "load.s"), np.array(rows).T, strict=True))


@pytest.mark.turn("actuators in Modelica")
def test_rod_agrees_with_its_equations_solved_elsewhere() -> None:
    now = simulate.run("HystFMU.Examples.MagnetostrictiveRod").instants()
    rows = now["time"] <= STOP + 1e-9
    at = np.rint(now["time"][rows] / STEP).astype(int)
    for name, own in solved().items():
        assert np.ptp(own[at]) > 0.5 * np.ptp(now[name][rows])
        assert np.abs(now[name][rows] - own[at]).max() < 1e-5 * np.abs(own).max(), name


@pytest.mark.stress
def test_rod_takes_the_energy_that_it_stores_and_loses() -> None:
    now = simulate.run("HystFMU.Examples.MagnetostrictiveRod").instants()
    assert np.ptp(now["rod.residual"]) < 1e-9 * now["rod.supplied"].max()
    assert now["rod.dissipated"][-1] > 0.1


@pytest.mark.stress
def test_field_lags_behind_the_current_by_the_eddy_currents() -> None:
    """A rod of no hysteresis, free: e is the current through a lag of tau."""
    slot = "HystFMU.Actuators.Hysteresis.PrandtlIshlinskii hysteresis(n = 1, w0 = 1, r = {1}, w = {0}, gain = 0.25)"
    text = f"""model Lag
  HystFMU.Sources.Sine command(frequency = 200);
  HystFMU.Actuators.CurrentDrive drive(gain = 1);
  HystFMU.Actuators.MagnetostrictiveRod rod(tau = 5e-4, m = 1e-3, k = 1e9, redeclare {slot});
  HystFMU.Plants.Ground ground;
  HystFMU.Plants.Fixed fixed;
equation
  connect(command.r, drive.u);
  connect(drive.pin_p, rod.pin_p);
  connect(drive.pin_n, rod.pin_n);
  connect(drive.pin_n, ground.pin);
  connect(fixed.flange, rod.flange_a);
end Lag;
"""
    found = simulate.solve_text(text, 0.03, 1e-5, 1e-9).values
    t, i, e = (found[k] for k in ("time", "rod.pin_p.i", "rod.e"))
    late = t >= 0.02
    carrier = np.exp(-2j * np.pi * 200 * t[late])
    ratio = np.mean(e[late] * carrier) / np.mean(i[late] * carrier)
    assert abs(ratio * (1 + 2j * np.pi * 200 * 5e-4) - 1) < 5e-3
