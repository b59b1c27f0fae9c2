"""Write results as JUnit XML for continuous integration servers: one suite per scenario, one test per case."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from hystfmu.base.files import write_bytes
from hystfmu.fmu.archive.writing import xml_file

if TYPE_CHECKING:
    from hystfmu.scenario.verdict.result import Result


def write_junit(results: Sequence[Result], path: str | Path) -> None:
    """Write results as JUnit XML.

    Parameters
    ----------
    results : sequence of Result
        Results of `run_scenarios`.
    path : path
        XML file to write.

    Raises
    ------
    InputError
        If the file cannot be written.
    """
    root = ET.Element("testsuites", _counts(results))
    for name in dict.fromkeys(r.scenario for r in results):
        own = [r for r in results if r.scenario == name]
        suite = ET.SubElement(root, "testsuite", {"name": name, **_counts(own)})
        for r in own:
            test = ET.SubElement(suite, "testcase", {"classname": name, "name": r.case, "time": f"{r.seconds:.3f}"})
            if r.trace is None:
                ET.SubElement(test, "error", message=r.lines[0]).text = "\n".join(r.lines)
            elif not r.passed:
                ET.SubElement(test, "failure", message=r.lines[0]).text = "\n".join(r.lines)
            ET.SubElement(test, "system-out").text = "\n".join(f"{v.metric} = {v.value!r}" for v in r.verdicts)
    write_bytes(path, xml_file(root))


def _counts(results: Sequence[Result]) -> dict[str, str]:
    errors = sum(r.trace is None for r in results)
    failures = sum(not r.passed for r in results) - errors
    seconds = sum(r.seconds for r in results)
    return {
        "tests": str(len(results)),
        "failures": str(failures),
        "errors": str(errors),
        "time": f"{seconds:.3f}",
    }
