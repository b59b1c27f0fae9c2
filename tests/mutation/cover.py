"""Which test runs which line of the mutated rooms, and how long each test takes: a plugin of pytest, by coverage.py.

A line run by a fixture of a module or session belongs to every test that uses the fixture.
"""

import hashlib
import json
import os
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import coverage
import pytest
from mutation.children import unconfine
from mutation.sample import ROOMS

ROOT = Path(__file__).parents[2]


class Cover:
    """The plugin; it writes its table to `target` when the session ends."""

    def __init__(self, target: Path) -> None:
        self.target, self.data = target, target.with_suffix(".coverage")
        self.seconds: dict[str, float] = {}  # CPU, also of processes that have ended
        self.bad: set[str] = set()
        self.users: dict[str, list[str]] = defaultdict(list)  # tests by shared fixture
        target.parent.chmod(0o1777)  # tests also start processes of another user
        setting = target.with_suffix(".rc")
        folders = [f for some in ROOMS.values() for f in some if f.startswith("python/")]
        files = "\n".join(f"  {ROOT}/{folder}/*" for folder in folders)
        setting.write_text(
            f"[run]\ndata_file = {self.data}\nparallel = true\nconcurrency = multiprocessing, thread\n"
            f"context = ${{PYTEST_CURRENT_TEST-}}\ninclude =\n{files}\n"
        )
        os.environ["COVERAGE_PROCESS_START"] = str(setting)  # the processes that tests start
        self.coverage = coverage.Coverage(config_file=str(setting))
        self.coverage.start()
        self.of_base = True  # the present test is about confinement
        unconfine(lambda: self.of_base)

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_protocol(self, item: pytest.Item) -> Iterator[None]:
        self.coverage.switch_context(item.nodeid)
        self.of_base = item.nodeid.startswith("tests/base/")
        for name, found in item._fixtureinfo.name2fixturedefs.items():  # type: ignore[attr-defined]
            if found[-1].scope != "function":
                self.users[f"{found[-1].baseid}@{name}"].append(item.nodeid)
        before = sum(os.times()[:4])
        try:
            return (yield)
        finally:
            self.seconds[item.nodeid] = sum(os.times()[:4]) - before

    @pytest.hookimpl(wrapper=True)
    def pytest_fixture_setup(self, fixturedef: Any, request: Any) -> Iterator[Any]:
        if fixturedef.scope == "function":
            return (yield)
        self.coverage.switch_context(f"{fixturedef.baseid}@{fixturedef.argname}")
        try:
            return (yield)
        finally:
            self.coverage.switch_context(os.environ["PYTEST_CURRENT_TEST"].rpartition(" (")[0])

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        if not report.passed:
            self.bad.add(report.nodeid)

    def pytest_sessionfinish(self) -> None:
        self.coverage.stop()
        self.coverage.save()
        joined = coverage.Coverage(data_file=str(self.data), config_file=False)
        joined.combine([str(self.target.parent)])
        data = joined.get_data()
        lines: dict[str, dict[int, list[str]]] = {}
        for file in sorted(data.measured_files()):
            found = lines[str(Path(file).relative_to(ROOT))] = {}
            for line, contexts in sorted(data.contexts_by_lineno(file).items()):
                tests: set[str] = set()
                for context in contexts:
                    # that of a started process, "test (call)", comes before that of a fork of this one
                    name = context.rpartition("|")[2] or context
                    name = name.rpartition(" (")[0] if name.endswith((" (setup)", " (call)", " (teardown)")) else name
                    tests.update(self.users.get(name, [name]))
                found[line] = sorted(tests & (self.seconds.keys() - self.bad))
        codes = {f: hashlib.sha256((ROOT / f).read_bytes()).hexdigest()[:8] for f in lines}
        seconds = {t: round(s, 3) for t, s in self.seconds.items() if t not in self.bad}
        self.target.write_text(json.dumps({"seconds": seconds, "lines": lines, "codes": codes}))


def pytest_configure(config: pytest.Config) -> None:
    """Measure when a target is named in the environment."""
    config.pluginmanager.register(Cover(Path(os.environ["HYSTFMU_COVER"])))
