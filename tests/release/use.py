"""Install the wheel of this machine in a new environment and use it: use.py DIST ENVIRONMENT [demo].

No compiler and no other program is on the path of that use.  pip chooses the wheel in DIST, offline; what it needs
comes in the versions of constraints.txt.
"""

import os
import subprocess
import sys
import time
import venv
from pathlib import Path

ROOT = Path(__file__).parents[2]
KEPT = ("HOME", "USERPROFILE", "SYSTEMROOT", "TEMP", "TMPDIR")  # folders for files in progress; libraries of Windows


def main() -> int:
    """Return the exit status of wheel.py."""
    dist, environment, *words = sys.argv[1:]
    folder = Path(environment).resolve()
    venv.create(folder, clear=True, with_pip=True)
    programs = folder / ("Scripts" if sys.platform == "win32" else "bin")
    pip = [programs / "python", "-m", "pip", "--quiet", "--disable-pip-version-check"]
    choose = ["download", "--no-index", "--no-deps", "--find-links", dist, "--dest", folder / "chosen"]
    subprocess.run([*pip, *choose, "--only-binary", ":all:", "hystfmu"], check=True)
    (wheel,) = (folder / "chosen").iterdir()
    begin = time.monotonic()
    subprocess.run([*pip, "install", "--constraint", ROOT / "constraints.txt", wheel], check=True)
    print(f"Python {sys.version.split()[0]}, {wheel.name}: installed in {time.monotonic() - begin:.0f} s", flush=True)
    kept = {k: os.environ[k] for k in KEPT if k in os.environ}
    program = [programs / "python", ROOT / "tests" / "release" / "wheel.py", *words]
    return subprocess.run(program, cwd=folder, env={**kept, "PATH": str(programs)}).returncode


if __name__ == "__main__":
    sys.exit(main())
