"""Uses an installed wheel once, outside the repository: `wheel.py [demo]`.

Fit, export for all platforms, validate, a step, scenarios that came with the wheel, a Modelica package with its
library; `demo` also runs the demonstration.
"""

import shutil
import subprocess
import sys
import time
import zipfile
from pathlib import Path

import hystfmu as hy
from hystfmu.fmu.write.platforms import missing
from hystfmu.scenario.system.spec import shipped_scenarios

ALL = {"x86_64-windows", "x86-windows", "x86_64-linux", "aarch64-linux", "x86_64-darwin", "aarch64-darwin"}


def command(*words: object) -> str:
    """Run hystfmu, which must succeed, and return what it prints."""
    program = shutil.which("hystfmu", path=Path(sys.executable).parent)
    if program is None:
        sys.exit("the wheel has no program hystfmu")
    done = subprocess.run([program, *map(str, words)], capture_output=True, text=True)
    if done.returncode:
        sys.exit(f"hystfmu {' '.join(map(str, words))}: exit {done.returncode}\n{done.stdout}{done.stderr}")
    return done.stdout


def main() -> int:
    """Use the wheel of this environment."""
    if Path(sys.prefix) not in Path(hy.__file__).parents:
        sys.exit(f"{hy.__file__} is not the wheel of this environment")
    model = hy.fit(hy.synthetic.piezo(20), "prandtl_ishlinskii")
    for fmi in (2, 3):
        file = model.export(f"piezo{fmi}.fmu", fmi=fmi)
        if problems := hy.validate(file):
            sys.exit("\n".join(problems))
    unit = model.unit()
    unit.initialize(0.0, u=1.5)
    unit.do_step(0.0, 1e-3)
    print(f"HystFMU {hy.__version__}: {model.key}, y(1.5) = {unit.get('y'):.6g}, both FMUs are valid")

    model.save("piezo.model.toml")
    if "prandtl_ishlinskii" not in command("blocks"):
        sys.exit("hystfmu blocks lists no prandtl_ishlinskii")
    absent = missing()
    if 0 < len(absent) < len(ALL) - 1:  # a wheel that is compiled here may have the binary of this machine alone
        sys.exit(f"the wheel lacks {', '.join(absent)}")
    which = "host" if absent else "all"
    command("export", "piezo.model.toml", "-o", "all.fmu", "--fmi", 3, "--platforms", which)
    with zipfile.ZipFile("all.fmu") as archive:
        packed = {name.split("/")[1] for name in archive.namelist() if name.startswith("binaries/")}
    if len(packed) != len(ALL) - len(absent):
        sys.exit(f"all.fmu lacks {', '.join(ALL - packed)}")
    told = command("export", "piezo.model.toml", "--modelica", ".")
    library = Path(told.rpartition("needs the library HystFMU in ")[2].partition("\n")[0])
    if not (library / "HystFMU" / "package.mo").is_file() or Path(sys.prefix) not in library.parents:
        sys.exit(f"no Modelica library of this environment in {library}")
    print(command("run", shipped_scenarios() / "pid", shipped_scenarios() / "example_hold").rstrip().splitlines()[-1])
    print(f"{len(packed)} platforms, Modelica library and scenarios are there")
    if "demo" in sys.argv[1:]:
        begin = time.monotonic()
        print(command("demo", "-o", "demo").rstrip().splitlines()[-1])
        print(f"demo: {time.monotonic() - begin:.0f} s")
    return 0


if __name__ == "__main__":
    sys.exit(main())
