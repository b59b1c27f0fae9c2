"""Package Choices: enumerations for the choices that are missing in Types."""

from __future__ import annotations

from hystfmu.modelica.library.base_class import base_classes
from hystfmu.modelica.library.markup import information
from hystfmu.modelica.library.shelf import mark
from hystfmu.modelica.literals import sentence
from hystfmu.modelica.places import enumeration, lacks

_PACKAGE = "Choices"


def enumerations() -> dict[str, str]:
    """Return all generated enumerations by name below HystFMU, and the package; empty if Types has them all."""
    found = {}
    for base in base_classes():
        for v in base.block.parameters:
            if not v.choices or v.name in lacks(base.block, base.name):
                continue
            package, name = enumeration(base.block, v).split(".")
            if package != _PACKAGE:
                continue
            words = ", ".join(f"{w} {sentence(w)}" for w in v.choices)
            info = information(f"{v.text.capitalize()}.")
            found[f"{package}.{name}"] = (
                f"{mark('the C tables')}\nwithin HystFMU.{package};\n"
                f"type {name} = enumeration({words}) {sentence(v.text)}\n"
                f"  annotation (Documentation(info = {info}));\n"
            )
    if found:
        info = information("Words of parameters, from the C tables.")
        found[f"{_PACKAGE}.package"] = (
            f'{mark("the C tables")}\nwithin HystFMU;\npackage {_PACKAGE} "Choices of the blocks"\n'
            f"  extends Icons.Package;\n  annotation (Documentation(info = {info}));\nend {_PACKAGE};\n"
        )
    return found
