"""Validation models of the library. In each model, test signals drive the component `tested`."""

import re
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from generator.base_class import BaseClass, base_classes
from generator.declarations import linked, number
from generator.shelf import REALISATIONS, Shelf, mark
from hystfmu.base import InputError
from hystfmu.core.library import BlockType
from hystfmu.modelica.classes import enumeration, is_sampled_class, matrix_rows
from hystfmu.modelica.layout import placed
from hystfmu.modelica.literals import array, class_text, information

_OMEGAS = (7, 5, 11, 13)  # rad/s, of the inputs of a block that has no table in validation.toml


@dataclass(frozen=True)
class Case:
    """Test values of one Validation model, for example from a table of the file ``modelica/validation.toml``."""

    name: str
    text: str
    class_name: str
    values: str = ""
    amplitude: float = 1.0
    offset: float = 0.0
    Ts: float = 2e-3
    realisations: tuple[str, ...] = REALISATIONS
    inputs: Mapping[str, str] = field(default_factory=dict)
    stop: float = 1.0
    interval: float = 0.01
    source: str = "modelica/validation.toml"


def cases(shelf: Shelf) -> list[Case]:
    """Return the test values of all Validation models.

    They are the tables of ``modelica/validation.toml``, and the first test vector of each class without a table.
    """
    tables = tomllib.loads((shelf.root.parent / "validation.toml").read_text("utf-8"))
    found = [_case(name, table) for name, table in tables.items()]
    by_hand = {n.rsplit(".", 1)[-1] for n in shelf.texts if n.startswith("Validation.") and "BaseClasses" not in n}
    there = {c.class_name for c in found} | by_hand
    vectors = shelf.root.parents[1] / "tests" / "vectors"
    return found + [_from_vectors(b, vectors) for b in base_classes() if b.name not in there and shelf.classes(b.name)]


def _case(name: str, table: dict[str, Any]) -> Case:
    given = {"class_name": name} | {{"class": "class_name"}.get(k, k): v for k, v in table.items()}
    if "realisations" in given:
        given["realisations"] = tuple(given["realisations"])
    return Case(name, **given)


def _from_vectors(base: BaseClass, vectors: Path) -> Case:
    """Return test values from the first test vector of a block. Another test compares the C core with this vector.

    Raises
    ------
    InputError
        The block has no file with test vectors.
    """
    block = base.block
    files = [vectors / kind / f"{block.name}.toml" for kind in ("published", "derived")]
    file = next((f for f in files if f.exists()), None)
    if file is None:
        raise InputError(f"write tests/vectors/derived/{block.name}.toml or published/{block.name}.toml: its vectors")
    case = tomllib.loads(file.read_text("utf-8"))["case"][0]
    dims = {d.name: d.start for d in block.dims} | case.get("dims", {})
    values = [f"{k} = {n}" for k, n in case.get("dims", {}).items()]
    values += [f"{k} = {_literal(block, k, v, dims)}" for k, v in case.get("values", {}).items()]
    inputs = [
        f"{v.name}[{i + 1}]" if v.size != "1" else v.name
        for v in block.of("input")
        for i in range(block.sizes(dims)[v.name])
    ]
    largest = float(np.abs(np.asarray(case["u"], float)).max()) if inputs else 1.0
    size = number(largest or 1.0)
    waves = {name: f"{size}*sin({_OMEGAS[i % len(_OMEGAS)] + i // len(_OMEGAS)}*time)" for i, name in enumerate(inputs)}
    realised = base.package in ("Operators", "Inverse") and is_sampled_class(block)
    return Case(
        base.name,
        f"{block.text}, values of its first vector",
        base.name,
        ", ".join(values + (["Ts = 0.01"] if is_sampled_class(block) and not realised else [])),
        amplitude=float(size),
        inputs=waves,
        stop=1.1,
        source=f"tests/vectors/{file.parent.name}/{file.name}",
    )


def _literal(block: BlockType, name: str, value: Any, dims: Mapping[str, int]) -> str:
    v = next(v for v in block.parameters if v.name == name)
    if v.choices:
        word = value if isinstance(value, str) else v.choices[int(value)]
        return f"{enumeration(block, v)}.{word}"
    if v.size == "1":
        return number(float(np.ravel(value)[0]))
    values = np.asarray(value, float)
    rows = matrix_rows(v)
    return array(values.reshape(dims[rows], -1) if rows else values.ravel())


_INTERVALS = {"Events": 2e-3, "Smooth": 1e-3}  # s; a Sampled model uses its sample period
_STOP = 1.4  # s, end of the test signal
_TOLERANCE = 1e-10


def models(shelf: Shelf, bases: Mapping[str, str]) -> dict[str, str]:
    """Return the text of every generated Validation model, by its name inside HystFMU.

    Parameters
    ----------
    shelf : Shelf
    bases : mapping of str to str
        Text of each generated base class, by its name inside HystFMU.

    Raises
    ------
    InputError
        A table names a class that the library does not contain.
    """
    texts = {**bases, **shelf.texts}
    found = {}
    for case in cases(shelf):
        classes = [
            n for n in shelf.classes(case.class_name) if n.count(".") == 1 or n.split(".")[1] in case.realisations
        ]
        if not classes:
            raise InputError(f"modelica/validation.toml: [{case.name}] is of {case.class_name}, which has no file")
        for name in classes:
            _, *inner = name.split(".")[:-1]
            model = ".".join(["Validation", *inner, case.name])
            found[model] = _on_signal(case, name, texts) if inner else _driven(case, name)
    return found


def _on_signal(case: Case, name: str, texts: Mapping[str, str]) -> str:
    package, kind, _ = name.split(".")
    base = texts[f"{package}.BaseClasses.{case.class_name}"]
    port = re.findall(r"Interfaces\.RealInput (\w+)", base)[0]
    wires = [f"connect(signal.r, tested.{port});"]
    if "usesRate = true" in texts[name]:
        wires.append(f"connect(signal.dr, tested.d{port});")
    values = [case.values] if case.values else []
    step = case.Ts if kind == "Sampled" else _INTERVALS[kind]
    if kind == "Sampled":
        values.append(f"Ts = {number(case.Ts)}")
    where = "at every sample" if kind == "Sampled" else "at every row of the simulation"
    return _model(
        f"Validation.{kind}",
        case,
        f"{case.text}, {kind.lower()}",
        [
            f"{name} tested({', '.join(values)}) annotation ({placed(30, 0, 20)});",
            f"BaseClasses.TestSignal signal(amplitude = {number(case.amplitude)}, offset = {number(case.offset)}) "
            f"annotation ({placed(-50, 0, 20)});",
        ],
        wires,
        (_STOP, step),
        f"{case.text}. The test compares it with the unit on the signal of "
        f"{linked('Validation.BaseClasses.TestSignal')}, {where}.",
        name,
    )


def _driven(case: Case, name: str) -> str:
    values = f"({case.values})" if case.values else ""
    return _model(
        "Validation",
        case,
        case.text,
        [f"{name} tested{values} annotation ({placed(0, 0, 20)});"],
        [f"tested.{port} = {expression};" for port, expression in case.inputs.items()],
        (case.stop, case.interval),
        f"{case.text}. The test compares it with the unit at every sample.",
        name,
    )


def _model(
    within: str,
    case: Case,
    text: str,
    parts: list[str],
    equations: list[str],
    experiment: tuple[float, float],
    told: str,
    tested: str,
) -> str:
    stop, interval = map(number, experiment)
    lines = [
        "  extends Icons.Example;",
        *(f"  {p}" for p in parts),
        *(["equation"] if equations else []),
        *(f"  {e}" for e in equations),
    ]
    info = information(told, f"<b>See also:</b> {linked(tested)}.")
    before = f"experiment(StopTime = {stop}, Interval = {interval}, Tolerance = {number(_TOLERANCE)}),\n    "
    made = class_text(f"model {case.name}", text, lines, info, f"HystFMU.{within}", before)
    return f"{mark(case.source)}\n{made}"
