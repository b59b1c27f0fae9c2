"""Every function of FMI 2.0 and 3.0 in every state: allowed calls work, others are refused with name and state.

The tables are those of FMI 2.0.4, sections 3.2.3 (Model Exchange) and 4.2.4 (Co-Simulation; stepInProgress and
stepCanceled cannot occur, stepFailed is Step Mode: a discarded step leaves the unit as it was), and of FMI 3.0.1,
sections 2.3 (common states), 3.2 and 4.2 (without Configuration Mode; Intermediate Update: test_fmu_ahead.py).
"""

import ctypes as C
import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from fmu_events import EventInfo, Events
from fmu_master import ERROR, OK, H, Make, Master, mixed, single

STATES = {
    "I": "Instantiated", "N": "Initialization Mode", "E": "Event Mode", "S": "Step Mode", "C": "Continuous-Time Mode",
    "T": "Terminated",
}  # fmt: skip
OF = {"cs": "INST", "event": "INEST", "me": "INECT"}  # the states of an interface; "event": FMI 3.0 with Event Mode
CASES = [
    pytest.param(fmi, interface, state, id=f"fmi{fmi}-{interface}-{STATES[state]}")
    for fmi in (2, 3)
    for interface, states in OF.items()
    for state in states
    if (fmi, interface) != (2, "event")
]
ANY = "INESCT"
READ2, READ3 = "NESCT", ANY  # FMI 3.0, section 2.3.2: start values can be read in the state Instantiated
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


def _event2(m: Master) -> int:
    return m.call("NewDiscreteStates", C.byref(EventInfo()))


def _event3(m: Master) -> int:
    return m.call("UpdateDiscreteStates", *[C.byref(C.c_bool()) for _ in range(5)], C.byref(C.c_double()))


def _fill(name: str) -> Call:
    """Return a call that fills an array with one number per state."""
    return lambda m: m.call(name, (C.c_double * 2)(), C.c_size_t(2))


def _count(name: str) -> Call:
    return lambda m: m.call(name, C.byref(C.c_size_t()))


def _completed(m: Master) -> int:
    return m.call("CompletedIntegratorStep", 1, C.byref(C.c_int()), C.byref(C.c_int()))


def _tangent(name: str) -> Call:
    """Return a call for dy / du; y is variable 1, u is variable 0."""

    def call(m: Master) -> int:
        one = [C.byref(C.c_uint(1)), C.c_size_t(1), C.byref(C.c_uint(0)), C.c_size_t(1)]
        counts = [[], []] if m.fmi == 2 else [[C.c_size_t(1)], [C.c_size_t(1)]]
        return m.call(name, *one, C.byref(C.c_double(1)), *counts[0], C.byref(C.c_double()), *counts[1])

    return call


# function: states of Co-Simulation and of Model Exchange in which it is allowed; how it is called
Table = dict[str, tuple[str, str, Call]]
FMI2: Table = {
    "GetTypesPlatform": (ANY, ANY, lambda m: OK if m.lib.fmi2GetTypesPlatform() else ERROR),
    "GetVersion": (ANY, ANY, lambda m: OK if m.lib.fmi2GetVersion() else ERROR),
    "SetDebugLogging": (ANY, ANY, _plain("SetDebugLogging", 1, ZERO, NONE)),
    "SetupExperiment": ("I", "I", _plain("SetupExperiment", 0, C.c_double(0), C.c_double(0), 0, C.c_double(0))),
    "EnterInitializationMode": ("I", "I", _plain("EnterInitializationMode")),
    "ExitInitializationMode": ("N", "N", _plain("ExitInitializationMode")),
    "Terminate": ("S", "EC", _plain("Terminate")),
    "Reset": (ANY, ANY, _plain("Reset")),
    "GetReal": (READ2, READ2, lambda m: m._access("Get", "y", None)[0]),
    "GetInteger": (READ2, READ2, _plain("GetInteger", NONE, ZERO, NONE)),
    "GetBoolean": (READ2, READ2, _plain("GetBoolean", NONE, ZERO, NONE)),
    "GetString": (READ2, READ2, _plain("GetString", NONE, ZERO, NONE)),
    "SetReal": ("INS", "INEC", lambda m: m.set("u", 0.5)),
    "SetInteger": ("INS", "INE", _plain("SetInteger", NONE, ZERO, NONE)),
    "SetBoolean": ("INS", "INE", _plain("SetBoolean", NONE, ZERO, NONE)),
    "SetString": ("INS", "INE", _plain("SetString", NONE, ZERO, NONE)),
    "GetDirectionalDerivative": (READ2, READ2, _tangent("GetDirectionalDerivative")),
    "GetFMUstate": (ANY, ANY, _get_state),
    "SetFMUstate": (ANY, ANY, _state("SetFMUstate")),
    "FreeFMUstate": (ANY, ANY, _state("FreeFMUstate")),
    "SerializedFMUstateSize": (ANY, ANY, _state("SerializedFMUstateSize", C.byref(C.c_size_t()))),
    "SerializeFMUstate": (ANY, ANY, _serialize),
    "DeSerializeFMUstate": (ANY, ANY, _deserialize),
    "DoStep": ("S", "", lambda m: m.step(0.0)),
    "SetRealInputDerivatives": ("INS", "", _plain("SetRealInputDerivatives", NONE, ZERO, NONE, NONE)),
    "GetRealStatus": ("ST", "", _plain("GetRealStatus", 2, C.byref(C.c_double()))),
    "GetBooleanStatus": ("ST", "", _plain("GetBooleanStatus", 3, C.byref(C.c_int()))),
    "EnterEventMode": ("", "EC", _plain("EnterEventMode")),
    "NewDiscreteStates": ("", "E", _event2),
    "EnterContinuousTimeMode": ("", "E", _plain("EnterContinuousTimeMode")),
    "CompletedIntegratorStep": ("", "C", _completed),
    "SetTime": ("", "EC", _plain("SetTime", C.c_double(0))),
    "SetContinuousStates": ("", "C", _fill("SetContinuousStates")),
    "GetEventIndicators": ("", "NECT", _plain("GetEventIndicators", NONE, ZERO)),
    "GetContinuousStates": ("", "NECT", _fill("GetContinuousStates")),
    "GetDerivatives": ("", "NECT", _fill("GetDerivatives")),
    "GetNominalsOfContinuousStates": ("", "INECT", _fill("GetNominalsOfContinuousStates")),
}
FMI3: Table = {
    "GetVersion": (ANY, ANY, lambda m: OK if m.lib.fmi3GetVersion() else ERROR),
    "SetDebugLogging": (ANY, ANY, _plain("SetDebugLogging", 1, ZERO, NONE)),
    "EnterInitializationMode": ("I", "I", lambda m: m.enter()),
    "ExitInitializationMode": ("N", "N", _plain("ExitInitializationMode")),
    "Terminate": ("ES", "EC", _plain("Terminate")),
    "Reset": (ANY, ANY, _plain("Reset")),
    "GetFloat64": (READ3, READ3, lambda m: m._access("Get", "y", None)[0]),
    "GetInt32": (READ3, READ3, _plain("GetInt32", NONE, ZERO, NONE, ZERO)),
    "GetInt64": (READ3, READ3, _plain("GetInt64", NONE, ZERO, NONE, ZERO)),
    "GetBoolean": (READ3, READ3, _plain("GetBoolean", NONE, ZERO, NONE, ZERO)),
    "SetFloat64": ("INES", "INEC", lambda m: m.set("u", 0.5)),
    "SetInt32": ("INES", "INE", _plain("SetInt32", NONE, ZERO, NONE, ZERO)),
    "SetInt64": ("INES", "INE", _plain("SetInt64", NONE, ZERO, NONE, ZERO)),
    "SetBoolean": ("INES", "INE", _plain("SetBoolean", NONE, ZERO, NONE, ZERO)),
    "GetDirectionalDerivative": ("NEST", "NECT", _tangent("GetDirectionalDerivative")),
    "GetAdjointDerivative": ("NEST", "NECT", _tangent("GetAdjointDerivative")),
    "GetFMUState": (ANY, ANY, _get_state),
    "SetFMUState": (ANY, ANY, _state("SetFMUState")),
    "FreeFMUState": (ANY, ANY, _state("FreeFMUState")),
    "SerializedFMUStateSize": (ANY, ANY, _state("SerializedFMUStateSize", C.byref(C.c_size_t()))),
    "SerializeFMUState": (ANY, ANY, _serialize),
    "DeserializeFMUState": (ANY, ANY, _deserialize),
    "DoStep": ("S", "", lambda m: m.step(0.0)),
    "EnterStepMode": ("E", "", _plain("EnterStepMode")),
    "EnterEventMode": ("S", "C", _plain("EnterEventMode")),  # Co-Simulation: only if it was made with Event Mode
    "UpdateDiscreteStates": ("E", "E", _event3),
    "EnterContinuousTimeMode": ("", "E", _plain("EnterContinuousTimeMode")),
    "CompletedIntegratorStep": ("", "C", _completed),
    "SetTime": ("", "C", _plain("SetTime", C.c_double(0))),
    "SetContinuousStates": ("", "C", _fill("SetContinuousStates")),
    "GetEventIndicators": ("", "NECT", _plain("GetEventIndicators", NONE, ZERO)),
    "GetContinuousStates": ("", "NECT", _fill("GetContinuousStates")),
    "GetContinuousStateDerivatives": ("", "NECT", _fill("GetContinuousStateDerivatives")),
    "GetNominalsOfContinuousStates": ("", "NECT", _fill("GetNominalsOfContinuousStates")),
    "GetNumberOfEventIndicators": ("", ANY, _count("GetNumberOfEventIndicators")),
    "GetNumberOfContinuousStates": ("", ANY, _count("GetNumberOfContinuousStates")),
}


def _words(text: str) -> list[str]:
    return text.split()


# not declared in modelDescription.xml: an error in every state, with the name in the message
ABSENT2 = _words("GetRealOutputDerivatives CancelStep")
ABSENT3 = _words(
    """
    GetFloat32 SetFloat32 GetInt8 SetInt8 GetUInt8 SetUInt8 GetInt16 SetInt16 GetUInt16 SetUInt16 GetUInt32
    SetUInt32 GetUInt64 SetUInt64 GetString SetString GetBinary SetBinary GetClock SetClock
    GetNumberOfVariableDependencies GetVariableDependencies
    EnterConfigurationMode ExitConfigurationMode GetIntervalDecimal GetIntervalFraction
    GetShiftDecimal GetShiftFraction SetIntervalDecimal SetIntervalFraction SetShiftDecimal SetShiftFraction
    EvaluateDiscreteStates GetOutputDerivatives ActivateModelPartition
    """
)
# these return Discard in Step Mode, because nothing is ever pending
PENDING2 = {"GetStatus": 0, "GetIntegerStatus": 0, "GetStringStatus": 1}


def _bring(m: Master, state: str) -> None:
    if state != "I":
        assert m.enter() == OK
    if state in "ESCT":
        assert m.call("ExitInitializationMode") == OK
    if state in "SC" and isinstance(m, Events):
        assert m.update() == OK
        m.leave()
    if state == "T":
        assert m.call("Terminate") == OK


@pytest.mark.some(12)
@pytest.mark.parametrize(("fmi", "interface", "state"), CASES, indirect=["fmi"])
def test_matrix(make: Make, fmi: int, interface: str, state: str) -> None:
    place = f"'{STATES[state]}' of {'Model Exchange' if interface == 'me' else 'Co-Simulation'}"
    for name, (simulation, exchange, call) in (FMI2 if fmi == 2 else FMI3).items():
        # sampled blocks have no derivatives in Co-Simulation
        m = make(
            single("prandtl_ishlinskii") if name.endswith("alDerivative") or "Adjoint" in name else mixed(), interface
        )
        _bring(m, state)
        before, m.messages[:] = m.memory(), []
        status = call(m)
        allowed = state in (exchange if interface == "me" else simulation)
        if allowed and (interface, name) != ("cs", "EnterEventMode"):
            assert status == OK, (name, m.messages)
            assert m.messages == [] or name == "SetDebugLogging"
        else:
            assert status == ERROR, name
            assert [x[:2] for x in m.messages] == [(ERROR, "logStatusError")]
            assert m.messages[0][2].startswith(f"fmi{fmi}{name} is not allowed in the state {place}")
            assert m.memory() == before, f"{name} was refused but changed the state"


@pytest.mark.parametrize(("fmi", "interface", "state"), CASES, indirect=["fmi"])
def test_absent(make: Make, fmi: int, interface: str, state: str) -> None:
    m = make(mixed(), interface)
    _bring(m, state)
    before = m.memory()
    for name in ABSENT2 if fmi == 2 else ABSENT3:
        m.messages.clear()
        assert m.call(name, NONE, C.c_size_t(1), *[NONE] * 6) == ERROR
        assert [t[0] for t in m.messages] == [ERROR]
        assert m.messages[0][2].startswith(f"fmi{fmi}{name} is not available: ")
    assert m.memory() == before


def test_a_call_for_no_variable_is_no_error(make: Make, fmi: int) -> None:
    """Importers may call the functions of every type, also for types that no variable has."""
    m = make(mixed())
    m.initialize()
    m.messages.clear()
    types = "Float32 Int8 UInt8 Int16 UInt16 UInt32 UInt64 Clock String Binary" if fmi == 3 else "String"
    for name in [f"{verb}{kind}" for verb in ("Get", "Set") for kind in types.split()]:
        assert m.call(name, NONE, ZERO, NONE, NONE, ZERO) == OK
    assert m.messages == []


def test_tables_are_complete(make: Make, fmi: int) -> None:
    """Every exported function is in a table of this file."""
    m = make()
    life = ["Instantiate", "FreeInstance"]
    if fmi == 3:
        life = ["InstantiateCoSimulation", "InstantiateModelExchange", "InstantiateScheduledExecution", "FreeInstance"]
    known = {*life, *(FMI2 if fmi == 2 else FMI3), *(ABSENT2 if fmi == 2 else ABSENT3), *(PENDING2 if fmi == 2 else ())}
    listed = subprocess.run(["nm", "-D", "--defined-only", m.lib._name], capture_output=True, text=True, check=True)
    exported = {line.split()[-1] for line in listed.stdout.splitlines()}
    assert {s.removeprefix(f"fmi{fmi}") for s in exported if s.startswith(f"fmi{fmi}")} == known


def test_nothing_is_pending(make: Make) -> None:
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


def test_null_instance(make: Make, fmi: int) -> None:
    m = make()
    c, m.c = m.c, C.c_void_p(None)
    for name in [*(ABSENT2 if fmi == 2 else ABSENT3), "Reset", "Terminate", "ExitInitializationMode"]:
        assert m.call(name, *[NONE] * 8) == ERROR
    assert m.step(0.0) == ERROR
    m.free()
    m.c = c


def test_missing_interfaces(make: Make, folder: Path, fmi: int) -> None:
    """Scheduled Execution, and Model Exchange of sampled blocks without a sample period, are refused."""
    if fmi == 3:
        m = make()
        m.lib.fmi3InstantiateScheduledExecution.restype = C.c_void_p
        args = (b"i", m.token.encode(), f"{m.resources}/".encode(), 0, 0, None, m._log, None, None, None)
        assert m.lib.fmi3InstantiateScheduledExecution(*args) is None
        assert m.messages == [(ERROR, "logStatusError", "This FMU has no Scheduled Execution.")]
    graph = single("delay").with_step(0)
    sampled = Master(graph, folder / graph.token, fmi, interface="me")
    assert not sampled.c.value
    said = "Model Exchange needs the sample period of the model: export it with a step."
    assert sampled.messages == [(ERROR, "logStatusError", said)]
    assert make(graph).c.value
