"""Tests that are collected once: a fork for every mutant runs some of them."""

import os
from collections.abc import Callable, Iterator, Sequence

import pytest
from mutation.judge import Outcome

OPTIONS = ["-q", "--no-header", "--tb=short", "-p", "no:cacheprovider", "-p", "no:xdist", "-p", "no:faulthandler"]


class Watch:
    """A plugin that remembers the first test that fails, and the seconds of all (CPU, also of processes)."""

    def __init__(self) -> None:
        self.outcome = Outcome()

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_protocol(self, item: pytest.Item) -> Iterator[None]:
        before = sum(os.times()[:4])
        try:
            return (yield)
        finally:
            self.outcome.seconds[item.nodeid] = round(sum(os.times()[:4]) - before, 3)

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        if report.failed:
            self.outcome.failures.append(report.nodeid)
            self.outcome.failed = self.outcome.failed or report.nodeid

    def pytest_collectreport(self, report: pytest.CollectReport) -> None:
        if report.failed and not self.outcome.failed:
            self.outcome.failed = f"{report.nodeid} does not load"


class Warm(Watch):
    """A plugin that calls `work` instead of running the collected tests."""

    def __init__(self, work: Callable[["Warm"], None]) -> None:
        super().__init__()
        self.work = work
        self.items: dict[str, pytest.Item] = {}

    def pytest_runtestloop(self, session: pytest.Session) -> bool:
        self.items = {i.nodeid: i for i in session.items}
        self.work(self)
        return True

    def run(self, tests: Sequence[str], begin: Callable[[int], None] | None = None) -> Outcome:
        """Run tests in this order to the first that fails, or all of them with a call of `begin` before each."""
        chosen = [self.items[t] for t in tests if t in self.items]
        for k, (item, following) in enumerate(zip(chosen, [*chosen[1:], None], strict=False)):
            if begin is not None:
                begin(k)
            item.config.hook.pytest_runtest_protocol(item=item, nextitem=following)
            if self.outcome.failed and begin is None:
                break
        return self.outcome


class Cold(Watch):
    """A plugin that runs the given tests in the given order."""

    def __init__(self, tests: Sequence[str]) -> None:
        super().__init__()
        self.order = {t: k for k, t in enumerate(tests)}

    @pytest.hookimpl(trylast=True)
    def pytest_collection_modifyitems(self, items: list[pytest.Item]) -> None:
        items[:] = sorted((i for i in items if i.nodeid in self.order), key=lambda i: self.order[i.nodeid])


def run_cold(tests: Sequence[str]) -> Outcome:
    """Collect and run tests to the first that fails."""
    watch = Cold(tests)
    modules = list(dict.fromkeys(t.partition("::")[0] for t in tests))
    code = pytest.main([*OPTIONS, "-x", *modules], plugins=[watch])
    if code not in (pytest.ExitCode.OK, pytest.ExitCode.NO_TESTS_COLLECTED) and not watch.outcome.failed:
        watch.outcome.failed = f"pytest {code}"
    return watch.outcome
