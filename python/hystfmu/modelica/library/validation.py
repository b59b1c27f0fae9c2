"""Validation models: one component `tested`, driven by the test signal or by inputs of its own."""

from __future__ import annotations

import re
from collections.abc import Mapping

from hystfmu.base.errors import InputError
from hystfmu.modelica.layout import placed
from hystfmu.modelica.library.cases import Case, cases
from hystfmu.modelica.library.declarations import number
from hystfmu.modelica.library.markup import information, link
from hystfmu.modelica.library.shelf import Shelf, mark
from hystfmu.modelica.literals import sentence

_INTERVALS = {"Events": 2e-3, "Smooth": 1e-3}  # Sampled: its sample period
_STOP = 1.4  # of the signal
_TOLERANCE = 1e-10


def models(shelf: Shelf, bases: Mapping[str, str]) -> dict[str, str]:
    """Return every generated Validation model by its name below HystFMU.

    Parameters
    ----------
    shelf : Shelf
    bases : mapping of str to str
        Generated base classes by their names below HystFMU.

    Raises
    ------
    InputError
        A table belongs to a class that the library does not have.
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
        f"{link('Validation.BaseClasses.TestSignal')}, {where}.",
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
        mark(case.source),
        f"within HystFMU.{within};",
        f"model {case.name} {sentence(text)}",
        "  extends Icons.Example;",
        *(f"  {p}" for p in parts),
        *(["equation"] if equations else []),
        *(f"  {e}" for e in equations),
        f"  annotation (experiment(StopTime = {stop}, Interval = {interval}, Tolerance = {number(_TOLERANCE)}),",
        f"    Documentation(info = {information(told, f'<b>See also:</b> {link(tested)}.')}));",
        f"end {case.name};\n",
    ]
    return "\n".join(lines)
