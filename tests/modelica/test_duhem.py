"""Duhem operator at the limits of its integration: as many steps in a sample as the C core takes, and overflow."""

import numpy as np
import pytest
import simulate

from hystfmu.graph import Graph, Node

LEVELS = np.array([0.0, 0.9, 0.8])
CASES = {
    "ten thousand steps and never more, and the bound": ({"du_max": 8e-5, "w_max": 0.3}, {}),
    "not a number on the way to the bound": ({"du_max": 0.5, "w_max": 2.0}, {"a": 1e200, "b": 1e200, "c": 1e200}),
}


@pytest.mark.parametrize("case", CASES)
def test_long_ways_agree_with_the_c_core(case: str) -> None:
    values, size = dict(CASES[case][0]), CASES[case][1]
    for name in "abc":
        for end, sign in (("rise", 1), ("fall", -1)):
            values[f"{name}_{end}"] = size.get(name, 0.5) * (-1 if name == "c" else -sign if name == "b" else 1)
    given = ", ".join(f"{k} = {{{v!r}}}" if k[0] in "abc" else f"{k} = {v!r}" for k, v in values.items())
    levels = ", ".join(map(repr, LEVELS.tolist()))
    text = (
        f"model M HystFMU.Sources.Steps signal(m = {len(LEVELS)}, levels = {{{levels}}}, T = 0.1); "
        f"HystFMU.Operators.Sampled.Duhem tested({given}, Ts = 0.1); equation connect(signal.r, tested.u); end M;"
    )
    rows = simulate.solve_text(text, 0.1 * len(LEVELS), 0.1, 1e-6).at(0.1)
    assert rows["tested.u"] == pytest.approx(LEVELS)
    expected = Graph.single(Node("tested", "duhem", {}, values)).run(LEVELS)
    assert np.ptp(expected) > 0.3
    assert np.abs(rows["tested.y"] - expected).max() <= 1e-12 * np.abs(expected).max()
