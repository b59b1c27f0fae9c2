"""Pairs of parameters that may be equal, and what the block says where they have passed each other."""

from typing import Any

import numpy as np
import pytest

from hystfmu.base.errors import InputError
from hystfmu.graph import Graph, Node

CLAMPED = "u_min must not be greater than u_max"
MAY_MEET = [  # the lower one, the upper one, the refusal
    ("amplifier", "u_min", "u_max", "the limits need u_min <= u_max"),
    ("adaptive_inverse", "w0_min", "w0", "w0_min must not be greater than w0"),
    ("in_range", "lo", "hi", "the limits need lo <= hi"),
    ("scaling", "lo", "hi", "the limits need lo <= hi"),
    *(
        (block, "u_min", "u_max", CLAMPED)
        for block in ("adaptive_inverse", "disturbance_observer", "lead_lag", "pid", "sliding_mode", "super_twisting")
    ),
]
MUST_DIFFER = ["preisach", "krasnoselskii_pokrovskii"]


def build(block: str, values: dict[str, Any]) -> None:
    Graph.single(Node("b", block, {}, values)).executor()


@pytest.mark.parametrize(("block", "low", "high", "said"), MAY_MEET, ids=lambda v: str(v)[:20])
def test_limits_may_meet_but_not_pass(block: str, low: str, high: str, said: str) -> None:
    for at in np.random.default_rng().uniform(0.2, 3, 3).tolist():
        build(block, {low: at, high: at})
        build(block, {low: np.nextafter(at, 0), high: at})
        with pytest.raises(InputError) as e:
            build(block, {low: np.nextafter(at, 9), high: at})
        assert said in str(e.value)


@pytest.mark.parametrize("block", MUST_DIFFER)
def test_a_range_is_not_empty(block: str) -> None:
    for at in (-0.7, 1.3):
        build(block, {"lo": at, "hi": at + 0.1})
        for hi in (at, at - 0.1):
            with pytest.raises(InputError, match="lo must be less than hi"):
                build(block, {"lo": at, "hi": hi})


@pytest.mark.parametrize("element", [0, 1, 2])
def test_every_signal_has_its_own_limits(element: int) -> None:
    """in_range and scaling: at a limit is inside, beyond is not, each element against its own two."""
    lo, hi = np.array([-1.5, 0.2, 3.0]), np.array([-1.0, 0.2, 7.0])
    inside = Graph.single(Node("b", "in_range", {"n": 3}, {"lo": lo.tolist(), "hi": hi.tolist()}))
    values = {"gain": [1.0] * 3, "lo": lo.tolist(), "hi": hi.tolist()}
    limited = Graph.single(Node("b", "scaling", {"n": 3}, values))
    middle = (lo + hi) / 2
    for limit, beyond in ((lo, -np.inf), (hi, np.inf)):
        u = np.array([middle, middle])
        u[0, element], u[1, element] = limit[element], np.nextafter(limit[element], beyond)
        assert inside.run(u, 0.1).ravel().tolist() == [1.0, 0.0]
        assert np.array_equal(limited.run(u, 0.1).reshape(2, 3), np.clip(u, lo, hi))
        changed = hi.copy()
        changed[element] = lo[element] - 0.1
        with pytest.raises(InputError, match="the limits need lo <= hi"):
            build("in_range", {"lo": lo.tolist(), "hi": changed.tolist()})
