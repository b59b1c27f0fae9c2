"""A worker of a study with a foreign FMU has nothing of the process that started it, and can do nothing to it."""

import os
import sys
from pathlib import Path

import pytest
import tomli_w
from bad_fmu import LOOP, bad_fmu

import hystfmu as hy
from hystfmu.base.confine import unconfined
from hystfmu.base.errors import InputError
from hystfmu.graph import Graph, Node
from hystfmu.model import Model

if unconfined():
    pytest.skip(f"foreign FMUs may {unconfined()} here: needs Landlock and seccomp", allow_module_level=True)

# each line that succeeds adds its number to y; the secret is written backwards, not to find it here
ATTEMPTS = r"""
#define _GNU_SOURCE
#include <stdio.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/stat.h>
static const char backwards[] = "neddih sdrow";
static int holds(const char *at, size_t n) {
  size_t m = sizeof backwards - 1;
  for (size_t i = 0; i + m <= n; i++) {
    size_t k = 0;
    while (k < m && at[i + k] == backwards[m - 1 - k]) k++;
    if (k == m) return 1;
  }
  return 0;
}
static int in_memory(void) {
  FILE *maps = fopen("/proc/self/maps", "r");
  char line[4096], rights[8];
  unsigned long from, to;
  int found = 0;
  while (maps && fgets(line, sizeof line, maps))
    if (sscanf(line, "%lx-%lx %7s", &from, &to, rights) == 3 && rights[0] == 'r' && rights[1] == 'w')
      found |= holds((const char *)from, to - from);
  return found;
}
static int in_file(const char *path) {
  static char text[1 << 16];
  FILE *f = fopen(path, "rb");
  if (!f) return 0;
  size_t n = fread(text, 1, sizeof text, f);
  int found = holds(text, n);
  memset(text, 0, sizeof text);
  fclose(f);
  return found;
}
static int pipes(void) { /* the helper of multiprocessing removes what it is told to */
  struct stat s;
  for (int k = 0; k < 256; k++)
    if (!fstat(k, &s) && S_ISFIFO(s.st_mode)) return 1;
  return 0;
}
static double attempts(void) {
  char path[64];
  double did = 0;
  struct rlimit none = {0, 0};
  did += 1 * (getenv("TOKEN") != 0);
  did += 2 * in_file("/proc/self/environ");
  snprintf(path, sizeof path, "/proc/%d/environ", (int)getppid());
  did += 4 * in_file(path);
  snprintf(path, sizeof path, "/proc/%d/environ", MAKER);
  did += 8 * in_file(path);
  did += 16 * in_memory();
  did += 32 * pipes();
  did += 64 * isatty(0) + 64 * isatty(1);
  did += 128 * (prlimit(MAKER, RLIMIT_NOFILE, 0, &none) == 0);
  did += 256 * (setpriority(PRIO_PROCESS, MAKER, 1) == 0);
  return did;
}
"""
STUDY = {"name": "bad", "scenario": "loop", "method": "grid", "parameters": {"command.step": {"values": [0.0, 1.0]}}}


@pytest.fixture
def study(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("HYSTFMU_CACHE", str(tmp_path / "cache"))
    (tmp_path / "loop").mkdir()
    (tmp_path / "loop" / "scenario.toml").write_text(tomli_w.dumps(LOOP))
    path = tmp_path / "bad.study.toml"
    path.write_text(tomli_w.dumps(STUDY))
    return path


def test_it_reaches_nothing_of_its_maker(study: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("TOKEN", "words hidden")
    extra = ATTEMPTS.replace("MAKER", str(os.getpid()))
    defect = "{ static double did = -1; if (did < 0) did = attempts(); y = did; return fmi2OK; }"
    bad_fmu(study.parent / "loop" / "bad.fmu", defect, -1.0, extra)
    outcome = hy.study(study, study.parent / "out", workers=1)
    assert [(row["status"], row["metrics"]) for row in outcome.rows] == [("ok", {"last": 0.0})] * 2


def test_workers_that_cannot_begin_say_why(study: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    bad_fmu(study.parent / "loop" / "bad.fmu")
    monkeypatch.setattr(sys, "executable", "/bin/false")
    with pytest.raises(InputError, match=r"^the workers of the study exit with status 1 before they begin; "):
        hy.study(study, study.parent / "out", workers=1)


@pytest.mark.parametrize("engine", ["native", "fmpy"])
def test_it_needs_no_file_of_the_scenario(study: Path, engine: str) -> None:
    """Where it builds the case anew: for the reference engine, and for another number of steps of a delay."""
    folder = study.parent / "loop"
    bad_fmu(folder / "bad.fmu")
    Model("gain", Graph.single(Node("gain", "sum", {"n": 1}, {"k": [2.0]})), 1e-3).save(folder / "gain.model.toml")
    units = {"late": {"block": "delay"}, "gain": {"model": "gain.model.toml"}}
    loop = LOOP | {
        "units": LOOP["units"] | units,
        "order": ["command", "late", "gain", "bad"],
        "connections": {"late.u": "command.d", "gain.u": "late.y", "bad.u": "gain.y"},
    }
    loop["units"]["command"] = {"block": "disturbance", "set": {"amplitude": 0.0}}
    (folder / "scenario.toml").write_text(tomli_w.dumps(loop))
    varied = {"command.step": {"values": [1.0]}, "late.n": {"values": [1, 4]}}
    study.write_text(tomli_w.dumps(STUDY | {"engine": engine, "parameters": varied}))
    outcome = hy.study(study, study.parent / "out", workers=1)
    assert [(row["status"], row["metrics"]) for row in outcome.rows] == [("ok", {"last": 2.0})] * 2
