"""The side of the plant in a loop, counted by hand: its units, how late they are, what they are at rest."""

import re
from typing import Any

import numpy as np
import pytest
from engines import ready
from scipy.signal import cont2discrete

from hystfmu.base.errors import InputError
from hystfmu.scenario.loop import opened, opening
from hystfmu.scenario.loop.opening import open_loop
from hystfmu.scenario.loop.plant import as_gain, dynamics, for_small_signals, has_memory, plant_side
from hystfmu.scenario.loop.table import _delayed
from hystfmu.scenario.report.loops import delay_table, loop_rows
from hystfmu.scenario.system.system import System

LAG = {"block": "transfer_function", "dims": {"na": 1, "nb": 0}, "values": {"b": [3.0], "a": [0.02, 1.5]}}
PLAY = {"block": "backlash_sum", "dims": {"n": 1}, "values": {"w0": 0.5, "r": [0.1], "w": [0.4]}}
LAW = {"block": "pid", "values": {"Kp": 0.2, "Ki": 9.0}, "inputs": {"u_ff": 0.0}}


def system(
    write: Any, order: str, units: dict[str, Any], wires: dict[str, str], ripple: int = 1, **more: Any
) -> System:
    reference = {"block": "reference", "values": {"shape": "sine", "frequency": 2.0}}
    data = {
        "name": "s", "step": 0.01, "stop": 1.0, "ripple": ripple, "order": order.split(),
        "units": {"reference": reference, "law": LAW} | units,
        "connections": {"law.y_d": "reference.r", "law.y": "lag.y"} | wires,
        "metrics": {"e": {"kind": "rms_percent", "signal": "lag.y", "against": "reference.r"}},
    }  # fmt: skip
    return ready(write(data | more))


FINE = {"fine": True}
CHAIN = {"play": PLAY | FINE, "lag": LAG | FINE}
WIRES = {"play.u": "law.u", "lag.u": "play.y"}


def side(s: System) -> tuple[list[str], float]:
    names = [p.name for p in s.parts]
    found = plant_side(s, names.index("lag"), [names.index(n) for n in names if n not in ("lag", "reference")])
    return [names[k] for k in found.units], found.delay


def test_units_that_are_not_in_series_are_refused(write: Any) -> None:
    two = {"play": {"block": "sum", "dims": {"n": 2}} | FINE, "lag": LAG | FINE}
    both = {"play.u_1": "law.u", "play.u_2": "law.u", "lag.u": "play.y"}
    with pytest.raises(InputError, match=r"^s/nominal: One connection must close the loop at play to have .* Got 2\.$"):
        side(system(write, "play lag reference law", two, both, 4))
    ring = {"play.u_1": "law.u", "play.u_2": "reference.r", "lag.u": "play.y"}
    assert side(system(write, "reference play lag law", two, ring, 4))[0] == ["play", "lag"]
    beside = CHAIN | {"sensor": PLAY | FINE}
    wires = WIRES | {"sensor.u": "lag.y", "law.y": "sensor.y"}
    with pytest.raises(InputError, match=r"^s/nominal: The units at the rate of the plant must be in series\. Got "):
        side(system(write, "play lag sensor reference law", beside, wires, 4))


@pytest.mark.parametrize(("within", "poles"), [(True, []), (False, [-1 / 0.3])])
def test_only_creep_in_the_ring_of_trials_is_undone(write: Any, within: bool, poles: list[float]) -> None:
    """A creep in the same unit that shapes the wanted output takes none from the plant."""
    creep = {"w0": 1.0, "w": 0.2, "T": 0.3, "start": "steady"}
    inverse = {
        "graph": {
            "blocks": [
                {"name": "lags", "type": "creep", "values": creep | {"w0": 0.0}},
                {"name": "root", "type": "implicit_inverse", "values": {"lo": -9.0, "hi": 9.0}},
                {"name": "all", "type": "sum", "dims": {"n": 2}},
            ],
            "wires": [
                ["all.y", "root.h"] if within else ["all.y", "root.y"],
                ["lags.y", "all.u[2]"],
                *([["root.u", "lags.u"], ["root.u", "all.u[1]"]] if within else [["root.u", "root.h"]]),
            ],
            "inputs": [{"name": "u", "to": ["root.y"] if within else ["lags.u", "all.u[1]"]}],
            "outputs": [{"name": "y", "source": "root.u"}],
        }
    }
    wires = {"inverse.u": "law.u", "lag.u": "inverse.y"}
    units = {"inverse": inverse, "lag": {"block": "creep", "values": creep} | FINE}
    s = system(write, "lag reference law inverse", units, wires, 4)
    found = plant_side(s, 0, [2, 3])
    assert np.linalg.eigvals(dynamics(s, found, [3])[0][0]) == pytest.approx(poles)


def test_what_has_memory_and_what_becomes_of_it(write: Any) -> None:
    level = {"block": "quantiser", "values": {"q": 0.1}}
    units = {"play": PLAY, "lag": LAG, "level": level}
    s = system(write, "play lag level reference law", units, WIRES | {"level.u": "lag.y", "law.y": "level.y"})
    assert [has_memory(p.own) for p in s.parts] == [True, False, False, False, False]
    assert as_gain(s.parts[0]).run(np.array([0.3, -2.0])).tolist() == [0.3, -2.0]
    assert for_small_signals(s.parts[2].own).run(np.array([0.123, 0.05])).tolist() == [0.123, 0.05]
    law = as_gain(s.parts[4])
    assert law.n_inputs == len(s.parts[4].inputs)
    wide = np.arange(2.0 * law.n_inputs).reshape(2, -1)
    assert law.run(wide).reshape(2, -1)[:, 0].tolist() == wide[:, 0].tolist()


@pytest.mark.parametrize(("change", "said"), [
    ({"coupling": {"scheme": "jacobi"}},
     "The coupling must be gauss_seidel, whose order the loop follows. Got jacobi instead."),
    ({"metrics": {"p": {"kind": "peak", "signal": "lag.y"}}},
     "A metric must compare an output with a reference. Got none."),
    ({"connections": {"law.y_d": "reference.r", "law.y": "reference.r", "play.u": "law.u", "lag.u": "play.y"}},
     "The case must have feedback. Got an open loop: lag does not act on itself."),
])  # fmt: skip
def test_a_loop_without_margins_says_why(write: Any, change: dict[str, Any], said: str) -> None:
    with pytest.raises(InputError, match=f"^s/nominal: {re.escape(said)}$"):
        open_loop(system(write, "play lag reference law", CHAIN, WIRES, 4, **change), (1.0, 1.0))


def test_controllers_of_several_rates_have_none(write: Any) -> None:
    units = CHAIN | {"slow": {"block": "scaling", "dims": {"n": 1}, "every": 2}}
    wires = {"play.u": "slow.y", "slow.u": "law.u", "lag.u": "play.y"}
    with pytest.raises(InputError, match=r"The controllers must have one rate to have margins\. Got several\.$"):
        open_loop(system(write, "play lag reference law slow", units, wires, 4), (1.0, 1.0))


def test_a_delay_runs_behind_the_unit_that_it_reads(write: Any) -> None:
    s = system(write, "play lag reference law", CHAIN, WIRES, 4)
    entry = plant_side(s, 1, [0, 3]).entry
    late = _delayed(s, entry, 3)
    assert [p.name for p in late.parts] == ["play", "lag", "reference", "law", "further_delay"]
    assert late.case.connections["play.u"] == "further_delay.y"
    assert late.case.connections["further_delay.u"] == "law.u"
    assert (late.parts[4].period, late.case.units["further_delay"].dims) == (1, {"n": 3})
    ahead = system(write, "reference law play lag", CHAIN, WIRES, 1)
    assert [p.name for p in _delayed(ahead, plant_side(ahead, 3, [1, 2]).links[0], 2).parts] == [
        "reference", "law", "play", "further_delay", "lag",
    ]  # fmt: skip


def peak_db(L: Any) -> float:
    return float(-20 * np.log10(np.abs(1 + L).min()))


def test_without_an_inverse_the_gain_of_the_plant_counts(write: Any) -> None:
    """P law around c times a lag, say in um/V: the loop has its gain Kp c, not Kp; a straight play has one slope."""
    Kp, c = np.exp(np.random.default_rng().uniform(0.1, 3, 2) * np.random.default_rng().choice([-1, 1], 2))
    law = LAW | {"values": {"Kp": Kp / c, "Ki": 0.0}}
    play = PLAY | FINE | {"values": {"w0": c / 2, "r": [0.1], "w": [0.0]}}
    s = system(write, "play lag reference law", {"law": law, "lag": LAG | FINE, "play": play}, WIRES, 4)
    p, z = np.exp(-0.01 * 1.5 / 0.02), np.exp(1j * np.linspace(1e-4, np.pi, 20000))
    pole = p - Kp * (1 - p)
    found = opening.loop_figures(s)
    assert found is not None
    assert found.stable == (abs(pole) < 1)
    if found.stable:
        assert found.Ms_db == pytest.approx(peak_db(Kp * (1 - p) / (z - p)), abs=0.01)
        assert open_loop(s).margins().Ms_db == pytest.approx(found.Ms_db, abs=1e-9)


def test_a_long_case_without_inverse_does_not_run_again(write: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    s = system(write, "play lag reference law", CHAIN, WIRES, 4)
    assert opening.loop_figures(s) is not None
    monkeypatch.setattr(opening, "MOST_STEPS", s.n_steps - 1)
    assert opening.loop_figures(s) is None


def test_numbers_at_the_ends_of_the_range_end(write: Any) -> None:
    """A plant that overflows in a step has no margins; a pole that rounding keeps below 1 adds noise without end."""
    wild = {"lag": LAG | FINE | {"values": {"b": [1.0], "a": [-1e-6, 1.0]}}}
    s = system(write, "play lag reference law", CHAIN | wild, WIRES, 4)
    assert opening.loop_figures(s) is None
    assert not np.isfinite(opened._covariance(np.eye(1), np.eye(1))).any()
    with pytest.raises(InputError, match=r"stop: must be a multiple of the step 4\.94066e-324 s; got 1$"):
        ready(
            write(
                {"name": "s", "step": 5e-324, "stop": 1.0, "order": ["law"], "units": {"law": LAW},
                 "metrics": {"p": {"kind": "peak", "signal": "law.u"}}}
            )
        )  # fmt: skip


def test_an_integrating_plant_has_margins(write: Any) -> None:
    """P law around k / s behind its own plays: L = Kp k h / (z - 1)."""
    Kp, k = np.random.default_rng().uniform(0.2, 1.2), 37.0
    law = LAW | {"values": {"Kp": Kp, "Ki": 0.0}}
    values = {"w0": 0.5, "r": [0.1], "w": [0.4]}
    play = {"block": "prandtl_ishlinskii", "dims": {"n": 1}, "values": values}
    inverse = {"block": "prandtl_ishlinskii_inverse", "dims": {"n": 1}, "values": values}
    integrator = {"block": "transfer_function", "dims": {"na": 1, "nb": 0}, "values": {"b": [k], "a": [1.0, 0.0]}}
    units = {"law": law, "play": play | FINE, "lag": integrator | FINE, "inverse": inverse}
    wires = {"inverse.y": "law.u", "play.u": "inverse.u", "lag.u": "play.y"}
    s = system(write, "play lag reference law inverse", units, wires, 4)
    z = np.exp(1j * np.linspace(1e-4, np.pi, 20000))
    found = opening.loop_figures(s)
    assert found is not None
    assert found.Ms_db == pytest.approx(peak_db(Kp * k * 0.01 / (z - 1)), abs=0.01)
    assert open_loop(s).slopes == pytest.approx((1.0, 1.0), abs=1e-9)


def test_a_mode_between_two_frequencies_of_the_grid_limits_the_delay(write: Any) -> None:
    """I law around a mode of damping 1e-5 to 1e-4: its peak of 1.5 crosses 1 within 1e-4 of its frequency."""
    rng = np.random.default_rng()
    zeta, w, h = 10 ** rng.uniform(-5, -4), rng.uniform(60, 120), 0.01
    a = [w**-2, 2 * zeta / w, 1.0]
    matrices = [[0, 1], [-(w**2), -2 * zeta * w]], [[0], [w**2]], [[1, 0]], [[0]]
    A, B, C, _, _ = cont2discrete([np.array(m, float) for m in matrices], h)
    near = w * h + zeta * w * h * np.linspace(-40, 40, 40001)
    z = np.exp(1j * np.append(np.geomspace(1e-4, 3, 4001), near))
    p, q = np.linalg.eig(A)
    G = ((C @ q)[0] * np.linalg.solve(q, B)[:, 0] / (z[:, None] - p)).sum(1)
    rest = 1 / (z - 1)
    ki = 1.5 / np.abs(G * rest)[4001:].max()  # of the mode: an integrator alone is higher at the lowest frequency
    for n in range(1, 12):  # a delay with which the mode is stable, though its gain is above 1
        L = ki * G * rest * z ** (1 - n)
        on = np.flatnonzero((np.abs(L[4001:-1]) > 1) != (np.abs(L[4002:]) > 1)) + 4001
        margin = np.mod(np.angle(L[on]) + np.pi, 2 * np.pi) / np.angle(z[on])
        law = LAW | {"values": {"Kp": 0.0, "Ki": float(ki / h)}}
        mode = {"block": "transfer_function", "dims": {"na": 2, "nb": 0}, "values": {"b": [1.0], "a": a}}
        late = {"late": {"block": "delay", "dims": {"n": n}}}
        units = {"law": law, "lag": mode | FINE, "play": PLAY | FINE | {"values": {"w0": 1.0, "w": [0.0]}}}
        wires = {"late.u": "law.u", "play.u": "late.y", "lag.u": "play.y"}
        s = system(write, "play lag reference law late", units | late, wires, 4)
        found = open_loop(s, (1.0, 1.0)).margins(1.0)
        assert len(on) == 2
        if found.stable and margin.min() > 0.1:  # at the border itself rounding decides
            assert found.delay_steps == pytest.approx(margin.min(), abs=0.02)
            break
    else:
        raise AssertionError("one of these delays is a stable one")


@pytest.mark.parametrize(("unit", "how", "said"), [
    ("lag", {"hold": "first"}, "The units of the loop must hold their inputs to have margins. Got lines at lag."),
    ("law", {"hold": "first"}, "The units of the loop must hold their inputs to have margins. Got lines at law."),
    ("lag", {"every": 3}, "The plant must step as often as its controllers to have margins. Got lag slower."),
])  # fmt: skip
def test_loops_whose_plant_is_not_held_are_refused(write: Any, unit: str, how: dict[str, Any], said: str) -> None:
    """An I law around this lag is unstable from a third of the gain on with lines, an eighth with every third step."""
    units = {"play": PLAY, "lag": LAG, "law": LAW}
    s = system(write, "play lag reference law", units | {unit: units[unit] | how}, WIRES)
    with pytest.raises(InputError, match=f"^s/nominal: {re.escape(said)}$"):
        open_loop(s, (1.0, 1.0))
    assert opening.loop_figures(s) is None


# ---- in rows -------------------------------------------------------------------------------------------------------
def test_a_loop_in_rows(write: Any) -> None:
    late = {"late": {"block": "delay", "dims": {"n": 6}} | FINE}
    wires = {"late.u": "law.u", "play.u": "late.y", "lag.u": "play.y"}
    s = system(write, "late play lag reference law", CHAIN | late, wires, 4, delay="a note")
    rows = [list(r) for r in loop_rows(s)]
    assert rows[0] == ["order (Gauss-Seidel)", "late - play - lag - reference - law"]
    assert rows[1] == ["step", "10 ms; late every 2.5 ms, play every 2.5 ms, lag every 2.5 ms"]
    assert ["delay", "late: 1.5 steps = 15 ms (delay block of 6 steps of the unit)"] in rows
    assert rows[-1] == ["note", "a note"]
    plain = system(write, "play lag reference law", {"play": PLAY, "lag": LAG}, WIRES)
    assert list(loop_rows(plain)[1]) == ["step", "10 ms"]
    table = delay_table(plain)
    assert tuple(table.head) == ("delay in steps", "Gauss-Seidel", "Jacobi", "iterative")
    assert {r[0]: list(r[1:]) for r in table.rows} == {
        "law.u -> play.u": [1.0, 1.0, 0.0], "play.y -> lag.u": [0.0, 0.5, 0.0],
        "reference.r -> law.y_d": [0.0, 1.0, 0.0], "lag.y -> law.y": [0.0, 1.0, 0.0],
    }  # fmt: skip


@pytest.mark.parametrize(("order", "delay"), [
    ("play lag reference law", 0.0),  # the command of the last step, held: no delay but the hold
    ("lag play reference law", 0.25),  # and a fine step between the two
    ("reference law play lag", 0.0),  # the measured value is that of the last step instead
    ("reference law lag play", 0.25),
    ("play reference law lag", 0.25),  # two late values: one closes the loop
])  # fmt: skip
def test_a_late_value_among_fine_units_is_a_fine_step(write: Any, order: str, delay: float) -> None:
    assert side(system(write, order, CHAIN, WIRES, 4)) == (["play", "lag"], delay)
