"""What a foreign FMU leaves in place of its result is no way to files that it may not read."""

import json
from pathlib import Path
from typing import Any

import pytest
import tomli_w
from bad_fmu import LOOP, bad_fmu
from users import User, user  # noqa: F401

from hystfmu.base import steps as module
from hystfmu.base.confine import unconfined
from hystfmu.base.steps import RECORD, Steps

if unconfined():
    pytest.skip(f"foreign FMUs may {unconfined()} here: needs Landlock and seccomp", allow_module_level=True)

# the result of a check is written again and again: a thread puts the link back
LEAVES = r"""
#include <pthread.h>
static void leave(void) {
  unlink(RESULT);
  WAY;
}
static void *leave_on(void *nothing) {
  for (;;) leave(), usleep(1000);
  return nothing;
}
static void leave_always(void) {
  pthread_t thread;
  leave();
  pthread_create(&thread, 0, leave_on, 0);
}
"""
WAYS = {"symlink": "if (symlink(SECRET, RESULT)) return", "hard link": "if (link(SECRET, RESULT)) return"}
COMMANDS = {  # and what they read from the folder of the FMU
    "simulate FOLDER/bad.fmu --step 1e-3 --stop 0.01 -o FOLDER/out.csv": ["values"],
    "run FOLDER --engine native": ["ended.json"],
    "validate FOLDER/bad.fmu": ["result.json"],
}
MORE = dict(zip(COMMANDS, (["ended.json"], ["values"]), strict=False))
RUNS = """
import json, sys
sys.modules["fmu_manipulation_toolbox"] = None  # it runs nothing
from click.testing import CliRunner
from hystfmu.cli import main
for command in json.loads(sys.argv[1]):
    told = CliRunner().invoke(main, command.split())
    print(json.dumps([told.exit_code, told.output + repr(told.exception)]))
"""
WORDS = "secret words"
NOTES = {"stopped": WORDS, "status": WORDS, "rows": 3, "note": WORDS, "sweeps": [1, 1, 1]}
NOTES |= {"problems": [WORDS], "doing": WORDS, "done": True, "checks": []}
NUMBERS, NUMBER = b"secret!\n" * 1000, "7.09521347"  # how it reads as a number
SECRETS = {"values": NUMBERS, "ended.json": json.dumps(NOTES).encode(), "result.json": json.dumps(NOTES).encode()}


@pytest.mark.turn("foreign code")
@pytest.mark.parametrize(("way", "more"), [
    ("symlink", {}),
    pytest.param("symlink", MORE, marks=pytest.mark.stress, id="more"),
    pytest.param("hard link", {}, marks=pytest.mark.stress),
])  # fmt: skip
def test_a_result_that_is_no_file_of_the_fmu_is_refused(way: str, more: dict[str, list[str]], user: User) -> None:  # noqa: F811
    """It would hand out bytes of the secret: numbers in a table, or words in a message."""
    commands = []
    for command, results in (more or COMMANDS).items():
        for result in results:
            folder = user.folder / f"loop{len(commands)}"
            folder.mkdir()
            secret = user.folder / f"{result}.secret"
            secret.write_bytes(SECRETS[result])
            (folder / "scenario.toml").write_text(tomli_w.dumps(LOOP))
            extra = LEAVES.replace("WAY", WAYS[way]).replace("RESULT", f'"{result}"').replace("SECRET", f'"{secret}"')
            once = "leave_always" if result == "result.json" else "leave"
            bad_fmu(folder / "bad.fmu", f"{{ static int n; if (!n++) {once}(); }}", -1.0, extra, "-pthread")
            commands.append(command.replace("FOLDER", str(folder)))
    user.give(user.folder)
    told = user.python("-c", RUNS, json.dumps(commands), HYSTFMU_CACHE=str(user.folder / "cache"))
    assert told.returncode == 0, told.stderr
    runs = [json.loads(line) for line in told.stdout.splitlines()]
    assert len(runs) == len(commands)
    for command, (status, words) in zip(commands, runs, strict=True):
        assert WORDS not in words, command
        assert status or way == "hard link", f"{command}: {words}"
        assert NUMBER not in words, command
    for path in [p for p in user.folder.rglob("*") if p.is_file() and p.suffix != ".secret"]:
        assert NUMBER.encode() not in (content := path.read_bytes()), path
        assert WORDS.encode() not in content, path


# ---- A finished step is not repeated; another input, another name, a changed file or a damaged record make it anew
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
