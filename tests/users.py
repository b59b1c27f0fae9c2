"""Python as root and as a user without rights, to show what each of them may do.

Tests often run as root, from a Python in a folder that no other user may enter.  The user then gets a view of the file
system in which that folder holds this Python and nothing else.
"""

import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

import pytest

IS_ROOT = hasattr(os, "getuid") and os.getuid() == 0
_NOBODY = "65534"
_VIEW = """
hidden=$1 view=$2 roots=$3
shift 3
if [ -n "$hidden" ]; then
  mount --rbind "$hidden" "$view" && mount -t tmpfs -o mode=755 none "$hidden" || exit 99
  for root in $roots; do mkdir -p "$root" && mount --bind "$view/${root#"$hidden"}" "$root" || exit 99; done
fi
exec setpriv --reuid USER --regid USER --clear-groups "$@"
"""


class User:
    """A user with a folder of his own.

    Parameters
    ----------
    name : str
        "root" or "user".
    """

    _works = False  # another user has found this Python

    def __init__(self, name: str) -> None:
        self.root = name == "root"
        if self.root and not IS_ROOT:
            pytest.skip("needs root")
        if not self.root and IS_ROOT and not (shutil.which("unshare") and shutil.which("setpriv")):
            pytest.skip("needs unshare and setpriv to become another user")
        self.folder = Path(tempfile.mkdtemp(prefix="hystfmu-user-"))
        self._view = Path(tempfile.mkdtemp(prefix="hystfmu-view-"))
        self._changes = not self.root and IS_ROOT
        if self._changes:
            os.chown(self.folder, int(_NOBODY), int(_NOBODY))
            if not User._works and (tried := self.python("-c", "import hystfmu")).returncode:
                pytest.skip(f"cannot become another user here: {tried.stderr.strip()}")
            User._works = True

    def python(self, *arguments: str, **variables: str) -> subprocess.CompletedProcess[str]:
        """Run this Python in the folder of the user, with variables of the environment."""
        command = [sys.executable, *arguments]
        if self._changes:
            roots = [os.path.realpath(p) for p in (sys.base_prefix, sys.prefix, *sys.path) if p]
            hidden = next((h for r in roots for h in _closed(Path(r))), "")
            inside = " ".join(dict.fromkeys(r for r in roots if hidden and r.startswith(f"{hidden}/")))
            script = _VIEW.replace("USER", _NOBODY)
            view = [str(hidden), str(self._view), inside]
            command = ["unshare", "--mount", "--propagation", "private", "sh", "-c", script, "sh", *view, *command]
        home = dict.fromkeys(("HOME", "TMPDIR"), str(self.folder))
        # `python -m pytest` adds the folder of the repository, which holds that of the user in `make test`
        path = os.pathsep.join(p for p in sys.path if p and not self.folder.is_relative_to(p))
        environment = {**os.environ, **home, "PYTHONPATH": path, "PYTHONDONTWRITEBYTECODE": "1", **variables}
        return subprocess.run(command, cwd=self.folder, env=environment, capture_output=True, text=True, timeout=300)

    def give(self, path: Path) -> None:
        """Make a file or a folder with all that it has one of the user."""
        if self._changes:
            for p in (path, *path.rglob("*")):
                os.chown(p, int(_NOBODY), int(_NOBODY))

    def close(self) -> None:
        shutil.rmtree(self.folder, ignore_errors=True)
        self._view.rmdir()


def _closed(path: Path) -> Iterator[Path]:
    """Folders on the way to a path that other users may not enter, the uppermost first."""
    yield from (p for p in [*reversed(path.parents), path] if p.is_dir() and not p.stat().st_mode & 1)


@pytest.fixture(params=[pytest.param("root", marks=pytest.mark.stress), "user"])
def user(request: pytest.FixtureRequest) -> Iterator[User]:
    made = User(request.param)
    yield made
    made.close()
