"""Every function of the two standards in every state: allowed ones work, the others say their name and the state.

The tables are those of FMI 2.0.4, section 4.2.4 (stepInProgress and stepCanceled cannot occur, stepFailed is Step
Mode: a discarded step leaves the unit as it was) and of FMI 3.0.1, sections 2.3 and 4.2.1 (without Event Mode and
Configuration Mode).
"""

from __future__ import annotations

import ctypes as C
import subprocess
from collections.abc import Callable
from typing import Any

import pytest
from fmu_master import ERROR, OK, H, Master, single

STATES = ("Instantiated", "Initialization Mode", "Step Mode", "Terminated")
ANY, READ, WRITE = "+ + + +", ". + + +", "+ + + ."
ZERO, NONE = C.c_size_t(0), None

Call = Callable[[Master], int]


def _plain(name: str, *arguments: Any) -> Call:
    return lambda m: m.call(name, *arguments)


def _state(name: str, *extra: Any) -> Call:
    def call(m: Master) -> int:
        state = m.save()
        pointer = C.byref(state) if name.startswith("Free") else state
        status = m.call(name, pointer, *extra)
        if not name.startswith("Free"):
            m.forget(state)
        return status

    return call


def _serialize(m: Master) -> int:
    state = m.save()
    m.serialize(state)
    return m.forget(state)


def _deserialize(m: Master) -> int:
    status, state = m.deserialize(m.memory())
    return status or m.forget(state)


def _get_state(m: Master) -> int:
    return m.forget(m.save())


# function: allowed in Instantiated, Initialization Mode, Step Mode, Terminated; how it is called
FMI2: dict[str, tuple[str, Call]] = {
    "GetTypesPlatform": (ANY, lambda m: OK if m.lib.fmi2GetTypesPlatform() else ERROR),
    "GetVersion": (ANY, lambda m: OK if m.lib.fmi2GetVersion() else ERROR),
    "SetDebugLogging": (ANY, _plain("SetDebugLogging", 1, ZERO, NONE)),
    "SetupExperiment": (
        "+ . . .",
        _plain("SetupExperiment", 0, C.c_double(0), C.c_double(0), 0, C.c_double(0)),
    ),
    "EnterInitializationMode": ("+ . . .", _plain("EnterInitializationMode")),
    "ExitInitializationMode": (". + . .", _plain("ExitInitializationMode")),
    "Terminate": (". . + .", _plain("Terminate")),
    "Reset": (ANY, _plain("Reset")),
    "GetReal": (READ, lambda m: m._access("Get", "y", None)[0]),
    "GetInteger": (READ, _plain("GetInteger", NONE, ZERO, NONE)),
    "GetBoolean": (READ, _plain("GetBoolean", NONE, ZERO, NONE)),
    "GetString": (READ, _plain("GetString", NONE, ZERO, NONE)),
    "SetReal": (WRITE, lambda m: m.set("u", 0.5)),
    "SetInteger": (WRITE, _plain("SetInteger", NONE, ZERO, NONE)),
    "SetBoolean": (WRITE, _plain("SetBoolean", NONE, ZERO, NONE)),
    "SetString": (WRITE, _plain("SetString", NONE, ZERO, NONE)),
    "GetFMUstate": (ANY, _get_state),
    "SetFMUstate": (ANY, _state("SetFMUstate")),
    "FreeFMUstate": (ANY, _state("FreeFMUstate")),
    "SerializedFMUstateSize": (ANY, _state("SerializedFMUstateSize", C.byref(C.c_size_t()))),
    "SerializeFMUstate": (ANY, _serialize),
    "DeSerializeFMUstate": (ANY, _deserialize),
    "DoStep": (". . + .", lambda m: m.step(0.0)),
    "GetRealStatus": (". . + +", _plain("GetRealStatus", 2, C.byref(C.c_double()))),
    "GetBooleanStatus": (". . + +", _plain("GetBooleanStatus", 3, C.byref(C.c_int()))),
}
FMI3: dict[str, tuple[str, Call]] = {
    "GetVersion": (ANY, lambda m: OK if m.lib.fmi3GetVersion() else ERROR),
    "SetDebugLogging": (ANY, _plain("SetDebugLogging", 1, ZERO, NONE)),
    "EnterInitializationMode": ("+ . . .", lambda m: m.enter()),
    "ExitInitializationMode": (". + . .", _plain("ExitInitializationMode")),
    "Terminate": (". . + .", _plain("Terminate")),
    "Reset": (ANY, _plain("Reset")),
    "GetFloat64": (READ, lambda m: m._access("Get", "y", None)[0]),
    "GetInt32": (READ, _plain("GetInt32", NONE, ZERO, NONE, ZERO)),
    "GetInt64": (READ, _plain("GetInt64", NONE, ZERO, NONE, ZERO)),
    "GetBoolean": (READ, _plain("GetBoolean", NONE, ZERO, NONE, ZERO)),
    "SetFloat64": (WRITE, lambda m: m.set("u", 0.5)),
    "SetInt32": (WRITE, _plain("SetInt32", NONE, ZERO, NONE, ZERO)),
    "SetInt64": (WRITE, _plain("SetInt64", NONE, ZERO, NONE, ZERO)),
    "SetBoolean": (WRITE, _plain("SetBoolean", NONE, ZERO, NONE, ZERO)),
    "GetFMUState": (ANY, _get_state),
    "SetFMUState": (ANY, _state("SetFMUState")),
    "FreeFMUState": (ANY, _state("FreeFMUState")),
    "SerializedFMUStateSize": (ANY, _state("SerializedFMUStateSize", C.byref(C.c_size_t()))),
    "SerializeFMUState": (ANY, _serialize),
    "DeserializeFMUState": (ANY, _deserialize),
    "DoStep": (". . + .", lambda m: m.step(0.0)),
}


def _words(text: str) -> list[str]:
    return text.split()


# what modelDescription.xml does not declare: an error in every state, and the name in the message
ABSENT2 = _words(
    """
    GetDirectionalDerivative SetRealInputDerivatives GetRealOutputDerivatives CancelStep EnterEventMode
    NewDiscreteStates EnterContinuousTimeMode CompletedIntegratorStep SetTime SetContinuousStates GetDerivatives
    GetEventIndicators GetContinuousStates GetNominalsOfContinuousStates
    """
)
ABSENT3 = _words(
    """
    GetFloat32 SetFloat32 GetInt8 SetInt8 GetUInt8 SetUInt8 GetInt16 SetInt16 GetUInt16 SetUInt16 GetUInt32
    SetUInt32 GetUInt64 SetUInt64 GetString SetString GetBinary SetBinary GetClock SetClock
    GetNumberOfVariableDependencies GetVariableDependencies GetDirectionalDerivative GetAdjointDerivative
    EnterConfigurationMode ExitConfigurationMode EnterEventMode EnterStepMode GetIntervalDecimal GetIntervalFraction
    GetShiftDecimal GetShiftFraction SetIntervalDecimal SetIntervalFraction SetShiftDecimal SetShiftFraction
    EvaluateDiscreteStates UpdateDiscreteStates EnterContinuousTimeMode CompletedIntegratorStep SetTime
    SetContinuousStates GetContinuousStateDerivatives GetEventIndicators GetContinuousStates
    GetNominalsOfContinuousStates GetNumberOfEventIndicators GetNumberOfContinuousStates GetOutputDerivatives
    ActivateModelPartition
    """
)
# these answer Discard in Step Mode: nothing is ever pending
PENDING2 = {"GetStatus": 0, "GetIntegerStatus": 0, "GetStringStatus": 1}


def _bring(m: Master, state: str) -> None:
    if state != "Instantiated":
        assert m.enter() == OK
    if state in ("Step Mode", "Terminated"):
        assert m.call("ExitInitializationMode") == OK
    if state == "Terminated":
        assert m.call("Terminate") == OK


@pytest.mark.parametrize("state", STATES)
def test_matrix(make: Callable[..., Master], fmi: int, state: str) -> None:
    for name, (allowed, call) in (FMI2 if fmi == 2 else FMI3).items():
        m = make()
        _bring(m, state)
        before, m.messages[:] = m.memory(), []
        status = call(m)
        if allowed.split()[STATES.index(state)] == "+":
            assert status == OK, (name, m.messages)
            assert m.messages == [] or name == "SetDebugLogging"
        else:
            assert status == ERROR, name
            assert m.messages == [(ERROR, "logStatusError", f"fmi{fmi}{name} is not allowed in the state '{state}'.")]
            assert m.memory() == before, f"{name} was refused and yet changed something"


@pytest.mark.parametrize("state", STATES)
def test_absent(make: Callable[..., Master], fmi: int, state: str) -> None:
    m = make()
    _bring(m, state)
    before = m.memory()
    for name in ABSENT2 if fmi == 2 else ABSENT3:
        m.messages.clear()
        assert m.call(name, *[NONE] * 8) == ERROR
        assert [t[0] for t in m.messages] == [ERROR]
        assert m.messages[0][2].startswith(f"fmi{fmi}{name} is not available: ")
    assert m.memory() == before


def test_tables_are_complete(make: Callable[..., Master], fmi: int) -> None:
    """Every exported function stands in a table of this file."""
    m = make()
    life = ["Instantiate", "FreeInstance"]
    if fmi == 3:
        life = ["InstantiateCoSimulation", "InstantiateModelExchange", "InstantiateScheduledExecution", "FreeInstance"]
    known = {*life, *(FMI2 if fmi == 2 else FMI3), *(ABSENT2 if fmi == 2 else ABSENT3), *(PENDING2 if fmi == 2 else ())}
    listed = subprocess.run(["nm", "-D", "--defined-only", m.lib._name], capture_output=True, text=True, check=True)
    exported = {line.split()[-1] for line in listed.stdout.splitlines()}
    assert {s.removeprefix(f"fmi{fmi}") for s in exported if s.startswith(f"fmi{fmi}")} == known


def test_nothing_is_pending(make: Callable[..., Master]) -> None:
    m = make()
    if m.fmi == 3:
        pytest.skip("FMI 3.0 has no status functions")
    assert m.call("GetStatus", 0, C.byref(C.c_int())) == ERROR
    m.initialize()
    for name, kind in PENDING2.items():
        assert m.call(name, kind, C.byref(C.c_void_p())) == 2  # fmi2Discard
    last = C.c_double()
    m.step(0.0)
    assert m.call("GetRealStatus", 2, C.byref(last)) == OK
    assert last.value == H


def test_null_instance(make: Callable[..., Master], fmi: int) -> None:
    m = make()
    c, m.c = m.c, C.c_void_p(None)
    for name in [*(ABSENT2 if fmi == 2 else ABSENT3), "Reset", "Terminate", "ExitInitializationMode"]:
        assert m.call(name, *[NONE] * 8) == ERROR
    assert m.step(0.0) == ERROR
    m.free()
    m.c = c


def test_wrong_interface(make: Callable[..., Master], fmi: int) -> None:
    m = make()
    m.messages.clear()
    if fmi == 2:
        args = (b"i", 0, m.token.encode(), m.resources.as_uri().encode(), C.byref(m._functions), 0, 0)
        assert m.lib.fmi2Instantiate(*args) in (0, None)
    else:
        args3 = (b"i", m.token.encode(), f"{m.resources}/".encode(), 0, 0, None, m._log)
        assert m.lib.fmi3InstantiateModelExchange(*args3) in (0, None)
    assert m.messages == [(ERROR, "logStatusError", "This FMU is for co-simulation only.")]


def test_single_is_what_the_tables_assume() -> None:
    assert [p.name for p in single("prandtl_ishlinskii").ports][:2] == ["u", "y"]
