"""A finished step is not repeated; another input, another name, a changed file or a damaged record make it anew."""

from pathlib import Path
from typing import Any

import pytest

from hystfmu.base import steps as module
from hystfmu.base.steps import RECORD, Steps


def run(folder: Path, *inputs: Any, name: str = "fit") -> tuple[bool, Any]:
    """Run a step that writes a file; return whether it ran, and its value."""
    ran = []

    def make() -> list[Any]:
        ran.append(1)
        (folder / f"{name}.txt").write_text("made")
        return ["value", 1.5]

    steps = Steps(folder)
    value = steps.run(name, inputs, [folder / f"{name}.txt"], make)
    assert steps.kept == ([] if ran else [name])
    return bool(ran), value


def test_a_finished_step_is_not_repeated_and_gives_its_value(tmp_path: Path) -> None:
    assert run(tmp_path, "data", 1) == (True, ["value", 1.5])
    assert run(tmp_path, "data", 1) == (False, ["value", 1.5])
    assert run(tmp_path, "data", 1, name="other")[0]
    assert not run(tmp_path, "data", 1)[0], "another step keeps it"


def test_other_inputs_make_it_anew(tmp_path: Path) -> None:
    run(tmp_path, "data", 1)
    assert run(tmp_path, "data", 2)[0]
    assert run(tmp_path, "data", 1)[0], "the file is that of the last run"


def test_another_package_makes_it_anew(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    run(tmp_path)
    monkeypatch.setattr(module, "_package", lambda: "newer")
    assert run(tmp_path)[0]


@pytest.mark.parametrize("damage", ["changed", "gone"])
def test_a_damaged_file_is_made_anew(damage: str, tmp_path: Path) -> None:
    run(tmp_path)
    path = tmp_path / "fit.txt"
    path.unlink() if damage == "gone" else path.write_text("mode")
    assert run(tmp_path)[0]
    assert path.read_text() == "made"


@pytest.mark.parametrize("content", [b"", b"\xff", b"{", b"[]", b'{"fit": 3}', b'{"fit": {"key": 1}}', b"[" * 100_000])
def test_a_damaged_record_repeats_the_step(content: bytes, tmp_path: Path) -> None:
    run(tmp_path)
    (tmp_path / RECORD).write_bytes(content)
    assert run(tmp_path)[0]
    assert not run(tmp_path)[0]


def test_a_step_that_fails_is_not_finished(tmp_path: Path) -> None:
    def fails() -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        Steps(tmp_path).run("fit", [], [], fails)
    assert not (tmp_path / RECORD).exists()
    assert run(tmp_path)[0]
