"""Every Validation model against the C core, the plain numpy forms and the committed references.

`make modelica` runs them all and prints the table; here every realisation of every operator runs once.
"""

from __future__ import annotations

from pathlib import Path

import compare
import library
import numpy as np
import pytest

OPERATORS = sorted(n for n in library.classes() if compare.is_operator(n))
OTHERS = sorted(n for n in library.classes() if compare.is_other(n))
# a second set of values, and the slow ones among the inverses: with `-m torture` and in `make modelica`
VARIANTS = [
    n for n in OPERATORS if n.rsplit(".", 1)[-1] != compare.operator(n)[0] or (".Events." in n and "Inverse" in n)
]


@pytest.mark.parametrize("name", [n for n in OPERATORS if n not in VARIANTS])
def test_operator_agrees(name: str, tmp_path: Path) -> None:
    check(compare.compare(name, tmp_path / "result.npz"))


@pytest.mark.torture
@pytest.mark.parametrize("name", VARIANTS)
def test_variant_of_an_operator_agrees(name: str, tmp_path: Path) -> None:
    check(compare.compare(name, tmp_path / "result.npz"))


@pytest.mark.parametrize("name", OTHERS)
def test_block_agrees_with_the_c_core(name: str, tmp_path: Path) -> None:
    check(compare.compare_other(name, tmp_path / "result.npz"))


@pytest.mark.parametrize("name", [n for n in library.classes() if compare.is_example(n)])
def test_example_agrees_with_its_reference(name: str, tmp_path: Path) -> None:
    o = compare.compare_example(name, tmp_path / "result.npz")
    print(compare.line(o))
    assert o.error_reference <= o.tube


def check(o: compare.Outcome) -> None:
    print(compare.line(o))
    assert o.error_c <= o.bound_c
    assert np.isnan(o.error_numpy) or o.error_numpy <= o.bound_numpy
    assert o.error_reference <= o.tube, "not the committed reference (tests/modelica/report.py --record writes it)"


def test_every_operator_has_every_signal_in_every_realisation() -> None:
    """The one signal of these models holds them all; every Validation model of an operator must use it."""
    for name in OPERATORS:
        signal = library.classes()[name].tree.symbols["signal"]
        assert str(signal.type) == "BaseClasses.TestSignal", name
    for package in ("Operators", "Inverse"):
        blocks = [n for n, c in library.classes().items() if compare.is_realisation(n, package)]
        assert blocks
        for name in blocks:
            kind, short_name = name.split(".")[2:]
            assert f"HystFMU.Validation.{kind}.{short_name}" in library.classes()


def test_numpy_form_of_the_signal_has_the_parts_that_it_should() -> None:
    t = np.arange(0, 1.4, 1e-5)
    u = compare.signal_form(t)
    rate = np.diff(u)
    turns = np.flatnonzero(rate[1:] * rate[:-1] < 0)

    def between(a: float, b: float) -> int:
        return int(np.sum((t[turns] > a) & (t[turns] < b)))

    assert between(0, 0.2) == 4, "a sine of two periods"
    assert between(0.2, 0.5) > 12, "minor loops"
    tops = np.abs(u[turns + 1][(t[turns] > 0.5) & (t[turns] < 0.8)])
    assert (np.diff(tops) < 0).all()
    assert len(tops) > 10, "a decaying sine"
    assert (rate[(t[1:] > 0.851) & (t[1:] < 0.899)] == 0).all(), "a hold"
    assert np.abs(rate).max() / 1e-5 > 1000, "a step"
    assert between(1.1, 1.4) > 8, "reversals with noise: four without it"
