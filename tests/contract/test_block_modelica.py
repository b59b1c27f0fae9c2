"""Every block has a class in the Modelica library: the file with its equations, beside a generated base class."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from hystfmu.modelica.library.base_class import base_classes

ROOT = Path(__file__).parents[2]
BASES = {b.path: b for b in base_classes()}


@pytest.mark.parametrize("path", BASES)
def test_its_equations_are_there_and_extend_the_generated_base_class(path: str) -> None:
    base = BASES[path]
    file = ROOT / base.wanted
    assert file.is_file(), f"write {base.wanted}: equations that extend BaseClasses.{base.name}"
    extends = re.search(rf"^  extends BaseClasses\.{base.name}\b", file.read_text("utf-8"), re.M)
    assert extends, f"{base.wanted}: write 'extends BaseClasses.{base.name}'"
