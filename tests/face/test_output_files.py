"""Files that commands write: links, modes and special files stay what they are; a missing folder is told first."""

from __future__ import annotations

import os
import stat
import sys
from pathlib import Path

import pytest
from click.testing import CliRunner

from hystfmu import InputError
from hystfmu.base.files import read_bytes, write_bytes
from hystfmu.cli import main

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="links, modes and pipes of POSIX")
OUTPUTS = ["fit x.csv -o", "predict m x.csv -o", "inverse m -o", "export delay -o", "compare a b -o"]
OUTPUTS += ["run s -o", "ssp s -o"]


@pytest.mark.parametrize("command", OUTPUTS)
def test_a_missing_folder_is_told_before_anything_runs(command: str, tmp_path: Path) -> None:
    out = tmp_path / "missing" / "x"
    done = CliRunner().invoke(main, [*command.split(), str(out)])
    told = f"hystfmu: {out}: cannot be written: there is no folder {out.parent}\n"
    assert (done.exit_code, done.stderr) == (2, told)
    assert not out.parent.exists()


def test_a_link_stays_and_its_file_is_written(tmp_path: Path) -> None:
    (tmp_path / "there").mkdir()
    link, file = tmp_path / "link", tmp_path / "there" / "file"
    link.symlink_to(file)
    for content in (b"new", b"changed"):
        write_bytes(link, content)
        assert link.is_symlink()
        assert file.read_bytes() == content
    assert os.listdir(file.parent) == ["file"]


@pytest.mark.parametrize("umask", [0o022, 0o077, 0o002])
def test_a_new_file_follows_the_umask_and_an_old_one_keeps_its_mode(umask: int, tmp_path: Path) -> None:
    before = os.umask(umask)
    try:
        write_bytes(tmp_path / "new", b"1")
        write_bytes(tmp_path / "old", b"1")
        (tmp_path / "old").chmod(0o640)
        write_bytes(tmp_path / "old", b"2")
    finally:
        os.umask(before)
    modes = [stat.S_IMODE((tmp_path / name).stat().st_mode) for name in ("new", "old")]
    assert modes == [0o666 & ~umask, 0o640]


def test_pipes_devices_and_read_only_files_are_refused(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    write_bytes(tmp_path / "protected", b"kept")
    (tmp_path / "protected").chmod(0o444)
    (tmp_path / "null").symlink_to("/dev/null")
    for name, why in [("pipe", "device, pipe"), ("protected", "read-only"), ("null", "device, pipe")]:
        with pytest.raises(InputError, match=f"{name}: cannot be written: it is .*{why}"):
            write_bytes(tmp_path / name, b"lost")
        done = CliRunner().invoke(main, ["export", "delay", "--step", "1e-3", "-o", str(tmp_path / name)])
        assert (done.exit_code, len(done.stderr.splitlines())) == (2, 1)
    assert (tmp_path / "protected").read_bytes() == b"kept"
    assert sorted(os.listdir(tmp_path)) == ["null", "pipe", "protected"]


@pytest.mark.parametrize(
    "command",
    ["fit IN -o m", "predict IN x -o y", "export IN.toml -o x", "validate IN", "run IN.toml", "simulate IN.ssp"],
)
def test_a_pipe_as_input_is_refused_and_not_waited_for(command: str, tmp_path: Path) -> None:
    source = tmp_path / "in"
    for suffix in ("", ".toml", ".ssp"):
        os.mkfifo(f"{source}{suffix}")
    done = CliRunner().invoke(main, command.replace("IN", str(source)).split())
    assert done.exit_code in (1, 2)
    assert "regular file" in done.output


def test_a_file_is_read_up_to_the_bound_even_if_its_stated_size_is_none() -> None:
    proc = Path("/proc/self/maps")  # a regular file of size 0 with some kB
    if not proc.exists():
        pytest.skip("needs /proc")
    with pytest.raises(InputError, match="at most 100 bytes"):
        read_bytes(proc, 100)
