"""Where a binary finds its block file, and what it says of one that is missing, damaged or of another FMU."""

from __future__ import annotations

import ctypes as C
import os
import shutil
from pathlib import Path

import pytest
from fmu_master import ERROR, Master, rows, single

U = rows(single("prandtl_ishlinskii"))[:, 0]


def _spellings(resources: Path, fmi: int) -> list[str]:
    uri = resources.as_uri()
    return [
        uri,
        uri + "/",
        uri.replace("file://", "file:"),
        uri.replace("file:///", "file://localhost/"),
        uri.replace("file:///", "FILE:///"),
        uri.replace("file:///", "File:/"),
        uri.replace("file:///", "FILE://LOCALHOST/"),
        uri.replace("file:///", "file://LocalHost/"),
        "FILE://" + "".join(f"%{b:02x}" if b != ord("/") else "/" for b in str(resources).encode()),
        str(resources),
    ]


def test_paths_with_spaces_and_non_ascii(tmp_path: Path, fmi: int) -> None:
    folder = tmp_path / "Größe 50% µm #1 日本"
    m = Master(single("prandtl_ishlinskii"), folder, fmi)
    resources = m.resources
    m.free()
    plain = [str(resources), f"{resources}/"]
    for location in [*plain, *(_spellings(resources, fmi))]:
        m = Master(single("prandtl_ishlinskii"), folder, fmi, location=location)
        assert m.c.value, (location, m.messages)
        m.free()


@pytest.mark.parametrize(
    ("location", "sentence"),
    [
        ("file:///no/such/folder", "cannot read '/no/such/folder/block.bin'"),
        ("/no/such/folder/", "cannot read '/no/such/folder/block.bin'"),
        ("file:///a%zz", "the resource location has a malformed % escape: 'file:///a%zz'"),
        ("file:///a%00b", "the resource location has a malformed % escape: 'file:///a%00b'"),
        ("file:///a%4", "the resource location has a malformed % escape: 'file:///a%4'"),
        ("file://server/a", "the resource location names another machine: 'file://server/a'"),
        ("FILE://LOCALHOSTS/a", "the resource location names another machine: 'FILE://LOCALHOSTS/a'"),
        ("files:/a", "cannot read 'files:/a/block.bin'"),
        ("file:a/b", "cannot read 'a/b/block.bin'"),
        ("file:no/such", "cannot read 'no/such/block.bin'"),
        ("file:a//localhost/b", "cannot read 'a//localhost/b/block.bin'"),
        ("file:/a//b", "cannot read '/a//b/block.bin'"),
        ("file:/", "cannot read '/block.bin'"),
        ("file:///", "cannot read '/block.bin'"),
        ("file://localhost/", "cannot read '/block.bin'"),
        ("file://a", "the resource location names another machine: 'file://a'"),
        ("file:/%41%5a%61%7A%30%39", "cannot read '/AZaz09/block.bin'"),
        ("file:/%4g", "the resource location has a malformed % escape: 'file:/%4g'"),
        ("file:/%4G", "the resource location has a malformed % escape: 'file:/%4G'"),
        ("file:/%/a", "the resource location has a malformed % escape: 'file:/%/a'"),
        ("file:/%:0", "the resource location has a malformed % escape: 'file:/%:0'"),
        ("file:/%@0", "the resource location has a malformed % escape: 'file:/%@0'"),
        ("file:/%`0", "the resource location has a malformed % escape: 'file:/%`0'"),
        ("/a%41", "cannot read '/a%41/block.bin'"),
        ("no/such", "cannot read 'no/such/block.bin'"),
    ],
)
def test_bad_location(folder: Path, fmi: int, location: str, sentence: str) -> None:
    graph = single("prandtl_ishlinskii")
    m = Master(graph, folder / graph.token, fmi, location=location)
    assert not m.c.value
    said = sentence.replace("%", "%%") if fmi == 2 else sentence  # FMI 2.0 messages are printf formats
    assert m.messages == [(ERROR, "logStatusError", said)]


NOWHERE = [None, b"", b"file:", b"FILE://", b"file://LocalHost"]


@pytest.mark.parametrize("location", NOWHERE)
def test_a_binary_finds_its_own_resources(tmp_path: Path, fmi: int, location: bytes | None) -> None:
    m = Master(single("prandtl_ishlinskii"), tmp_path / "Größe 50% µm #1 日本", fmi)
    m.initialize()
    want = m.run(U[:20])
    m.free()
    m.c = m.instantiate(location)
    assert m.c.value, m.messages
    m.initialize()
    assert m.run(U[:20]) == want
    m.free()


@pytest.mark.parametrize("location", NOWHERE)
def test_a_binary_that_has_left_its_fmu(tmp_path: Path, fmi: int, location: bytes | None) -> None:
    m = Master(single("prandtl_ishlinskii"), tmp_path, fmi)
    m.free()
    alone = tmp_path / "a" / "b" / "alone.so"
    alone.parent.mkdir(parents=True)
    shutil.copy(m.lib._name, alone)
    m.lib = C.CDLL(str(alone))
    assert not m.instantiate(location).value
    assert m.messages == [(ERROR, "logStatusError", f"cannot read '{alone.parent}/../../resources/block.bin'")]


@pytest.mark.parametrize("damage", ["cut", "flip", "empty", "version", "huge"])
def test_damaged_block_file(tmp_path: Path, fmi: int, damage: str) -> None:
    m = Master(single("prandtl_ishlinskii"), tmp_path, fmi)
    m.free()
    file = m.resources / "block.bin"
    content = bytearray(file.read_bytes())
    if damage == "cut":
        del content[-3:]
    elif damage == "flip":
        content[-1] ^= 1
    elif damage == "empty":
        content.clear()
    else:
        content[8] += damage == "version"
    file.write_bytes(content)
    if damage == "huge":
        os.truncate(file, 2**30 + 1)  # takes no room on the disk, and must take none in memory
    m = Master(single("prandtl_ishlinskii"), tmp_path, fmi)
    assert not m.c.value
    assert len(m.messages) == 1
    expected = {"cut": "length", "flip": "checksum", "version": "version"}.get(damage, "cannot read")
    assert expected in m.messages[0][2]
