"""Initialisation, reset, instances beside one another, and what they log."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path

from fmu_master import OK, H, Master, loop, rows, single

Make = Callable[..., Master]
U = rows(single("prandtl_ishlinskii"))[:, 0]


def test_outputs_follow_inputs_in_initialization_mode(make: Make) -> None:
    m = make()
    assert m.enter() == OK
    seen = []
    for u in (0.0, 2.0, -1.0, 2.0):
        assert m.set("u", u) == OK
        seen.append((m.get("y"), m.get("y")))
    assert seen[1] == seen[3], "the memory is initialised anew for every guess"
    assert [a == b for a, b in seen] == [True] * 4
    assert seen[1][0] == m.graph.run([2.0, 2.0])[0]


def test_get_and_set_have_no_side_effects(make: Make) -> None:
    plain, busy = make(), make()
    for m in (plain, busy):
        m.initialize()
    want = plain.run(U[:50])
    got = []
    for k, u in enumerate(U[:50]):
        for guess in (3.0, -3.0, float(u)):
            assert busy.set("u", guess) == OK
            busy.get("y")
        assert busy.step(k * H) == OK
        got.append(busy.get("y"))
    assert got == want


def test_reset_gives_a_new_instance(make: Make) -> None:
    new, used = make(), make()
    used.set("u0", 0.3)
    used.set("w0", 2.0)
    used.initialize(t=7.0)
    used.set("u", 1.0)
    assert used.step(7.0) == OK
    used.set("u", math.nan)
    assert used.call("Reset") == OK
    assert used.memory() == new.memory()
    for m in (new, used):
        m.initialize()
    assert used.run(U[:30]) == new.run(U[:30])


def test_instances_are_independent(make: Make) -> None:
    a, b, alone = make(), make(), make()
    for m in (a, b, alone):
        m.initialize()
    want = alone.run(U[:40])
    got = []
    for k, u in enumerate(U[:40]):
        got += a.run([u], first=k)
        b.run([-2 * u], first=k)
    assert got == want


def test_many_instances(make: Make, folder: Path) -> None:
    graph = single("backlash_sum")
    many = [make(graph) for _ in range(1000)]
    assert len({m.c.value for m in many}) == 1000


def test_two_different_fmus_in_one_process(make: Make) -> None:
    a, b = make(single("backlash_sum")), make(loop())
    a.initialize()
    b.initialize()
    y = [(a.set("u", 0.01 * k), b.step(k * H), a.step(k * H), a.get("y"), b.get("y"))[3:] for k in range(20)]
    b2 = make(loop())
    b2.initialize()
    assert [v for _, v in y] == [(b2.step(k * H), b2.get("y"))[1] for k in range(20)]
