"""What a foreign FMU leaves in place of its result is no way to files that it may not read."""

import json

import pytest
import tomli_w
from bad_fmu import LOOP, bad_fmu
from users import User, user  # noqa: F401

from hystfmu.base.confine import unconfined

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
WAYS = {
    "symlink": "if (symlink(SECRET, RESULT)) return",
    "hard link": "if (link(SECRET, RESULT)) return",
}
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


@pytest.mark.parametrize(
    ("way", "more"),
    [
        ("symlink", {}),
        pytest.param("symlink", MORE, marks=pytest.mark.stress, id="more"),
        pytest.param("hard link", {}, marks=pytest.mark.stress),
    ],
)
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
