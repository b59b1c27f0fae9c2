"""Every block has a class in the Modelica library: the file with its equations, beside a generated base class."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

import generator
from generator.base_class import base_classes

ROOT = Path(__file__).parents[2]
BASES = {b.equations: b for b in base_classes()}


def test_its_equations_are_there() -> None:
    missing = generator.missing(ROOT / "modelica" / "HystFMU")
    assert not missing, "\n".join(missing)


@pytest.mark.parametrize("name", BASES)
def test_its_equations_extend_the_generated_base_class(name: str) -> None:
    base = BASES[name]
    extends = re.search(rf"^  extends BaseClasses\.{base.name}\b", (ROOT / base.wanted).read_text("utf-8"), re.M)
    assert extends, f"{base.wanted}: write 'extends BaseClasses.{base.name}'"
