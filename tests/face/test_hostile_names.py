"""Names in files steer no terminal, break no XML and bring no markup into a page: every command and kind of file."""

import csv
import json
import os
import shutil
import xml.etree.ElementTree as ET
import zipfile
from collections.abc import Callable
from functools import partial
from pathlib import Path
from xml.sax.saxutils import quoteattr

import pytest
from click.testing import CliRunner

import hystfmu as hy
from hystfmu.cli import main

MARKUP = "<img src=x onerror=alert(1)>&'"
NOT_XML = {
    "colour": "\x1b[31mred\x1b[0m", "title": "\x1b]0;t\x07", "null": "a\0b", "back": "ab\x08\x08c", "delete": "\x7f",
}  # fmt: skip
HOSTILE = {
    "C1": "\x9b31mred", "C1 line": "a\x85b", "override": "\u202exe.exe\u202c", "embedding": "\u202aa\u202bb\u202dc",
    "isolate": "\u2066a\u2067b\u2068c\u2069", "mark": "\u200eu\u200f\u061c", "separator": "a\u2028b\u2029c",
    "invisible": "\ufeffa\u200bb",
}  # fmt: skip
QUIET = "Größe\u00a0µm² a\u200db" + MARKUP
OUTPUT = "".join(HOSTILE.values()) + '[1,2]"q\nPASSED'
SHOWN = "\u200d\u00a0"  # printable here, though not in Python's sense


def run(*words: object, status: tuple[int, ...] = (0,)) -> str:
    """What a command prints on both streams, which is printable."""
    done = CliRunner().invoke(main, [str(w) for w in words])
    assert isinstance(done.exception, SystemExit | None), done.exception
    assert done.exit_code in status, done.output
    return printed(done.output)


def printed(text: str) -> str:
    """The text, which has nothing that a terminal obeys."""
    assert {c for c in text if not (c.isprintable() or c in "\n" + SHOWN)} == set(), text
    return text


def refused(*words: object) -> str:
    """The one line of a command that refuses."""
    told = run(*words, status=(2,))
    assert told.count("\n") == 1, told
    return told


def well_formed(archive: Path) -> None:
    """Every XML file of an archive, and of the FMUs in it, parses; every page is quiet."""
    with zipfile.ZipFile(archive) as z:
        for name in z.namelist():
            if name.endswith((".xml", ".ssd", ".ssv")):
                ET.fromstring(z.read(name))
            elif name.endswith(".html"):
                quiet(z.read(name).decode())
            elif name.endswith(".fmu"):
                inner = archive.with_name(f"inner-{Path(name).name}")
                inner.write_bytes(z.read(name))
                well_formed(inner)


def quiet(page: str) -> None:
    """A page has nothing of a hostile name but visible text."""
    assert "<img" not in printed(page.replace("\t", " "))


def escaped(text: str) -> str:
    """A string of TOML with every character as an escape."""
    return "".join(f"\\U{ord(c):08x}" for c in text).join('""')


def raw(text: str) -> str:
    """A string of TOML that holds what it may hold as it is: C1 codes and bidirectional characters."""
    return "".join(f"\\u{ord(c):04x}" if c < " " or c in '\x7f"\\' else c for c in text).join('""')


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A record, a model, an FMU of it, a loop of both, a study of the loop, requirements."""
    folder = tmp_path_factory.mktemp("names")
    hy.synthetic.piezo(10, 200.0).to_csv(folder / "record.csv")
    hy.fit(hy.synthetic.piezo(10, 200.0), "prandtl_ishlinskii", N=3).save(folder / "m.model.toml")
    run("export", folder / "m.model.toml", "-o", folder / "m.fmu")
    loop = hy.Scenario("loop", step=1e-3, stop=0.02, text="one loop").add("source", hy.blocks.Reference(amplitude=1.0))
    loop.add("plant", folder / "m.model.toml").add("foreign", folder / "m.fmu")
    loop.connect("source.r", "plant.u").connect("source.r", "foreign.u")
    loop.metric("peak", "peak", "plant.y", limit=1e9).record("foreign.y").save(folder / "loop")
    (folder / "loop.study.toml").write_text(
        'name = "small"\nscenario = "loop"\nmethod = "grid"\n[parameters."source.amplitude"]\nvalues = [1.0]\n'
    )
    (folder / "asked.toml").write_text('name = "asked"\n')
    return folder


def test_headings_of_a_record(tmp_path: Path) -> None:
    bad = "".join(HOSTILE.values()) + QUIET
    data = hy.synthetic.piezo(10, 200.0)
    rows = "".join(f"{row}\n" for row in (f"{t};{u};{y}" for t, u, y in zip(data.t, data.u, data.y, strict=True)))
    record = tmp_path / f"{NOT_XML['colour']}{HOSTILE['override']}{os.fsdecode(bytes([255]))}.csv"
    record.write_text(f"t;{bad} u [{bad}];y {bad} [{bad}]\n{rows}", newline="")
    model = tmp_path / "m.model.toml"
    columns = ["--time", 1, "--input", 2, "--output", 3]
    words = ["fit", record, *columns, "--model", "prandtl_ishlinskii", "--set", "N=3", "-o", model]
    run(*words, "--report", tmp_path / "page")
    (page,) = (tmp_path / "page").glob("*.html")
    quiet(page.read_text())
    json.loads(run(*words, "--json"))
    made = hy.Model.load(model)
    printed(f"{made}{made!r}")
    quiet(made._repr_html_())
    for fmi in (2, 3):
        archive = tmp_path / f"m{fmi}.fmu"
        run("export", model, "--fmi", fmi, "-o", archive)
        well_formed(archive)
    for name in NOT_XML.values():  # no text at all
        record.write_text(f"t;u{name};y\n{rows}", newline="")
        refused(*words)


FILES: dict[str, tuple[str, str, Callable[[Path, Path], list[object]]]] = {
    "model": ("m.model.toml", "text", lambda file, out: ["export", file, "-o", out]),
    "unit": ("m.model.toml", "unit", lambda file, out: ["export", file, "-o", out]),
    "kind": ("m.model.toml", "key", lambda file, out: ["export", file, "--modelica", out]),
    "run": ("loop/scenario.toml", "text", lambda file, out: ["run", file, "--report", out]),
    "ssp": ("loop/scenario.toml", "name", lambda file, out: ["ssp", file, "-o", out.with_suffix(".ssp")]),
    "margins": ("loop/scenario.toml", "text", lambda file, out: ["margins", file]),
    **{
        name: ("loop/scenario.toml", "text", partial(lambda name, file, out: ["design", name, file, "-o", out], name))
        for name in ("irc", "repetitive")  # the others are of the one kind or the other
    },
    "study": ("loop.study.toml", "name", lambda file, out: ["study", file, "-o", out]),
    "start": (
        "asked.toml",
        "name",
        lambda file, out: ["start", file.with_name("record.csv"), "--requirements", file, "-o", out],
    ),
}


@pytest.mark.some(3)
@pytest.mark.parametrize("kind", FILES)
def test_keys_and_texts_of_toml(kind: str, folder: Path, tmp_path: Path) -> None:
    name, key, words = FILES[kind]
    place = tmp_path / "all"
    shutil.copytree(folder, place)
    file, out = place / name, tmp_path / "out"
    lines = file.read_text().splitlines(keepends=True)
    at = next(k for k, line in enumerate(lines) if line.startswith(f"{key} = "))
    for write in (raw, escaped):
        for bad in (NOT_XML | HOSTILE).values():
            for line in (f"{key} = {write(bad)}\n", f"{lines[at]}{write(bad)} = 1\n"):
                file.write_text("".join([*lines[:at], line, *lines[at + 1 :]]), encoding="utf-8")
                told = refused(*words(file, out))
                assert str(file) in told
                assert "printable" in told
    file.write_text("".join([*lines[:at], f'{lines[at]}"a\\nb" = 1\n', *lines[at + 1 :]]))
    refused(*words(file, out))
    assert list(tmp_path.iterdir()) == [place]


@pytest.mark.turn("a terminal")
def test_markup_in_texts_of_toml(folder: Path, tmp_path: Path) -> None:
    shutil.copytree(folder, tmp_path / "all")
    for file in (tmp_path / "all" / "m.model.toml", tmp_path / "all" / "loop" / "scenario.toml"):
        lines = [
            f"text = {raw(QUIET)}" if line.startswith("text = ") else line for line in file.read_text().splitlines()
        ]
        file.write_text("\n".join(lines))
    scenario, out = tmp_path / "all" / "loop", tmp_path / "out"
    run("run", scenario, "--report", out, "--junit", tmp_path / "junit.xml")
    assert "&lt;img" in (out / "report.html").read_text()
    quiet((out / "report.html").read_text())
    ET.parse(tmp_path / "junit.xml")
    json.loads((out / "report.json").read_text())
    json.loads(run("run", scenario, "--json"))
    run("export", tmp_path / "all" / "m.model.toml", "-o", tmp_path / "m.fmu")
    well_formed(tmp_path / "m.fmu")


def foreign(folder: Path, path: Path, outputs: bool) -> Path:
    """The FMU with hostile names and texts, as XML can hold them."""
    bad = "".join(HOSTILE.values()) + QUIET
    with zipfile.ZipFile(folder / "m.fmu") as old, zipfile.ZipFile(path, "w") as new:
        for name in old.namelist():
            content = old.read(name)
            if name == "modelDescription.xml":
                root = ET.fromstring(content)
                for element in root.iter():
                    for key in set(element.attrib) & {"description", "author", "generationTool"}:
                        element.set(key, f"{bad}\nPASSED")
                    unit = "name" if element.tag == "Unit" else "unit"
                    if unit in element.attrib:
                        element.set(unit, f"{element.get(unit)}{bad}\nPASSED")
                root.set("modelName", f"{bad}\nPASSED")
                names = [v for v in root.iter("ScalarVariable") if v.get("causality") == "parameter"]
                names[0].set("name", f"{bad}\nPASSED")
                if outputs:
                    (y,) = (v for v in root.iter("ScalarVariable") if v.get("causality") == "output")
                    y.set("name", OUTPUT)
                content = ET.tostring(root)
            new.writestr(name, content)
    return path


@pytest.mark.stress
def test_names_of_an_fmu(folder: Path, tmp_path: Path) -> None:
    unsaid = foreign(folder, tmp_path / "unsaid.fmu", outputs=True)
    told = run("simulate", unsaid, "--step", "1e-3", "--stop", "0.01", "-o", tmp_path / "out.csv")
    assert not any(line.startswith("PASSED") for line in told.splitlines())
    with (tmp_path / "out.csv").open(newline="") as f:
        assert [len(row) for row in csv.reader(f)] == [2] * 12
    json.loads(run("simulate", unsaid, "--step", "1e-3", "--stop", "0.01", "--json"))
    strange = foreign(folder, tmp_path / "m.fmu", outputs=False)
    told = run("validate", strange, status=(0, 1))
    assert not any(line.startswith("PASSED") for line in told.splitlines())
    run("simulate", strange, "--set", f"{HOSTILE['C1']}=1", status=(2,))
    shutil.copytree(folder, tmp_path / "all")
    shutil.copy(strange, tmp_path / "all" / "loop" / "m.fmu")
    scenario, out = tmp_path / "all" / "loop", tmp_path / "out"
    run("run", scenario, "--report", out)
    quiet((out / "report.html").read_text())
    run("margins", scenario, status=(0, 1, 2))
    for made in (tmp_path / "loop.ssp", tmp_path / "loop.fmu"):
        run("ssp", scenario, "-o", made, status=(0, 1))  # 1: its coupling costs more than the tolerance
        well_formed(made)
    run("simulate", tmp_path / "loop.ssp")


@pytest.mark.stress
def test_names_of_an_ssp_archive(folder: Path, tmp_path: Path) -> None:
    made, renamed = tmp_path / "loop.ssp", tmp_path / "renamed.ssp"
    run("ssp", folder / "loop", "--separate", "-o", made, status=(0, 1))
    bad = "".join(HOSTILE.values()) + QUIET
    for renames in (("plant", "loop"), ("resources/plant.fmu",)):
        with zipfile.ZipFile(made) as z, zipfile.ZipFile(renamed, "w") as new:
            for name in z.namelist():
                content = z.read(name)
                for old in renames if name.endswith(".ssd") else ():
                    assert f'"{old}"'.encode() in content
                    content = content.replace(f'"{old}"'.encode(), quoteattr(f"{bad}\n{old}").encode())
                new.writestr(name, content)
        told = run("simulate", renamed, status=(0, 1, 2))
        assert not any(line.startswith(renames) for line in told.splitlines())


@pytest.mark.parametrize("words", [
    *("fit {}", "export {}", "validate {}", "run {}", "study {}", "{}", "fit --{}", "compare {} {}"),
    *("design {}", "design irc {}", "design repetitive {}", "design pi --{}"),
])  # fmt: skip
def test_words_of_the_command_line(words: str, tmp_path: Path) -> None:
    for bad in (*NOT_XML.values(), *HOSTILE.values(), "a\nb", os.fsdecode(bytes([255, 27]))):
        if "\0" not in bad:  # the system hands no such word on
            refused(*(w.format(tmp_path / bad if w == "{}" else bad) for w in words.split()))
