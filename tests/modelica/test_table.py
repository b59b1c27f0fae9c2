"""Classes with a twin among the C blocks carry the same names, units, ranges and defaults."""

from __future__ import annotations

import library
import numpy as np
import pytest

from hystfmu.core import Var, block_types
from hystfmu.modelica import classes

TWINS = {t.class_name: t for t in block_types().values()}
SHAPES = {"".join(w.capitalize() for w in k.split("_")): k for k in classes.SHAPES}
TWINS |= dict.fromkeys(SHAPES, TWINS["Reference"])
PAIRS = sorted(
    n
    for n, c in library.classes().items()
    if c.tree.type == "block" and c.short_name in TWINS and not n.startswith("HystFMU.Validation")
)
# what a class has beyond its block, and what it lacks
# Ts: the communication step of the unit; the others belong to a realisation
ADDED = {"Ts", "eps", "width", "plays", "reach", "steps"}
MISSING = {
    "TransferFunction": {"hold"},  # continuous: its input is not sampled
    # a class is one shape: it lacks what belongs to the others
    **{k: classes.missing(TWINS["Reference"], shape) for k, shape in SHAPES.items()},
}


def same_unit(modelica: str, c: str) -> bool:
    """A C unit "1" is a number in the user's own unit: no unit in Modelica, so that it connects to any."""
    return modelica == ("" if c == "1" else c)


def test_there_are_twins() -> None:
    assert len(PAIRS) >= 10


@pytest.mark.parametrize("name", PAIRS)
def test_parameters_equal_the_table(name: str) -> None:
    c = library.classes()[name]
    block = TWINS[c.short_name]
    rows = {v.name: v for v in block.parameters if v.name not in MISSING.get(c.short_name, ())}
    dims = {d.name: d for d in block.dims if d.name not in MISSING.get(c.short_name, ())}
    defaults, parts = library.parameters(c), library.components(c)
    assert set(defaults) - ADDED == set(rows) | set(dims)
    sizes = block.sizes({d.name: d.start for d in block.dims})
    for key, d in dims.items():
        assert defaults[key] == d.start, key
        assert library.evaluate(library.modifiers(parts[key].class_modification)["min"], {}) == d.lo, key
    for key, v in rows.items():
        default = v.choices[int(v.start)] if v.choices else v.start
        assert np.all(np.asarray(defaults[key]) == default), f"{key}: {defaults[key]} instead of {default}"
        assert np.size(defaults[key]) == sizes[key], key
        assert same_unit(library.unit(parts[key], c.name), v.unit), f"{key}: unit"
        if v.choices:
            enumeration = library.find(str(parts[key].type), c.name)
            assert enumeration is not None
            assert tuple(enumeration.tree.symbols) == v.choices, key
        else:
            assert limits(parts[key]) == expected_limits(v), f"{key}: range"


@pytest.mark.parametrize("name", PAIRS)
def test_ports_equal_the_table(name: str) -> None:
    c = library.classes()[name]
    for kind, connector in (("input", "RealInput"), ("output", "RealOutput")):
        rows = {v.name: v for v in TWINS[c.short_name].of(kind)}
        ports = library.ports(c, connector)
        if kind == "input":
            ports = {k: p for k, p in ports.items() if k in rows or k[1:] not in rows}  # no rate of an input
        assert list(ports) == list(rows)
        for key, v in rows.items():
            assert same_unit(library.unit(ports[key], c.name), v.unit), f"{key}: unit"


def limits(symbol: object) -> tuple[float, float]:
    found = library.modifiers(symbol.class_modification)  # type: ignore[attr-defined]
    return tuple(
        float(library.evaluate(found[k], {})) if k in found else default
        for k, default in (("min", -np.inf), ("max", np.inf))
    )  # type: ignore[return-value]


def expected_limits(v: Var) -> tuple[float, float]:
    """The range of the table; Modelica's min includes its value, so "greater than 0" is at least 0."""
    return (0.0 if v.lo == 2.2250738585072014e-308 else v.lo), v.hi
