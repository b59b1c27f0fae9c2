"""What a class has other than the C block of the same name: names, defaults, ranges, units, sizes, words, ports."""

from collections.abc import Iterator

import library
import numpy as np
from twin import TWINS

from hystfmu.core.library import Var
from hystfmu.modelica.classes import DEPTH, lacks

# what a class has beyond its block
# Ts: the communication step of the unit; the others belong to a realisation
ADDED = {"Ts", "eps", "width", "plays", "reach", "values", "state0", "inChain"}


def pairs() -> list[str]:
    """The classes with a twin."""
    return [
        n
        for n, c in library.classes().items()
        if c.tree.type == "block" and c.short_name in TWINS and not n.startswith("HystFMU.Validation")
    ]


def same_unit(modelica: str, c: str) -> bool:
    """A C unit "1" is a number in the user's own unit: no unit in Modelica, so that it connects to any."""
    return modelica == ("" if c == "1" else c)


def differences(c: library.Class) -> Iterator[str]:
    """Every difference between a class and its twin."""
    block = TWINS[c.short_name]
    left_out = lacks(block, c.short_name)
    rows = {v.name: v for v in block.parameters if v.name not in left_out}
    dims = {d.name: d for d in block.dims if d.name not in left_out}
    defaults, parts = library.parameters(c), library.components(c)
    own = set(defaults) - ADDED
    for key in sorted(own - set(rows) - set(dims)):
        yield f"the parameter {key} is none of the block"
    for key in sorted({*rows, *dims} - own):
        yield f"the parameter {key} of the block is missing"
    sizes = block.sizes({d.name: d.start for d in block.dims})
    for key in own & set(dims):
        start = min(dims[key].start, DEPTH) if key == "depth" else dims[key].start
        if defaults[key] != start:
            yield f"{key} = {defaults[key]} by default, not {start}"
        if library.evaluate(library.modifiers(parts[key].class_modification)["min"], {}) != dims[key].lo:
            yield f"{key}: another min than in the block"
    for key in own & set(rows):
        v = rows[key]
        default = v.choices[int(v.start)] if v.choices else v.start
        if not np.all(np.asarray(defaults[key]) == default):
            yield f"{key} = {defaults[key]} by default, {default} in the block"
        if np.size(defaults[key]) != sizes[key]:
            yield f"{key}: {np.size(defaults[key])} elements, {sizes[key]} in the block"
        if v.choices:
            enumeration = library.find(str(parts[key].type), c.name)
            if enumeration is None or tuple(enumeration.tree.symbols) != v.choices:
                yield f"{key}: other words than in the block"
        elif limits(parts[key]) != expected_limits(v):
            yield f"{key}: range {limits(parts[key])}, {expected_limits(v)} in the block"
        yield from _unit(key, parts[key], v, c)
    yield from _ports(c)


def _ports(c: library.Class) -> Iterator[str]:
    for kind, connector in (("input", "RealInput"), ("output", "RealOutput")):
        block = TWINS[c.short_name]
        rows = {v.name: v for v in block.of(kind) if v.name not in lacks(block, c.short_name)}
        ports = library.ports(c, connector)
        if kind == "input":
            ports = {k: p for k, p in ports.items() if k in rows or k[1:] not in rows}  # no rate of an input
        if list(ports) != list(rows):
            yield f"{kind}s {list(ports)}, {list(rows)} in the block"
        for key in set(rows) & set(ports):
            yield from _unit(key, ports[key], rows[key], c)


def _unit(key: str, symbol: library.Symbol, v: Var, c: library.Class) -> Iterator[str]:
    unit = library.unit(symbol, c.name)
    if not same_unit(unit, v.unit):
        yield f"{key}: unit {unit!r}, {v.unit!r} in the block"


def limits(symbol: library.Symbol) -> tuple[float, float]:
    found = library.modifiers(symbol.class_modification)
    return tuple(
        float(library.evaluate(found[k], {})) if k in found else default
        for k, default in (("min", -np.inf), ("max", np.inf))
    )  # type: ignore[return-value]


def expected_limits(v: Var) -> tuple[float, float]:
    """The range of the table; Modelica's min includes its value, so "greater than 0" is at least 0."""
    return (0.0 if v.lo == 2.2250738585072014e-308 else v.lo), v.hi
