"""Examples in the docstrings of the face print what they say; a program with every name passes `mypy --strict`."""

import doctest
import inspect
import subprocess
import sys
from pathlib import Path
from types import ModuleType

import pytest

import hystfmu as hy

CALLS = (
    "of_block",
    "from_torch",
    "predict",
    "score",
    "check",
    "plot",
    "inverse",
    "export",
    "export_modelica",
    "unit",
)  # methods of a model


def documented() -> dict[str, object]:
    """Everything that a user calls, by its name."""
    found: dict[str, object] = {"hystfmu": hy} | {name: getattr(hy, name) for name in hy.__all__}
    return found | {f"Model.{name}": getattr(hy.Model, name) for name in CALLS}


@pytest.mark.some(4)
@pytest.mark.parametrize("name", documented())
def test_examples_print_what_they_say(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.chdir(tmp_path)
    thing = documented()[name]
    home = thing if isinstance(thing, ModuleType) else sys.modules[thing.__module__]
    text = inspect.getdoc(thing)
    assert text, name
    test = doctest.DocTestParser().get_doctest(text, {}, name, home.__file__, 0)
    assert test.examples, f"{name} shows no example"
    shown: list[str] = []
    result = doctest.DocTestRunner(verbose=False).run(test, out=shown.append)
    assert result.failed == 0, "".join(shown)


# ---- types -----------------------------------------------------------------------------------------------------------
ROOT = Path(__file__).parents[2]
USER = '''
"""Every name of the face, as a user writes it."""

from pathlib import Path

import hystfmu as hy

hy.synthetic.piezo(reversals=60, rate=1000.0).to_csv("piezo.csv")
data: hy.Dataset = hy.read("piezo.csv", train="0:9000")
made: hy.Dataset = hy.Dataset([0.0, 0.1, 0.2, 0.3], [0, 1, 2, 1], [0.0, 0.5, 1.5, 1.2], unit_u="V")
model: hy.Model = hy.fit(data, "prandtl_ishlinskii", seed=1, N=20)
same: hy.Model = hy.fit({"t": data.t, "u": data.u, "y": data.y}, "preisach")
predicted = model.predict(data), model.predict([0.0, 1.0]), model.predict({"t": data.t, "u": data.u})
print(model)
worst: float = model.score(made)["max_percent"]
picture: Path = model.plot(data).save("loop.svg")
inverse: hy.Model = model.inverse()
archive: Path = inverse.export("inverse.fmu", fmi=3)
problems: list[str] = hy.validate(archive, seconds=30.0)
package: Path = model.export_modelica("Piezo/")
model.save("piezo.model.toml")
again: hy.Model = hy.Model.load("piezo.model.toml")
bare: hy.Model = hy.Model.of_block(hy.blocks.Creep(w=[1.0], T=[0.5]))

unit: hy.Unit = model.unit()
unit.initialize(0.0, u=1.5)
unit.set("u", 2.0)
unit.do_step(0.0, 1e-3)
y: float = unit.get("y")

loop: hy.Scenario = hy.Scenario("tracking", step=1e-4)
loop.add("plant", model, fine=True)
loop.add("inverse", inverse, runs_as="fmu3")
loop.add("pid", hy.blocks.Pid(Kp=1.2, Ki=9e3))
loop.connect("inverse.y", "plant.u")
loop.metric("tracking", "rms_percent", "plant.y", against="reference.r", limit=0.05)
loop.case("mismatch", set={"plant.hysteresis_w": "*1.2"}, limits={"tracking": 1.0})
result = loop.run("mismatch", engine="native")
passed: bool = result.passed
if result.trace is not None:
    highest: float = float(result.trace["plant.y"].max())
result.plot().save("tracking.html")
page: Path = result.report("out")
folder: Path = loop.save("scenarios/mine")
results = hy.run([folder, hy.Scenario.load("scenarios/pid")], case="mismatch", set={"pid.Kp": 1.0})
values: list[float] = [v.value for r in results for v in r.verdicts]
outcome = hy.study("mismatch.study.toml", "out", workers=2)
failed: int = len(outcome.failed)
sweep: hy.Study = hy.Study("sweep", loop, method="sobol", n=8, seed=1).vary("pid.Kp", range=(0.5, 2.0))
table = sweep.run("swept", workers=1).to_pandas()
written: Path = sweep.save("studies")

node: hy.Node = hy.Node("plays", "backlash_sum", values={"w0": 0.4, "r": [0.1, 0.3], "w": [0.5, 0.2]})
ends = [hy.Input("u", ("plays.u",))], [hy.Output("y", "plays.y")]
graph: hy.Graph = hy.Graph([node], (), *ends)
try:
    hy.blocks.SlidingMode(rho=-1)
except hy.InputError as e:
    print(e)
held = {name: model.predict(u) for name, u in hy.signals.held_out().items()}
gains = hy.design.gains(hy.blocks.Pid(Kp=1.0).node)
reference = hy.blocks.Reference(shape="triangle", levels=[1.0, 2.0], seed=3)
chain = reference(made.u, h=0.1)
learnt = hy.redesign.repetitive(loop, period=0.01)
learnt.scenario.save("repetitive")
'''
WRONG = """
import hystfmu as hy

hy.blocks.Pid(kp=1.0)
hy.blocks.Reference(shape="square")
hy.fit("piezo.csv")
hy.Scenario("tracking", 1e-4)
hy.Scenario("a", step=1e-4).metric("m", "mean", "plant.y")
hy.runn
hy.fit(hy.read("piezo.csv"), "prandl_ishlinskii")
hy.Study("sweep", "scenarios/pid", method="optuna")
"""


# as an installed package: its own types count, and neither its errors nor the types behind it, which take 25 s to read
PACKAGES = ("torch", "scipy", "numpy", "fmpy", "lxml", "control", "optuna", "distributed", "pyarrow")
BEHIND = ",".join(f"{n}.*" for n in PACKAGES)
OPTIONS = f"""[mypy]
strict = True
python_version = 3.11
mypy_path = {ROOT / "python"}
[mypy-{BEHIND}]
follow_imports = skip
ignore_missing_imports = True
[mypy-h5py,nptdms,openpyxl,pandas,plotext,threadpoolctl]
ignore_missing_imports = True
[mypy-hystfmu.*]
ignore_errors = True
"""


def mypy(folder: Path, *programs: str) -> list[str]:
    """The lines of mypy about some programs of a user."""
    options = folder / "mypy.ini"
    options.write_text(OPTIONS)
    files = []
    for k, text in enumerate(programs):
        files.append(folder / f"user_{k}.py")
        files[-1].write_text(text)
    cache = str(ROOT / "build" / "mypy_user")
    command = [sys.executable, "-m", "mypy", "--config-file", str(options), "--cache-dir", cache, *map(str, files)]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    assert not done.stderr, done.stderr
    return done.stdout.splitlines()


@pytest.mark.stress
def test_a_program_with_every_name_passes_and_mistakes_are_found(tmp_path: Path):
    pytest.importorskip("mypy")
    for name in hy.__all__:
        assert f"hy.{name}" in USER, f"the program does not use {name}"
    lines = mypy(tmp_path, USER, WRONG)
    told = [line for line in lines if ": error: " in line]
    assert not [line for line in told if "user_0.py" in line], told
    found = [int(line.split(":")[1]) for line in told if "user_1.py" in line]
    assert sorted(set(found)) == [4, 5, 6, 7, 8, 9, 10, 11], told
