"""Variables of the environment that a process with foreign code sees: those that Python and the loader need.

This module imports only the standard library, because it runs before anything else is loaded.
"""

from __future__ import annotations

import re
from collections.abc import Mapping

# others may be keys and passwords; SECURITY.md has the same list
_KNOWN = re.compile(
    r"""
      PATH | HOME | USER | LOGNAME | SHELL | TZ | TMPDIR | TMP | TEMP
    | LANG | LANGUAGE | LC_\w+
    | LD_LIBRARY_PATH | LD_PRELOAD | DYLD_\w+
    | PYTHON[A-Z_]+ | VIRTUAL_ENV | CONDA_PREFIX | JAVA_HOME
    | OMP_(NUM_THREADS|STACKSIZE) | (OPENBLAS|MKL|NPY|NUMEXPR|VECLIB)_\w+
    | HYSTFMU_\w+
    # of Windows
    | SYSTEMROOT | SYSTEMDRIVE | WINDIR | COMSPEC | PATHEXT | OS | NUMBER_OF_PROCESSORS | PROCESSOR_\w+
    | USERPROFILE | HOMEDRIVE | HOMEPATH | APPDATA | LOCALAPPDATA | PROGRAMDATA | PROGRAMFILES(\(X86\))?
    """,
    re.VERBOSE,
)


def known(variables: Mapping[str, str]) -> dict[str, str]:
    """Return the variables that foreign code may see."""
    return {name: value for name, value in variables.items() if _KNOWN.fullmatch(name)}
