"""Report of `make contract`: the rule that each block breaks and the file to write."""

from pathlib import Path
from typing import Any

import pytest

from hystfmu.core.library import block_types

HERE = Path(__file__).parent
DERIVED = "tests/vectors/derived"


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    for item in items:
        if HERE in item.path.parents:
            item.user_properties.append(("rule", rule(item)))


def rule(item: pytest.Item) -> str:
    """One sentence: the block, the rule in the words of the test's name, the file."""
    function = item.name.split("[")[0]
    words = function.removeprefix("test_").replace("_", " ")
    parameters: dict[str, Any] = getattr(getattr(item, "callspec", None), "params", {})
    block = block_types().get(str(parameters.get("name")))
    if block is None:
        return f"{words} ({item.path.name})"
    if function == "test_at_least_one_sourced_vector":
        return f"{block.name} has no vectors: write {DERIVED}/{block.name}.toml with a `source`"
    if function == "test_vector":
        folder = item.name.split("[")[1].split("-")[0]
        return f"{block.name} differs from its vector: look at tests/vectors/{folder}/{block.name}.toml"
    return f"{block.name} breaks the rule '{words}': look at fmu_build/core/blocks/{block.family}/{block.name}.c"


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    failed = terminalreporter.getreports("failed") + terminalreporter.getreports("error")
    ran = [report for report in failed if isinstance(report, pytest.TestReport)]  # not those that are not collected
    rules = dict.fromkeys(text for report in ran for key, text in report.user_properties if key == "rule")
    if rules:
        terminalreporter.section("rules of the contract")
        terminalreporter.write("\n".join([*rules, ""]))
