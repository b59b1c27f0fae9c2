"""A loop around an actuator between pins and flanges: controllers of the library and of the standard library."""

from __future__ import annotations

import html
import re
from pathlib import Path

import bench
import library
import numpy as np
import simulate

SETTLED = 0.1  # s


def tracking(found: dict[str, np.ndarray]) -> float:
    """Root mean square of the error in percent of the stroke, over the last period."""
    late = found["time"] >= SETTLED
    return float(50 * np.sqrt(np.mean((found["reading.y"] - found["reference.r"])[late] ** 2)))


def simulated(text: str, name: str, folder: Path, packages: tuple[Path, ...]) -> dict[str, np.ndarray]:
    file = folder / f"{name}.mo"
    file.write_text(text)
    assert simulate.rumoca(file, name, "0.2", "1e-4", "1e-9", folder / "r.npz", packages=packages) == ""
    with np.load(folder / "r.npz") as found:
        return {k: found[k] for k in found.files}


def test_a_controller_of_the_library_holds_a_stack_on_its_reference(tmp_path: Path) -> None:
    """A spring beside the load takes a twentieth of the stroke, which the integral part gives back."""
    with_it = simulate.run("HystFMU.Examples.StackInLoop", tmp_path / "example.npz").instants()
    without = simulated(
        "model Open extends HystFMU.Examples.StackInLoop(controller(Kp = 0, Ki = 0)); end Open;",
        "Open",
        tmp_path,
        (library.ROOT,),
    )
    assert tracking(with_it) < 0.2
    assert tracking(without) > 1.5


@bench.needs_standard
def test_a_controller_of_the_standard_library_does(tmp_path: Path) -> None:
    """The loop that the guide shows."""
    page = library.text(library.ROOT / "UsersGuide" / "TutorialActuator.mo")
    code = re.search(r"<pre>\n(.*?)</pre>", page, re.DOTALL)
    assert code is not None
    text = html.unescape(code[1]).replace('\\"', '"')
    assert tracking(simulated(text, "WithStandardBlocks", tmp_path, bench.ROOTS)) < 2
