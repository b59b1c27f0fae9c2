"""Groups of parameters: what a dialog shows together follows from the rows of the table."""

import pytest
from excitation import every_block

from hystfmu.core.library import BlockType, block_types
from hystfmu.graph.listing import group

EXPECTED = {  # by hand, from the equations
    "pid": {"Gains": "Kp Ki Kd", "Filters": "tau", "Limits": "u_min u_max"},
    "prandtl_ishlinskii": {"Weights": "w0 w", "Thresholds": "r", "Start": "u0"},
    "mlp": {"Weights": "W1 b1 W2 b2", "Network": "activation"},
    "creep": {"Weights": "w w0", "Dynamics": "T", "Start": "start"},
    "sliding_mode": {
        "Controller": "lam epsilon switching",
        "Gains": "eta rho k_i",
        "Filters": "tau",
        "Limits": "u_min u_max",
    },
    "zhao_tan": {"Memory": "memory", "Start": "x0"},
}


def found(block: BlockType) -> dict[str, str]:
    groups: dict[str, list[str]] = {}
    for v in block.parameters:
        groups.setdefault(group(block, v), []).append(v.name)
    return {k: " ".join(names) for k, names in groups.items()}


@pytest.mark.parametrize("name", EXPECTED)
def test_parameters_stand_with_their_like(name: str) -> None:
    assert found(block_types()[name]) == EXPECTED[name]


@every_block
def test_a_long_dialog_is_divided(name: str) -> None:
    """No group of more than eight, but for a signal generator, whose parameters have one subject."""
    block = block_types()[name]
    assert all(len(names.split()) <= 8 for g, names in found(block).items() if g != "Signal")
    if len(block.parameters) > 8 and block.family != "sources":
        assert len(found(block)) > 2
