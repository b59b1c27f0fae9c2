"""Modelica classes from the C tables: a partial block for each block of the C core, and enumerations."""

from dataclasses import dataclass

from generator.declarations import dim, equation, linked, parameter, ports, rate_port
from generator.shelf import Shelf, mark
from hystfmu.base import escape
from hystfmu.core.library import BlockType, block_types
from hystfmu.modelica.classes import class_names, enumeration, lacks, package_of
from hystfmu.modelica.literals import class_text, information, sentence

# partial class of Interfaces for replaceable blocks of a loop, its inputs and its output, by package of the blocks
_SLOTS = {
    "Control": ("Controller", {"y_d", "y", "u_ff"}, "u"),
}


@dataclass(frozen=True)
class BaseClass:
    """Base class of a block of the C core: the parts of its Modelica class that follow from the C table.

    Attributes
    ----------
    block : BlockType
    name : str
        Name of the class, from the name of the block or of a shape of ``reference``.
    """

    block: BlockType
    name: str

    @property
    def package(self) -> str:
        """Package inside HystFMU that contains the class or its realisations."""
        return package_of(self.block).removesuffix(".Sampled")

    @property
    def path(self) -> str:
        """Name of the generated class inside HystFMU."""
        return f"{self.package}.BaseClasses.{self.name}"

    @property
    def equations(self) -> str:
        """Name inside HystFMU of the hand-written class with the equations of the block."""
        return f"{package_of(self.block)}.{self.name}"

    @property
    def wanted(self) -> str:
        """Path of the hand-written file with the equations of the block."""
        return f"modelica/HystFMU/{self.equations.replace('.', '/')}.mo"

    def text(self, shelf: Shelf) -> str:
        """Return the text of the file of the base class."""
        block = self.block
        left_out = lacks(block, self.name)
        slot, inherited = self._slot
        rated = any("usesRate" in shelf.texts[c] for c in shelf.classes(self.name))
        declared = [
            *(dim(d) for d in block.dims if d.name not in left_out),
            *(parameter(block, v, shelf) for v in block.parameters if v.name not in left_out),
            *ports(block, "input", left_out, inherited),
            *([rate_port(block.of("input")[0])] if rated else []),
            *ports(block, "output", left_out, inherited),
        ]
        lines = [
            f"  extends {f'Interfaces.{slot}' if slot else f'Icons.{self._icon}'};",
            *(f"  {d}" for d in declared),
        ]
        if rated:
            lines += ["protected", '  constant Boolean usesRate = false "True if there is an input for the rate";']
        within, info = f"HystFMU.{self.package}.BaseClasses", information(*self._paragraphs(shelf))
        text = class_text(f"partial block {self.name}", f"{block.text}: parameters and ports", lines, info, within)
        return f"{mark(f'the table of {self.source}')}\n{text}"

    @property
    def source(self) -> str:
        """Path of the C file that contains the table."""
        return f"fmu_build/core/blocks/{self.block.family}/{self.block.name}.c"

    @property
    def _slot(self) -> tuple[str, frozenset[str]]:
        """Partial class of Interfaces that the base class extends, or "", and the ports of this partial class."""
        slot, inputs, output = _SLOTS.get(self.package, ("", set(), ""))
        fits = {v.name for v in self.block.of("input")} == inputs
        return (slot, frozenset({*inputs, output})) if slot and fits else ("", frozenset())

    @property
    def _icon(self) -> str:
        icons = {"Operators": "Hysteresis", "Inverse": "Inverse", "Sources": "Source", "Plants": "Hysteresis"}
        return "Block" if package_of(self.block) == "Operators" else icons.get(self.package, "Block")

    def _paragraphs(self, shelf: Shelf) -> list[str]:
        classes = shelf.classes(self.name)
        shown = [*shelf.examples(classes), f"Validation.{classes[0].split('.', 1)[1]}"] if classes else []
        found = [
            f"<b>Equation:</b> {equation(self.block.equation)}.",
            f"<b>Source:</b> {escape(self.block.source, quote=False)}.",
            "<b>Limitations:</b> see the classes that extend it.",
        ]
        if shown:
            found.append(f"<b>Example:</b> {', '.join(map(linked, shown[:1]))}.")
        if len(classes) > 1:
            component = "inverse" if self.package == "Inverse" else "hysteresis"
            code = f"replaceable {classes[0]} {component} constrainedby {self.path};"
            found.append(f"<b>Any realisation:</b> <code>{code}</code>")
        if classes:
            found.append(f"<b>See also:</b> {', '.join(map(linked, [*classes, *shown[1:]]))}.")
        return found


def base_classes() -> list[BaseClass]:
    """Return a base class for each class that represents a block of the C core."""
    return [BaseClass(block, name) for block in block_types().values() for name in class_names(block)]


def package(name: str) -> str:
    """Return the text of package.mo of the package BaseClasses inside the package `name`."""
    what = {"Operators": "operators", "Inverse": "inverses"}.get(name, "blocks")
    info = (
        "What a class has from the C table, and what its realisations have in common, for replaceable "
        "components to be constrained by."
    )
    return _package("BaseClasses", f"Parameters and ports of the {what}", info, f"HystFMU.{name}")


def _package(name: str, text: str, info: str, within: str) -> str:
    made = class_text(f"package {name}", text, ["  extends Icons.Package;"], information(info), within)
    return f"{mark('the C tables')}\n{made}"


_PACKAGE = "Choices"


def enumerations() -> dict[str, str]:
    """Return the generated enumerations and their package Choices, by name inside HystFMU.

    The result is empty if the hand-written package Types contains all enumerations.
    """
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
        info = "Words of parameters, from the C tables."
        found[f"{_PACKAGE}.package"] = _package(_PACKAGE, "Choices of the blocks", info, "HystFMU")
    return found
