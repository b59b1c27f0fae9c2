"""The cache of unpacked FMUs: what is damaged is unpacked anew, what is old goes, and a run works without one."""

import os
import shutil
import time
import zipfile
from collections.abc import Callable
from contextlib import closing
from pathlib import Path
from typing import Any

import pytest
import tomli_w
from bad_fmu import DESCRIPTION, bad_fmu
from click.testing import CliRunner
from users import User

from hystfmu.base.errors import InputError
from hystfmu.cli import main
from hystfmu.scenario import Cases, build

RUN = ["--step", "1e-3", "--stop", "0.01", "-o", "out.csv"]
DAY = 86400.0
LOOP: dict[str, Any] = {
    "name": "loop",
    "step": 1e-3,
    "stop": 0.01,
    "order": ["unit"],
    "units": {"unit": {"fmu": "x.fmu"}},
    "metrics": {"last": {"kind": "final", "signal": "unit.y"}},
}


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


def test_a_truncated_binary_is_replaced(cache: Path) -> None:
    bad_fmu(Path("x.fmu"))
    first = CliRunner().invoke(main, ["simulate", "x.fmu", *RUN])
    assert first.exit_code == 0, first.output
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
