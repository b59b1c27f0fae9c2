"""Edge cases of the FMI layer: derivatives in every mode, untrusted block files, forged phases.

The MC/DC run (tests/stress) listed their conditions as uncovered.  tests/c/drive_edges.c covers allocation failures and
null pointers.
"""

from __future__ import annotations

import os
import struct
import sys
import zlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from block_files import input_between_outputs, raw_bytes
from fmu_events import Events
from fmu_master import ERROR, OK, H, Master, mixed, single

from hystfmu.graph import Graph, Node

Make = Callable[..., Any]
ONE = np.ones(1)


# ---- derivatives ----------------------------------------------------------------------------------------------------
@pytest.mark.parametrize("u", [-50.0, 0.0, 50.0])
def test_derivative_in_initialization_mode(make: Make, u: float) -> None:
    """The initial curve has the slope of the linear term at 0 and the sum of all weights beyond the thresholds."""
    m = make()
    assert m.enter() == OK
    assert m.set("u", u) == OK
    places = [m.ports["y"].reference], [m.ports["u"].reference]
    w = m.get("w0") + (sum(m.get("w")) if u else m.get("w")[0])  # the first threshold is 0
    assert m.tangent(*places, ONE, 1)[1] == pytest.approx([w], rel=1e-6)
    assert m.tangent(*places, 0 * ONE, 1)[1].tolist() == [0.0]


def test_states_are_not_knowns_in_initialization_mode(make: Make) -> None:
    m = make(mixed(), "me")
    assert m.enter() == OK
    x = sum(p.size for p in m.graph.ports) + 1
    assert m.tangent([m.ports["y"].reference], [x], ONE, 1)[0] == ERROR
    assert m.messages[-1][2].endswith("is not an input or continuous state here.")


def test_derivative_of_a_sample_with_respect_to_a_continuous_state(make: Make) -> None:
    """rate = (x - previous x) / H and y = x + 1e-3 rate, with x a sum of the states."""
    m: Events = make(mixed(), "me")
    m.begin(np.array([0.3]))
    assert m.set_time(H) == OK
    assert m.call("EnterEventMode") == OK
    y, x, du = (m.ports[n].reference for n in ("y", "x", "du"))
    state = sum(p.size for p in m.graph.ports) + 1
    seen = []
    for k in range(m.n_states):
        slope = m.tangent([x, du, y], [state + k], ONE, 3)[1]
        assert slope == pytest.approx(slope[0] * np.array([1.0, 1 / H, 1 + 1e-3 / H]), rel=1e-6)
        seen.append(slope[0])
    assert max(np.abs(seen)) > 0


def test_adjoint_of_a_failing_initialisation(make: Make, fmi: int) -> None:
    if fmi == 2:
        pytest.skip("FMI 2.0 has no adjoint")
    m = make()
    assert m.enter() == OK
    assert m.set("r", *np.linspace(1.0, 0.0, 10)) == OK
    assert m.tangent([m.ports["y"].reference], [m.ports["u"].reference], ONE, 1, "Adjoint")[0] == ERROR
    assert "must not decrease" in m.messages[-1][2]


def untrusted(tmp_path: Path, fmi: int, file: bytes) -> Master:
    """Make an instance from a given block file."""
    (tmp_path / "own").mkdir()
    (tmp_path / "own" / "block.bin").write_bytes(file)
    token = file[20:60].rstrip(b"\0").decode()
    return Master(single("scaling"), tmp_path, fmi, token=token, location=(tmp_path / "own").as_uri())


def test_ports_in_any_order(tmp_path: Path, fmi: int) -> None:
    """Two gains, 2 and 3; the file lists the input between the outputs, after the parameters."""
    file, graph = input_between_outputs()
    first = sum(p.size for p in graph.ports if p.kind not in ("input", "output"))
    a, u, b = first, first + 1, first + 2
    m = untrusted(tmp_path, fmi, file)
    assert m.enter() == OK
    assert m.tangent([a, b], [u], ONE, 2)[1] == pytest.approx([2.0, 3.0], rel=1e-6)
    assert m.call("ExitInitializationMode") == OK
    assert m.tangent([b, a], [u], ONE, 2)[1].tolist() == [3.0, 2.0]
    m.free()


# ---- files ----------------------------------------------------------------------------------------------------------
def test_a_file_with_parameters_that_do_not_fit(tmp_path: Path, fmi: int) -> None:
    m = untrusted(tmp_path, fmi, raw_bytes(Node("f", "feedforward", {}, {"gain": 0.0})))
    assert not m.c.value
    assert m.messages[0][2].endswith("at f: gain must not be 0")


@pytest.mark.skipif(sys.platform != "linux", reason="opens a folder and a pipe as files")
@pytest.mark.parametrize("kind", ["folder", "pipe"])
def test_paths_that_are_not_regular_files(tmp_path: Path, fmi: int, kind: str) -> None:
    file = tmp_path / "block.bin"
    opened = -1
    if kind == "folder":
        file.mkdir()
    else:
        os.mkfifo(file)
        opened = os.open(file, os.O_RDWR)  # opening it for reading would wait for a writer
    m = Master(single("scaling"), tmp_path / "good", fmi, location=tmp_path.as_uri())
    assert not m.c.value
    assert m.messages == [(ERROR, "logStatusError", f"cannot read '{file}'")]
    if opened >= 0:
        os.close(opened)


# ---- saved states ---------------------------------------------------------------------------------------------------
EVENT, STEPPING, CONTINUOUS, INITIALIZATION = 4, 8, 16, 2


@pytest.mark.parametrize(
    ("interface", "legal"),
    [("cs", {STEPPING, INITIALIZATION}), ("me", {EVENT, CONTINUOUS, INITIALIZATION}), ("event", {EVENT, STEPPING})],
)
def test_a_forged_phase(make: Make, fmi: int, interface: str, legal: set[int]) -> None:
    """Bytes with a valid checksum may contain only phases of the interface."""
    if (fmi, interface) == (2, "event"):
        pytest.skip("FMI 2.0 has no Event Mode in Co-Simulation")
    m = make(Graph.single(Node("p", "prandtl_ishlinskii")), interface)
    content = m.memory()
    for phase in {EVENT, STEPPING, CONTINUOUS, *legal, 0, 3}:
        forged = content[:72] + struct.pack("<i", phase) + content[76:]
        forged = forged[:12] + struct.pack("<I", zlib.crc32(forged[16:])) + forged[16:]
        assert m.deserialize(forged)[0] == (OK if phase in legal else ERROR), phase
