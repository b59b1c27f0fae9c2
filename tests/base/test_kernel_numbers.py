"""Numbers in the confinement of foreign code against the headers of the kernel.

A wrong number would refuse another call and let the right one pass. Those of aarch64 do not run on x86-64.
"""

import shutil
import subprocess
from collections.abc import Iterable
from pathlib import Path

import pytest

from hystfmu.base import confine, supervisor

HEADERS = "sys/prctl.h linux/capability.h linux/seccomp.h linux/filter.h linux/audit.h linux/landlock.h"
HEADERS += " linux/fcntl.h asm/ioctls.h asm/sockios.h"


@pytest.fixture
def values(tmp_path: Path):
    """Return a function that evaluates expressions of C with some headers of the system."""

    def found(headers: str, expressions: Iterable[str]) -> list[int]:
        lines = [f"#include <{h}>" for h in ("stdio.h", *headers.split())]
        lines += ["int main(void) {", *(f'printf("%lld\\n", (long long)({e}));' for e in expressions), "}"]
        (tmp_path / "numbers.c").write_text("\n".join(lines))
        if shutil.which("cc") is None:
            pytest.skip("no C compiler")
        made = subprocess.run(
            ["cc", "-o", tmp_path / "numbers", tmp_path / "numbers.c"], capture_output=True, text=True
        )
        if "No such file" in made.stderr:
            pytest.skip(f"no kernel headers: {made.stderr.splitlines()[0]}")
        assert not made.returncode, made.stderr
        return [int(line) for line in subprocess.check_output([tmp_path / "numbers"], text=True).split()]

    return found


@pytest.mark.parametrize(("column", "header"), [(0, "asm/unistd_64.h"), (1, "asm-generic/unistd.h")])
def test_every_system_call_has_its_number(column, header, values):
    pairs = confine._REFUSED | confine._OF_A_PROCESS | confine._SIGNALS
    pairs |= {name: numbers[-2:] for name, numbers in confine._OF_A_KIND.items()}
    pairs |= {
        "pidfd_send_signal": confine._PIDFD_SEND_SIGNAL, "fcntl": confine._FCNTL, "ioctl": confine._IOCTL_CALL,
        "landlock_create_ruleset": (confine._CREATE_RULESET,) * 2, "landlock_add_rule": (confine._ADD_RULE,) * 2,
        "landlock_restrict_self": (confine._RESTRICT_SELF,) * 2,
    }  # fmt: skip
    assert [p[column] for p in pairs.values()] == values(f"asm/bitsperlong.h {header}", [f"__NR_{n}" for n in pairs])


def test_every_other_number_is_that_of_its_name(values):
    names = {
        "PR_CAPBSET_READ": confine._READ_BOUND,
        "PR_CAPBSET_DROP": confine._DROP_BOUND,
        "_LINUX_CAPABILITY_VERSION_3": confine._VERSION_3,
        "PR_GET_SECCOMP": confine._GET_SECCOMP,
        "PR_SET_SECCOMP": confine._SET_SECCOMP,
        "SECCOMP_MODE_FILTER": confine._FILTER,
        "PR_SET_NO_NEW_PRIVS": confine._NO_NEW_PRIVILEGES,
        "AUDIT_ARCH_X86_64": confine._AUDIT["x86_64"],
        "AUDIT_ARCH_AARCH64": confine._AUDIT["aarch64"],
        "BPF_LD | BPF_W | BPF_ABS": confine._LOAD,
        "BPF_JMP | BPF_JA": confine._JUMP,
        "BPF_JMP | BPF_JEQ | BPF_K": confine._EQUAL,
        "BPF_JMP | BPF_JGE | BPF_K": confine._LEAST,
        "BPF_RET | BPF_K": confine._END,
        "SECCOMP_RET_ALLOW": confine._ALLOW,
        "SECCOMP_RET_ERRNO | 13": confine._REFUSE,
        "SECCOMP_RET_KILL_PROCESS": confine._KILL,
        "F_SETOWN": confine._OWNERS[0],
        "F_SETOWN_EX": confine._OWNERS[1],
        **dict(zip(("TIOCSTI", "TIOCLINUX", "FIOSETOWN", "SIOCSPGRP"), confine._CONTROLS, strict=True)),
        "LANDLOCK_ACCESS_FS_EXECUTE": confine._EXECUTE,
        "LANDLOCK_ACCESS_FS_WRITE_FILE": confine._WRITE_FILE,
        "LANDLOCK_ACCESS_FS_READ_FILE": confine._READ_FILE,
        "LANDLOCK_ACCESS_FS_READ_DIR": confine._READ_DIR,
        # the last right of a version and all before it
        "2 * LANDLOCK_ACCESS_FS_MAKE_SYM - 1": confine._RIGHTS[1],
        "2 * LANDLOCK_ACCESS_FS_REFER - 1": confine._RIGHTS[2],
        "PR_SET_CHILD_SUBREAPER": supervisor._SUB_REAPER,
        "PR_SET_PDEATHSIG": supervisor._PARENT_DEATH,
    }
    assert list(names.values()) == values(HEADERS, names)
    assert confine._RIGHTS[3] == 2 * confine._TRUNCATE - 1  # newer than the headers of many systems
    assert confine._RIGHTS[5] == 2 * confine._IOCTL - 1


def test_every_version_of_landlock_is_asked_for_what_it_knows():
    files = confine._RIGHTS
    asked = [[files[1]], [files[2]], [files[3]], [files[3], 3], [files[5], 3], [files[5], 3, 3], [files[5], 3, 3]]
    assert [confine._attributes(version) for version in range(1, 8)] == asked
