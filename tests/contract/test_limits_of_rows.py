"""Limits of the rows of every block: round numbers, taken themselves, and the next number beyond is refused."""

import numpy as np
import pytest
from excitation import default, every_block

from hystfmu.base.errors import InputError
from hystfmu.core.library import block_types

EXACT = (2.2250738585072014e-308, 2.0**31 - 1)  # "greater than 0"; the largest number of 32 bits

DIVISORS = {  # what is derived and divided by: 1 before it is derived
    ("amplifier", "omega"),
    ("amplifier", "most"),
    ("creep_inverse", "gain"),
    ("sliding_mode", "layer"),
    ("super_twisting", "layer"),
    ("transfer_function", "sigma"),
}


@every_block
def test_limits_are_taken_and_the_next_number_beyond_is_refused(name: str) -> None:
    block, graph = block_types()[name], default(name)
    executor = graph.executor()
    for v in (*block.parameters, *block.of("input")):
        port = graph.port(v.name)
        for limit, beyond in ((v.lo, -np.inf), (v.hi, np.inf)):
            if np.isinf(limit):
                continue
            for k in range(port.size):
                executor.set(port.reference + k, limit)
                assert executor.get(port.reference + k) == limit
                with pytest.raises(InputError, match=rf"^The '{v.name}'"):
                    executor.set(
                        port.reference + k, np.nextafter(limit, beyond) if v.type == "real" else limit + np.sign(beyond)
                    )
                assert executor.get(port.reference + k) == limit


@every_block
def test_limits_are_round_numbers(name: str) -> None:
    """The page of the blocks writes them with ten digits: one that needs more would not be what it says."""
    for v in block_types()[name].vars:
        for limit in (v.lo, v.hi):
            assert np.isinf(limit) or limit in EXACT or float(f"{limit:.2g}") == limit, (v.name, limit)


@every_block
def test_derived_values_are_zero_before_they_are_derived(name: str) -> None:
    for v in block_types()[name].of("derived"):
        assert v.start == ((name, v.name) in DIVISORS), v
