"""Every block refuses values and sizes out of range, with one form of sentence."""

import numpy as np
import pytest
from excitation import default, every_block

from hystfmu import InputError, Node
from hystfmu.core.library import Var, block_types

POSITIVE = 2.2250738585072014e-308  # as a lower bound: "greater than 0"


def noun(v: Var) -> str:
    """The range of a variable as the error sentence must write it."""
    if v.choices:
        return f"one of {v.type} (0, 1, ...)"
    if v.type == "bool":
        return "a bool (0 or 1)"
    left = "(0" if v.lo == POSITIVE else "(-inf" if v.lo == -np.inf else f"[{v.lo:.10g}"
    right = "inf)" if v.hi == np.inf else f"{v.hi:.10g}]"
    return f"{'a float' if v.type == 'real' else 'an int'} in {left}, {right}"


def illegal(v: Var) -> list[tuple[float, str]]:
    """Values that must be refused, with how the sentence writes them."""
    bad = [(np.nan, "nan"), (np.inf, "inf"), (-np.inf, "-inf")]
    if v.lo > -np.inf:
        bad.append((-1.0, "-1") if v.lo >= 0 else (1.5 * v.lo, f"{1.5 * v.lo:.10g}"))
    if v.lo == POSITIVE:
        bad.append((0.0, "0"))
    if v.hi < np.inf and v.hi > 0:
        bad.append((2 * v.hi + 1, f"{2 * v.hi + 1:.10g}"))
    if v.type != "real":
        bad.append((0.5, "0.5"))
    return bad


@every_block
def test_values_out_of_range_are_refused_in_one_sentence(name: str) -> None:
    block, graph = block_types()[name], default(name)
    executor = graph.executor()
    checked = 0
    for v in (*block.parameters, *block.of("input")):
        port = graph.port(v.name)
        role = "input" if v.kind == "input" else "parameter"
        for value, written in illegal(v):
            if role == "parameter":
                with pytest.raises(InputError) as e:
                    Node(name, name, dict(graph.nodes[0].dims), {v.name: value})
                assert str(e.value) == f"The '{v.name}' parameter of {name} must be {noun(v)}. Got {written} instead."
            with pytest.raises(InputError) as e:
                executor.set(port.reference, value)
            assert str(e.value) == f"The '{v.name}' {role} of {name} must be {noun(v)}. Got {written} instead."
            checked += 1
        for unknown in ("no_such_word",) if v.choices else ():
            with pytest.raises(InputError, match="Got 'no_such_word' instead"):
                Node(name, name, {}, {v.name: unknown})
    assert checked or not (block.parameters or block.of("input"))


def test_the_sentence_of_the_design() -> None:
    with pytest.raises(InputError) as e:
        Node("sliding_mode", "sliding_mode", {}, {"rho": -1})
    assert str(e.value) == "The 'rho' parameter of sliding_mode must be a float in [0, inf). Got -1 instead."


@every_block
def test_sizes_out_of_range_are_refused(name: str) -> None:
    for d in block_types()[name].dims:
        for n in (d.lo - 1, d.hi + 1):
            with pytest.raises(InputError) as e:
                Node(name, name, {d.name: n})
            assert str(e.value) == f"The '{d.name}' size of {name} must be an int in [{d.lo}, {d.hi}]. Got {n} instead."
