"""A foreign FMU that cannot run here is refused in one line: the file, what is wrong, what is there, what to do."""

from __future__ import annotations

import re
import zipfile
from collections.abc import Callable
from pathlib import Path

import fmpy
import pytest

from hystfmu.base.errors import InputError
from hystfmu.fmu import export_fmu
from hystfmu.graph import Graph, Node
from hystfmu.scenario.run_fmu import run_fmu
from hystfmu.scenario.system.foreign import Foreign

Edit = Callable[[str, bytes], tuple[str, bytes] | None]
XML = "modelDescription.xml"


@pytest.fixture(autouse=True)
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("HYSTFMU_CACHE", str(tmp_path / "cache"))


def edited(folder: Path, edit: Edit, fmi: int = 2) -> Path:
    """Export a block and edit the files of the archive."""
    graph = Graph.single(Node("plays", "play_bank", {"n": 2})).with_step(1e-3)
    given, path = export_fmu(graph, folder / "given.fmu", fmi, "plays"), folder / "x.fmu"  # type: ignore[arg-type]
    with zipfile.ZipFile(given) as old, zipfile.ZipFile(path, "w") as new:
        for name in old.namelist():
            if (file := edit(name, old.read(name))) is not None:
                new.writestr(*file)
    return path


def described(old: str, new: str) -> Edit:
    """Replace what matches a pattern in the model description."""

    def edit(name: str, content: bytes) -> tuple[str, bytes]:
        if name != XML:
            return name, content
        text, n = re.subn(old, new, content.decode())
        assert n > 0
        return name, text.encode()

    return edit


def moved(to: str) -> Edit:
    """Put what is in the folder of this platform elsewhere."""
    return lambda name, content: (re.sub(r"^binaries/[^/]*/plays", f"binaries/{to}", name), content)


@pytest.mark.parametrize(
    ("edit", "there"),
    [
        (lambda n, c: None if n.startswith("binaries/") else (n, c), "it has no binaries"),
        (moved("vax64/plays"), "it has binaries for vax64"),
        (moved("{own}/other"), "there is other"),
    ],
)
@pytest.mark.parametrize("fmi", [2, 3])
def test_no_binary_for_this_platform(tmp_path: Path, edit: Edit, there: str, fmi: int) -> None:
    own = fmpy.platform if fmi == 2 else fmpy.platform_tuple
    path = edited(tmp_path, lambda n, c: (f := edit(n, c)) and (f[0].replace("{own}", own), f[1]), fmi)
    with pytest.raises(InputError) as e:
        Foreign.load(path)
    file = f"binaries/{own}/plays{fmpy.sharedLibraryExtension}"
    assert str(e.value).startswith(f"{path}: no binary for this platform: {file} is missing; {there}")
    assert str(e.value).endswith(f"Ask its maker for one for {own}.")


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('modelIdentifier="plays"', 'modelIdentifier="../../plays"', r"modelIdentifier must be the name of a file"),
        ('modelIdentifier="plays"', f'modelIdentifier="{"p" * 400}"', "no binary for this platform: .* is missing"),
        ('fmiVersion="2.0"', "", r"fmiVersion must be 1\.0, 2\.0 or 3\.0\. Got '' instead"),
        ("UTF-8", "UTF-7", "modelDescription.xml: "),
        ('valueReference="0"', 'valueReference="a"', r"\(line \d+.*valueReference': 'a' is not a valid value"),
        ('stopTime="[^"]*"', 'stopTime="soon"', r"stopTime must be a number\. Got 'soon' instead"),
        ('name="u"(.*\n.*)start="0.0"', r'name="u"\1start="zero"', r"u: the start value must be a number\. Got 'zero'"),
        ('name="u"', 'name="z_1"', r"names of their own\. 'z_1' occurs twice"),
    ],
)
def test_description_that_cannot_be_read(tmp_path: Path, old: str, new: str, message: str) -> None:
    path = edited(tmp_path, described(old, new))
    with pytest.raises(InputError, match=message) as e:
        Foreign.load(path)
    assert str(e.value).startswith(f"{path}: ")
    assert "\n" not in str(e.value)
    assert len(str(e.value)) < 600


def test_what_the_fmu_says_when_it_makes_no_instance(tmp_path: Path) -> None:
    path = edited(tmp_path, described('guid="', 'guid="another'))
    with pytest.raises(InputError, match=r"cannot be instantiated: .*The token 'another.* does not belong"):
        run_fmu(path)
