"""Times of the events of every source, where steps are cut, and what is said about events that no step ends on."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from engines import ready

from hystfmu.base.errors import InputError
from hystfmu.scenario.system import events as module
from hystfmu.scenario.system.events import NEAR, SHORTEST, cuts, missed
from hystfmu.scenario.system.system import System

H = 2.0**-6  # exact in binary


def system(
    write: Any, source: dict[str, Any], *, read: tuple[str, ...] = ("r",), stop: float = 1.0, **more: Any
) -> System:
    """A source and a lag that reads outputs of it, located."""
    n = len(read)
    lag = {"block": "sum", "dims": {"n": n}, "values": {"k": [1.0] * n}}
    ends = [f"lag.u_{k + 1}" for k in range(n)] if n > 1 else ["lag.u"]
    data = {
        "name": "events",
        "step": H,
        "stop": stop,
        "coupling": {"scheme": "gauss_seidel", **more.pop("coupling", {})},
        "order": ["source", "lag"],
        "units": {"source": source, "lag": lag},
        "connections": {end: f"source.{output}" for end, output in zip(ends, read, strict=True)},
        "metrics": {"peak": {"kind": "peak", "signal": "lag.y"}},
    }
    return ready(write(data | more))


def reference(**values: Any) -> dict[str, Any]:
    dims = {"dims": {"m": values.pop("m")}} if "m" in values else {}
    return {"block": "reference", **dims, "values": values}


def step(at: float, height: float = 1.0) -> dict[str, Any]:
    return {"block": "disturbance", "values": {"step": height, "t_step": at, "amplitude": 0.0}}


def test_a_discontinuity_has_two_cuts(write: Any) -> None:
    """One right before it, by twice what the core can tell apart, and one on it."""
    at = 10.25 * H
    n, t = cuts(system(write, step(at), read=("d",)))
    room = max(NEAR * (H + at), SHORTEST)
    assert n.tolist() == [11, 11]
    assert t.tolist() == pytest.approx([at - 2 * room, at], rel=1e-15)
    assert at - t[0] > room


@pytest.mark.parametrize("height", [0.0, 1.0])
@pytest.mark.parametrize("at", [0.0, 10 * H, 1.0, 1.5, -0.3])
def test_on_the_grid_or_outside_the_run_nothing_is_cut(write: Any, at: float, height: float) -> None:
    assert [len(x) for x in cuts(system(write, step(at, height), read=("d",)))] == [0, 0]


def test_a_step_of_no_height_is_no_event(write: Any) -> None:
    assert len(cuts(system(write, step(10.25 * H, 0.0), read=("d",)))[0]) == 0
    assert len(cuts(system(write, step(10.25 * H, -2.0), read=("d",)))[0]) == 2


@pytest.mark.parametrize(("off", "n"), [(0.9, 0), (0.95, 1), (-0.99, 0), (-1.01, 2), (2.9, 1), (3.1, 2)])
def test_what_the_core_cannot_tell_apart_is_one_time(write: Any, off: float, n: int) -> None:
    """An event nearer to a grid point than `room` is on it; a cut nearer than that to another one is left out."""
    at = 10 * H
    room = NEAR * (H + at)
    found, t = cuts(system(write, step(at + off * room), read=("d",)))
    assert len(t) == n, (found, t)
    assert set(found.tolist()) <= ({11} if off > 0 else {10})


def test_events_of_one_grid_only_where_they_are_located(write: Any) -> None:
    s = system(write, step(10.25 * H), read=("d",), coupling={"events": "grid"})
    assert [len(x) for x in cuts(s)] == [0, 0]
    assert cuts(s)[0].dtype == np.int64


def test_the_corners_of_a_triangle(write: Any) -> None:
    """2/pi asin(sin(2 pi f t + phase)): extrema where the sine is 1 or -1."""
    f, phase = 3.7, 0.4
    n, t = cuts(system(write, reference(shape="triangle", frequency=f, phase=phase)))
    want = [x for k in range(-2, 9) if 0 < (x := (k / 2 + 0.25 - phase / 2 / math.pi) / f) < 1]
    assert t.tolist() == pytest.approx(want, rel=1e-13)
    assert n.tolist() == [math.ceil(x / H) for x in want]


def test_the_turn_arounds_of_a_triangle(write: Any) -> None:
    """A share `turn` of the time is parabolas: they begin and end a quarter of it from the extremum, in periods."""
    f, turn = 3.7, 0.3
    t = cuts(system(write, reference(shape="triangle", frequency=f, turn=turn)))[1]
    want = sorted(x for k in range(9) for s in (-1, 1) if 0 < (x := (k / 2 + 0.25) / f + s * turn / 4 / f) < 1)
    assert t.tolist() == pytest.approx(want, rel=1e-13)


def test_random_reversals_come_every_half_period(write: Any) -> None:
    f, m = 3.3, 4
    t = cuts(system(write, reference(shape="random_reversals", frequency=f, seed=1, m=m)))[1]
    assert t.tolist() == pytest.approx([k / (2 * f) for k in range(1, m + 1)], rel=1e-13)


def test_levels_that_change_are_discontinuities(write: Any) -> None:
    T = 10.25 * H
    t = cuts(system(write, reference(shape="steps", T=T, levels=[0.0, 1.0, 1.0, -1.0], m=4)))[1]
    assert t[1::2].tolist() == pytest.approx([T, 3 * T], rel=1e-13)
    assert (t[1::2] - t[::2] > 0).all()
    assert len(t) == 4


@pytest.mark.parametrize("shape", ["sine", "triangle", "random_reversals"])
def test_what_is_smooth_or_rests_has_no_events(write: Any, shape: str) -> None:
    f = 2.3 if shape == "sine" else 0.0
    assert len(cuts(system(write, reference(shape=shape, frequency=f)))[0]) == 0


@pytest.mark.parametrize("output", ["r_lead", "dr_lead", "ddr_lead"])
def test_the_preview_has_the_events_earlier(write: Any, output: str) -> None:
    """The lowest derivative that jumps decides: dr of a triangle jumps, r has a kink, ddr is 0 but at the kink."""
    f, lead = 1.3, 0.11
    s = system(write, reference(shape="triangle", frequency=f, lead=lead), read=("r", output))
    own = [(k / 2 + 0.25) / f for k in range(4)]
    jumps = output == "dr_lead"
    want = sorted([x for x in own if 0 < x < 1] + [x - lead for x in own if 0 < x - lead < 1])
    t = cuts(s)[1]
    if jumps:  # its cuts are pairs
        assert len(t) == len(want) + len([x for x in own if 0 < x - lead < 1])
        assert set(np.round(want, 12)) <= set(np.round(t, 12))
    else:
        assert t.tolist() == pytest.approx(want, rel=1e-12)


def test_a_preview_that_nobody_reads_has_no_events(write: Any) -> None:
    f = 1.3
    t = cuts(system(write, reference(shape="triangle", frequency=f, lead=0.11)))[1]
    assert t.tolist() == pytest.approx([(k / 2 + 0.25) / f for k in range(3) if (k / 2 + 0.25) / f < 1], rel=1e-12)


@pytest.mark.parametrize("lead", [0.25, -0.25])
def test_a_preview_sees_events_beyond_the_run(write: Any, lead: float) -> None:
    """Those after its end for a lead, those before its beginning for a lag."""
    f = 4.3
    s = system(write, reference(shape="triangle", frequency=f, lead=lead), read=("r_lead", "r"))
    want = {round(x, 12) for k in range(-9, 20) for shift in (0, lead) if 0 < (x := (k / 2 + 0.25) / f - shift) < 1}
    assert {round(x, 12) for x in cuts(s)[1].tolist()} == want


def test_too_many_reversals_are_refused_in_one_line(write: Any) -> None:
    with pytest.raises(InputError, match=r"source\.frequency: more than \d+ reversals; got 1e\+12 Hz$"):
        cuts(system(write, reference(shape="triangle", frequency=1e12)))


def test_as_many_reversals_as_steps_may_be(write: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "MOST_STEPS", 80)  # 64 fine steps and 16 cuts
    for f, good in [(8.0, True), (8.5, False)]:
        s = system(write, reference(shape="triangle", frequency=f, phase=0.3))
        if good:
            assert len(cuts(s)[1]) == 16
        else:
            with pytest.raises(InputError, match=r"more than 80 "):
                cuts(s)
    monkeypatch.setattr(module, "MOST_STEPS", 32)
    with pytest.raises(InputError, match=r"case nominal: more than 32 fine steps and events$"):
        cuts(system(write, reference(shape="triangle", frequency=8.0, phase=0.3)))
    monkeypatch.setattr(module, "MOST_STEPS", 31)
    with pytest.raises(InputError, match=r"source\.frequency: more than 31 reversals; got 16 Hz$"):
        cuts(system(write, reference(shape="triangle", frequency=16.0, phase=0.3)))


def test_a_preview_inside_of_a_graph_counts(write: Any) -> None:
    """Connections inside are not looked at: a reference among other blocks may be read anywhere."""
    f, lead = 1.3, 0.11
    values = {"shape": "triangle", "frequency": f, "lead": lead}
    blocks = [{"name": "r", "type": "reference", "values": values}, {"name": "g", "type": "scaling", "dims": {"n": 1}}]
    outputs = [{"name": "r", "source": "g.y"}]
    graph = {"graph": {"blocks": blocks, "wires": [["r.r_lead", "g.u"]], "inputs": [], "outputs": outputs}}
    s = system(write, graph)
    own = [x for k in range(4) for x in ((k / 2 + 0.25) / f, (k / 2 + 0.25) / f - lead) if 0 < x < 1]
    assert {round(x, 9) for x in own} <= {round(x, 9) for x in cuts(s)[1].tolist()}


def test_near_discontinuities_are_one(write: Any) -> None:
    """Nearer than the core can tell apart: one cut before the first and one on the last."""
    at = 10.25 * H
    room = NEAR * (H + at)
    other = {"other": step(at + 2.5 * room), "lag": {"block": "sum", "dims": {"n": 2}, "values": {"k": [1.0, 1.0]}}}
    for distance, n in [(2.5, 2), (8.0, 4)]:
        data = {
            "name": "events", "step": H, "stop": 1.0, "order": ["source", "other", "lag"],
            "units": {"source": step(at)} | other | {"other": step(at + distance * room)},
            "connections": {"lag.u_1": "source.d", "lag.u_2": "other.d"},
            "metrics": {"peak": {"kind": "peak", "signal": "lag.y"}},
        }  # fmt: skip
        t = cuts(ready(write(data)))[1]
        assert len(t) == n
        assert t[0] == pytest.approx(at - 2 * room, rel=1e-14)
        assert t[-1] == pytest.approx(at + distance * room, rel=1e-14)


# ---- what is said ---------------------------------------------------------------------------------------------------
SAID = "events/nominal: source.t_step: the discontinuity at {} s is between two steps of {} s and takes effect at {} s"


def test_a_discontinuity_that_no_step_ends_on_is_reported(write: Any) -> None:
    grid = {"coupling": {"events": "grid"}, "read": ("d",)}
    at = 10.25 * H
    assert missed(system(write, step(at), **grid)) == [SAID.format(f"{at:.9g}", f"{H:g}", f"{11 * H:.9g}")]
    assert missed(system(write, step(10 * H), **grid)) == []
    assert missed(system(write, step(10 * H * (1 + 0.5e-9)), **grid)) == []
    assert len(missed(system(write, step(10 * H * (1 + 3e-9)), **grid))) == 1
    assert missed(system(write, step(at, 0.0), **grid)) == []
    assert missed(system(write, step(at), read=("d",))) == [], "located: a step ends on it"
    fine = {**step(10.25 * H), "substeps": 4}
    assert missed(system(write, fine, **grid)) == [], "a substep ends on it"


def test_kinks_and_previews_are_not_reported(write: Any) -> None:
    grid = {"coupling": {"events": "grid"}}
    assert missed(system(write, reference(shape="triangle", frequency=3.7), **grid)) == []
    levels = reference(shape="steps", T=10 * H, levels=[0.0, 1.0], m=2, lead=0.25 * H)
    assert missed(system(write, levels, read=("r", "r_lead"), **grid)) == []
    own = reference(shape="steps", T=10.5 * H, levels=[0.0, 1.0], m=2, lead=0.5 * H)
    (line,) = missed(system(write, own, read=("r", "r_lead"), **grid))
    assert "source.T: the discontinuity at" in line


def test_a_unit_that_cannot_be_cut_is_reported_though_events_are_located(write: Any) -> None:
    slow = {**step(10.5 * H), "every": 2}
    s = system(write, slow, read=("d",))
    assert not s.parts[0].any_step
    assert cuts(s)[0].size == 0
    assert missed(s) == [SAID.format(f"{10.5 * H:.9g}", f"{2 * H:g}", f"{12 * H:.9g}")]
