"""`export_fmu` writes small, reproducible files; `validate` finds defects of untrusted files."""

import io
import os
import re
import shutil
import time
import xml.etree.ElementTree as ET
import zipfile
from collections.abc import Callable
from contextlib import closing
from pathlib import Path
from typing import Any

import pytest
import tomli_w
from bad_fmu import DESCRIPTION, bad_fmu
from click.testing import CliRunner
from fmu_master import loop, single
from invoked import invoked
from users import User

import hystfmu as hy
from hystfmu.base.errors import InputError
from hystfmu.cli import main
from hystfmu.fmu import export_fmu
from hystfmu.fmu.archive import archive_problems
from hystfmu.model import Model
from hystfmu.scenario import Cases, build

XML = "modelDescription.xml"


@pytest.fixture(scope="module")
def good(tmp_path_factory: pytest.TempPathFactory) -> dict[int, bytes]:
    folder = tmp_path_factory.mktemp("good")
    return {n: export_fmu(single("prandtl_ishlinskii"), folder / f"{n}.fmu", n).read_bytes() for n in (2, 3)}  # type: ignore[arg-type]


def _rewrite(
    content: bytes, change: Callable[[str, bytes], bytes | None], more: dict[str, bytes] | None = None
) -> bytes:
    """Rewrite an archive with entries changed, removed (None) or added."""
    out = io.BytesIO()
    with zipfile.ZipFile(io.BytesIO(content)) as old, zipfile.ZipFile(out, "w", zipfile.ZIP_DEFLATED) as new:
        for e in old.infolist():
            b = change(e.filename, old.read(e))
            if b is not None:
                new.writestr(e.filename, b)
        for name, b in (more or {}).items():
            new.writestr(name, b)
    return out.getvalue()


def _same(_: str, b: bytes) -> bytes:
    return b


# ---- export ---------------------------------------------------------------------------------------------------------
def test_export_is_fast_small_and_repeatable(tmp_path: Path) -> None:
    graph = loop()
    first = export_fmu(graph, tmp_path / "a.fmu").read_bytes()
    fastest = min(_seconds(lambda: export_fmu(graph, tmp_path / "b.fmu")) for _ in range(5))
    assert (tmp_path / "b.fmu").read_bytes() == first
    assert len(first) <= 150_000
    assert fastest <= 0.25, "5 to 10 ms on an idle machine"


def _seconds(f: Callable[[], object]) -> float:
    begin = time.perf_counter()
    f()
    return time.perf_counter() - begin


@pytest.mark.turn("good FMUs")
@pytest.mark.some(1)
@pytest.mark.usefixtures("fmutool_or_not")
def test_export_of_a_model(tmp_path: Path, fmi: int) -> None:
    model = Model("zhao-tan 1", single("prandtl_ishlinskii"), 1e-4, "one line for a reader")
    path = export_fmu(model, tmp_path / "m.fmu", fmi)  # type: ignore[arg-type]
    root = ET.fromstring(zipfile.ZipFile(path).read(XML))
    assert root.get("modelName") == "zhao-tan 1"
    assert root.find("CoSimulation").get("modelIdentifier") == "zhao_tan_1"  # type: ignore[union-attr]
    assert root.get("description") == "one line for a reader"
    assert root.find("DefaultExperiment").get("stepSize") == "0.0001"  # type: ignore[union-attr]
    assert hy.validate(path) == []


@pytest.mark.parametrize("name", ["", " ", "a\nb", "\x1b[31m", "a\u202eb"])
def test_export_refuses_names(tmp_path: Path, name: str) -> None:
    with pytest.raises(InputError, match="The FMU name must be printable text"):
        export_fmu(single("sum"), tmp_path / "x.fmu", name=name)
    assert list(tmp_path.iterdir()) == []


def test_export_refuses_versions_and_places(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"The FMI version must be 2 or 3\. Got 1 instead\."):
        export_fmu(single("sum"), tmp_path / "x.fmu", 1)  # type: ignore[arg-type]
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match="cannot be written"):
        export_fmu(single("sum"), tmp_path / "file" / "x.fmu")


@pytest.mark.parametrize("stop", [0.0, -1.0, float("inf"), float("nan")])
def test_export_refuses_an_experiment_without_end(tmp_path: Path, stop: float) -> None:
    with pytest.raises(
        InputError, match=r"The stop time of the default experiment must be a float in \(0, inf\)\. Got"
    ):
        export_fmu(single("sum"), tmp_path / "x.fmu", stop=stop)


# ---- description ----------------------------------------------------------------------------------------------------


def test_what_the_table_says_stands_in_the_description(tmp_path: Path, fmi: int) -> None:
    """Unit, bounds, text, variability of every variable; enumeration items with the core's values 0, 1, ..."""
    graph = single("reference")
    root = ET.fromstring(zipfile.ZipFile(export_fmu(graph, tmp_path / "x.fmu", fmi)).read(XML))  # type: ignore[arg-type]
    variables = {v.get("name"): v for v in root.find("ModelVariables") or ()}
    for p in graph.ports:
        v = variables[p.scalar_names[0] if fmi == 2 else p.name]
        kind = v[0] if fmi == 2 else v
        assert v.get("description") == p.text
        assert v.get("valueReference") == str(p.reference)
        if p.var.type == "real":
            assert kind.get("unit") == p.unit
            assert float(kind.get("min", "-inf")) == p.var.lo
            assert float(kind.get("max", "inf")) == p.var.hi
        if p.kind in ("param", "fixed"):
            assert v.get("variability") == ("tunable" if p.kind == "param" else "fixed")
    shape = graph.port("shape").var
    items = root.findall("TypeDefinitions/SimpleType/Enumeration/Item" if fmi == 2 else ".//EnumerationType/Item")
    assert [(i.get("name"), i.get("value")) for i in items] == [(w, str(k)) for k, w in enumerate(shape.choices)]
    units = {u.get("name"): u for u in root.find("UnitDefinitions") or ()}
    assert units["Hz"].find("BaseUnit").attrib == {"s": "-1"}  # type: ignore[union-attr]


def test_arrays_are_native_in_fmi3(tmp_path: Path) -> None:
    graph = single("prandtl_ishlinskii")
    root = ET.fromstring(zipfile.ZipFile(export_fmu(graph, tmp_path / "x.fmu", 3)).read(XML))
    r = next(v for v in root.find("ModelVariables") or () if v.get("name") == "r")
    assert r.find("Dimension").get("start") == "10"  # type: ignore[union-attr]
    assert [float(x) for x in str(r.get("start")).split()] == list(graph.port("r").start)


# ---- check ----------------------------------------------------------------------------------------------------------
@pytest.mark.turn("good FMUs")
@pytest.mark.some(1)
def test_good_ones_have_no_problems(tmp_path: Path, good: dict[int, bytes], fmi: int) -> None:
    path = tmp_path / "Größe 1.fmu"
    path.write_bytes(good[fmi])
    assert hy.validate(path) == []


def test_not_there(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="No such file"):
        hy.validate(tmp_path / "x.fmu")


def _problems(tmp_path: Path, content: bytes) -> list[str]:
    path = tmp_path / "x.fmu"
    path.write_bytes(content)
    outside = sorted(p.name for p in tmp_path.parent.iterdir())
    problems = hy.validate(path, seconds=20)
    assert sorted(p.name for p in tmp_path.parent.iterdir()) == outside, "written outside of the folder"
    assert all("\n" not in p for p in problems)
    return problems


@pytest.mark.parametrize("again", ["./resources/block.bin", "resources//block.bin", "resources/./block.bin"])
def test_a_file_under_two_names(tmp_path: Path, good: dict[int, bytes], again: str) -> None:
    """The second would replace the first, which the checks have seen."""
    problems = _problems(tmp_path, _rewrite(good[2], _same, {again: b"x"}))
    assert problems == ["'resources/block.bin' occurs in the archive more than once"]


def test_names_that_differ_in_case_where_the_system_does_not_tell(
    tmp_path: Path, good: dict[int, bytes], monkeypatch: pytest.MonkeyPatch
) -> None:
    truly = Path.open

    def of_windows(path: Path, mode: str = "r", *more: object) -> object:
        return truly(path.parent / path.name.lower(), mode, *more)  # type: ignore[call-overload]

    content = _rewrite(good[2], _same, {"resources/BLOCK.bin": b"x"})
    monkeypatch.setattr(Path, "open", of_windows)
    assert _problems(tmp_path, content) == ["'resources/BLOCK.bin' cannot be unpacked: File exists"]


def test_names_from_the_top_as_some_tools_write_them(tmp_path: Path, good: dict[int, bytes]) -> None:
    out = io.BytesIO()
    with zipfile.ZipFile(io.BytesIO(good[2])) as old, zipfile.ZipFile(out, "w") as new:
        for name in old.namelist():
            new.writestr(f"./{name}", old.read(name))
    with zipfile.ZipFile(out) as archive:
        assert archive_problems(archive) == []


def test_description_in_a_folder_or_spelt_otherwise(tmp_path: Path, good: dict[int, bytes]) -> None:
    for place in (f"x/{XML}", "ModelDescription.xml"):
        moved = _rewrite(good[2], lambda n, b: None if n == XML else b, {place: b"<a/>"})
        (problem,) = _problems(tmp_path, moved)
        assert problem == f"the archive has no {XML}; it has {place!r}: the file must be at the top, spelt like this"


def test_a_name_without_end_is_cut_in_the_message(tmp_path: Path, good: dict[int, bytes]) -> None:
    (problem,) = _problems(tmp_path, _rewrite(good[2], _same, {"r/" * 3000 + "x": b"x"}))
    assert len(problem) < 200


@pytest.mark.turn("broken descriptions")
def test_xml_that_only_the_fmu_reads(tmp_path: Path, good: dict[int, bytes]) -> None:
    """Settings of Java have a document type, tools of Windows write UTF-16."""
    kind = b'<!DOCTYPE properties SYSTEM "http://java.sun.com/dtd/properties.dtd"><properties/>'
    files = {
        "resources/log.xml": kind,
        "resources/a/settings.xml": "<?xml version='1.0' encoding='UTF-16'?><a/>".encode("utf-16"),
        "documentation/page.xml": kind,
        "extra/org.example/x.xml": kind,
    }
    assert _problems(tmp_path, _rewrite(good[3], _same, files)) == []
    (problem,) = _problems(tmp_path, _rewrite(good[3], lambda n, b: kind if "terminals" in n else b))
    assert problem == "terminalsAndIcons/terminalsAndIcons.xml must not declare a document type or entities"


def _xml(old: bytes, new: bytes) -> Callable[[str, bytes], bytes]:
    def change(name: str, b: bytes) -> bytes:
        assert name != XML or old in b
        return b.replace(old, new, 1) if name == XML else b

    return change


@pytest.mark.turn("broken descriptions")
@pytest.mark.some(1)
@pytest.mark.usefixtures("fmutool_or_not")
def test_description_that_does_not_fit(tmp_path: Path, good: dict[int, bytes], fmi: int) -> None:
    token = single("prandtl_ishlinskii").token.encode()
    (problem,) = _problems(tmp_path, _rewrite(good[fmi], _xml(token, b"other")))
    assert problem.startswith("the FMU cannot be instantiated: ")
    start = {2: b'start="0.3"', 3: b'start="0.3"'}[fmi]
    (problem,) = _problems(tmp_path, _rewrite(good[fmi], _xml(start, b'start="0.4"')))
    assert problem == "w0: the start value is 0.4, but the binary has 0.3"
    not_xml = _problems(tmp_path, _rewrite(good[fmi], lambda n, b: b"<" if n == XML else b))
    assert not_xml
    assert all("XML" in p or "xml" in p for p in not_xml)


# ---- The cache of unpacked FMUs: what is damaged is unpacked anew, what is old goes, and a run works without one
RUN = ["--step", "1e-3", "--stop", "0.01", "-o", "out.csv"]
DAY = 86400.0
LOOP: dict[str, Any] = {
    "name": "loop", "step": 1e-3, "stop": 0.01, "order": ["unit"], "units": {"unit": {"fmu": "x.fmu"}},
    "metrics": {"last": {"kind": "final", "signal": "unit.y"}},
}  # fmt: skip


@pytest.fixture
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("HYSTFMU_CACHE", str(tmp_path / "cache"))
    monkeypatch.chdir(tmp_path)
    return tmp_path / "cache"


def unpacks(fmu: Path) -> Path:
    """Make a scenario of an FMU; the folder in which it is unpacked."""
    folder = fmu.with_suffix("")
    folder.mkdir(exist_ok=True)
    (folder / "scenario.toml").write_text(tomli_w.dumps(LOOP))
    shutil.copy(fmu, folder / "x.fmu")
    graph: Any = build(Cases(folder).cases[0]).parts[0].graph
    return Path(graph.folder)


def files(folder: Path) -> dict[str, bytes]:
    return {p.relative_to(folder).as_posix(): p.read_bytes() for p in folder.rglob("*") if p.is_file()}


def packed(fmu: Path) -> dict[str, bytes]:
    with zipfile.ZipFile(fmu) as archive:
        return {name: archive.read(name) for name in archive.namelist()}


def small(path: Path, word: str) -> Path:
    """An FMU that differs in a word from others, with a binary that is never loaded."""
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("modelDescription.xml", DESCRIPTION)
        archive.writestr("resources/word.txt", word)
        for platform in ("linux64", "win64", "darwin64"):
            archive.writestr(f"binaries/{platform}/bad.{'dll' if platform == 'win64' else 'so'}", "")
            archive.writestr(f"binaries/{platform}/bad.dylib", "")
    return path


@pytest.mark.turn("broken descriptions")
def test_a_truncated_binary_is_replaced(cache: Path) -> None:
    bad_fmu(Path("x.fmu"))
    first = invoked(["simulate", "x.fmu", *RUN])
    out = Path("out.csv").read_bytes()
    (binary,) = cache.rglob("bad.so")
    os.truncate(binary, 1000)
    again = CliRunner().invoke(main, ["simulate", "x.fmu", *RUN])
    assert (again.exit_code, again.output) == (0, first.output)
    assert Path("out.csv").read_bytes() == out


DAMAGES: dict[str, Callable[[Path], object]] = {
    "missing": lambda f: (f / "resources" / "word.txt").unlink(),
    "other byte": lambda f: (f / "resources" / "word.txt").write_text("wore"),
    "added": lambda f: (f / "resources" / "more.so").touch(),
    "link": lambda f: ((f / "modelDescription.xml").rename("kept"), (f / "modelDescription.xml").symlink_to("kept")),
    "link to a folder": lambda f: ((f / "resources").rename("kept"), (f / "resources").symlink_to(f / "kept")),
    "no folder": lambda f: (shutil.rmtree(f), f.touch()),
    "hashes": lambda f: [os.truncate(p, 3) for p in f.parent.rglob("*.json")],
    "no hashes": lambda f: [p.unlink() for p in f.parent.rglob("*.json")],
    "hashes of another kind": lambda f: [p.write_text("[1]") for p in f.parent.rglob("*.json")],
}


@pytest.mark.parametrize("damage", DAMAGES)
def test_damage_is_found_and_repaired(damage: str, cache: Path) -> None:
    fmu = small(Path("x.fmu"), "word")
    folder = unpacks(fmu)
    assert cache in folder.parents
    assert files(folder) == packed(fmu)
    inode = (folder / "modelDescription.xml").stat().st_ino
    assert unpacks(fmu) == folder
    assert (folder / "modelDescription.xml").stat().st_ino == inode  # used as it is
    DAMAGES[damage](folder)
    assert files(unpacks(fmu)) == packed(fmu)
    assert len(list(cache.iterdir())) == 1


def aged(folder: Path, days: float) -> Path:
    """The entry of the cache that holds a folder, last used some days ago."""
    entry = next(p for p in (folder, *folder.parents) if p.parent == Path(os.environ["HYSTFMU_CACHE"]))
    os.utime(entry, (time.time() - days * DAY,) * 2)
    return entry


def test_what_was_not_used_for_long_goes(cache: Path) -> None:
    old, used, young = (aged(unpacks(small(Path(f"{n}.fmu"), f"{n}")), n) for n in (100, 101, 5))
    unpacks(Path("101.fmu"))  # which makes it young
    own = cache / "notes"
    own.mkdir()
    (cache / "a.txt").touch()
    left = cache / ".unpack-killed"
    left.mkdir()
    for path in (own, cache / "a.txt", left):
        os.utime(path, (0, 0))
    unpacks(small(Path("new.fmu"), "new"))
    assert not old.exists()
    assert not left.exists()
    assert used.exists()
    assert young.exists()
    assert own.exists()  # files of others in this folder stay
    assert (cache / "a.txt").exists()


def test_the_largest_cache_loses_what_was_used_longest_ago(cache: Path) -> None:
    """Files with holes take no room on the disk, but count."""
    entries = {n: aged(unpacks(small(Path(f"{n}.fmu"), f"{n}")), n) for n in (0.1, 3, 4, 5)}
    for n in (0.1, 3, 4):
        word = next(entries[n].rglob("word.txt"))
        os.truncate(word, 3 * 2**29)
        aged(word, n)
    unpacks(small(Path("new.fmu"), "new"))
    assert [n for n, entry in entries.items() if entry.exists()] == [0.1, 3]
    os.truncate(next(entries[0.1].rglob("word.txt")), 2**40)
    unpacks(small(Path("newer.fmu"), "newer"))
    assert entries[0.1].exists()  # a run may still use it


def test_a_cache_that_cannot_be_a_folder(cache: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    cache.touch()
    monkeypatch.setenv("HYSTFMU_CACHE", str(cache / "inside"))
    fmu = small(Path("x.fmu"), "word")
    folder = unpacks(fmu)
    assert files(folder) == packed(fmu)
    assert unpacks(fmu) == folder
    (folder / "resources" / "word.txt").unlink()
    assert files(unpacks(fmu)) == packed(fmu)


@pytest.mark.stress
@pytest.mark.parametrize("name", [pytest.param("root", marks=pytest.mark.stress), "user"])
def test_a_cache_that_cannot_be_written(name: str) -> None:
    with closing(User(name)) as user:
        runs_without(user)


def runs_without(user: User) -> None:
    """The run leaves nothing behind.  Root writes everywhere: its cache lies where no folder can be made."""
    bad_fmu(user.folder / "x.fmu")
    user.give(user.folder)
    place = user.folder / "cache"
    place.mkdir(mode=0o555)
    variable = "/proc/hystfmu" if user.root else str(place)
    code = "from hystfmu.cli import main; main()"
    told = user.python("-c", code, "simulate", "x.fmu", *RUN, HYSTFMU_CACHE=variable)
    assert told.returncode == 0, told.stderr
    assert told.stderr == ""
    assert not [p for p in user.folder.iterdir() if p.name.startswith("hystfmu-")]  # where its temporary folders are
    assert list(place.iterdir()) == []


def test_a_bad_archive_is_refused_with_and_without_a_cache(cache: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    Path("x.fmu").write_bytes(b"PK")
    for place in (cache, Path("x.fmu") / "inside"):
        monkeypatch.setenv("HYSTFMU_CACHE", str(place))
        with pytest.raises(InputError, match="not a ZIP archive, or truncated"):
            unpacks(Path("x.fmu"))
    assert not cache.exists() or list(cache.iterdir()) == []


@pytest.mark.parametrize(("method", "mark", "at", "message"), [
    (zipfile.ZIP_LZMA, b"PK\3\4", 70, "'modelDescription.xml' cannot be unpacked: Corrupt input data"),
    (zipfile.ZIP_STORED, b"PK\1\2", 6, "not a ZIP archive, or truncated (zip file version 20.4)"),
])  # fmt: skip
def test_damage_of_every_method_is_one_line(cache: Path, method: int, mark: bytes, at: int, message: str) -> None:
    with zipfile.ZipFile("x.fmu", "w", method) as archive:
        archive.writestr("modelDescription.xml", DESCRIPTION)
    content = bytearray(Path("x.fmu").read_bytes())
    content[content.index(mark) + at] = 204
    Path("x.fmu").write_bytes(content)
    with pytest.raises(InputError, match=re.escape(message)):
        unpacks(Path("x.fmu"))
