"""What follows from the C tables is up to date: page of the blocks, signatures for editors, Modelica base classes."""

import re
import shutil
from pathlib import Path, PurePath

import pytest

import generator
from generator.base_class import base_classes
from hystfmu.graph import listing

ROOT = Path(__file__).parents[2]


@pytest.mark.parametrize(
    ("file", "text"),
    [("python/hystfmu/graph/blocks.pyi", listing.stub), ("python/docs/blocks.md", lambda: listing.markdown("##"))],
    ids=["signatures", "page"],
)
def test_texts_follow_from_the_tables(file, text):
    assert text() in (ROOT / file).read_text(), f"{file} is stale; run 'make generate'"


def test_modelica_follows_from_the_tables():
    assert list(generator.stale(ROOT / "modelica" / "HystFMU")) == []


def test_a_stale_record_of_a_model_is_found(tmp_path: Path) -> None:
    root = tmp_path / "modelica" / "HystFMU"
    shutil.copytree(ROOT / "modelica", root.parent)
    for models in ("scenarios", "tests"):  # the records' models and the vectors of the Validation models
        (tmp_path / models).symlink_to(ROOT / models)
    assert generator.stale(root) == []
    file = root / "Data" / "BoucWenIdentified.mo"
    fresh = file.read_text("utf-8")
    file.write_text(fresh.replace("rms_percent = ", "rms_percent = 1", 1), "utf-8")
    assert generator.stale(root) == [PurePath("Data", "BoucWenIdentified.mo")]
    generator.write(root)
    assert file.read_text("utf-8") == fresh


# ---- Every block has a class in the Modelica library: the file with its equations, beside a generated base class
BASES = {b.equations: b for b in base_classes()}


def test_its_equations_are_there() -> None:
    missing = generator.missing(ROOT / "modelica" / "HystFMU")
    assert not missing, "\n".join(missing)


@pytest.mark.parametrize("name", BASES)
def test_its_equations_extend_the_generated_base_class(name: str) -> None:
    base = BASES[name]
    extends = re.search(rf"^  extends BaseClasses\.{base.name}\b", (ROOT / base.wanted).read_text("utf-8"), re.M)
    assert extends, f"{base.wanted}: write 'extends BaseClasses.{base.name}'"
