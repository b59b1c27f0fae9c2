"""A case as readers of an SSP archive run it, and its difference from the case itself.

fmpy, libcosim, ecos and containers of fmu-manipulation-toolbox step all components in parallel, with the values of the
last step (Jacobi), with one step size and without events within steps. During the initialisation, libcosim and ecos
pass outputs on repeatedly, also to components that are earlier in the order.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from hystfmu.base.errors import InputError
from hystfmu.scenario.engine.simulation import simulate
from hystfmu.scenario.outcome.trace import Stopped, Trace
from hystfmu.scenario.system.case import Case
from hystfmu.scenario.system.system import System, build


def as_readers_run(case: Case) -> Case:
    """The case with Jacobi coupling at the base step.

    Raises
    ------
    InputError
        Iterative coupling, units of different rates, substeps, or a first-order hold: no reader implements them.
    """
    if case.coupling.scheme == "iterative":
        raise InputError(f"{case.where}: the coupling is iterative: no reader of SSP archives iterates")
    slow = [name for name, u in case.units.items() if u.every > 1]
    if slow:
        raise InputError(f"{case.where}: {slow[0]} runs once in several steps: SSP has one step")
    own = [name for name, u in case.units.items() if u.substeps > 1 or u.hold != "zero"]
    if own:
        raise InputError(f"{case.where}: {own[0]} has substeps or a hold of its own: SSP knows neither")
    coupling = case.coupling.model_copy(update={"scheme": "jacobi", "events": "grid"})
    return replace(case, ripple=1, coupling=coupling)


def run_as_readers(system: System) -> Trace:
    """The trajectory of a case that `as_readers_run` made, from initial values that agree with each other.

    Raises
    ------
    InputError
        It does not reach the end, or its units have no consistent initial values.
    """
    try:
        begins, short = system.starts(), replace(system.case, stop=0.0)
        for _ in range(len(system.parts) + 1):
            trace = simulate(replace(system, case=short, begins=tuple(begins)), "native")
            last, begins = begins, trace.values[0]
            if np.array_equal(last, begins):
                return simulate(replace(system, begins=tuple(begins)), "native")
        raise InputError(f"{system.case.where}: the initial values of its units do not agree: an algebraic loop")
    except Stopped as e:
        raise InputError(
            f"{system.case.where}: with the coupling of SSP readers (Jacobi): {e}; one FMU (-o X.fmu) keeps the order"
        ) from None


def differences(case: Case, names: Mapping[str, str], trace: Trace) -> dict[str, float]:
    """Largest difference between the trajectory of an archive and that of the case, by recorded output.

    Parameters
    ----------
    case : Case
    names : mapping
        The name of each output of the case in the archive.
    trace : Trace
        The trajectory of the archive.

    Returns
    -------
    dict
        In percent of the span of the output in the case; of its largest value if it is constant.

    Raises
    ------
    Stopped
        The case does not run.
    """
    own = simulate(build(case), "native")
    found = {}
    for name in case.record or names:
        want = own[name][:: case.ripple]
        span = float(np.ptp(want)) or float(np.abs(want).max()) or 1.0
        found[name] = 100 * float(np.abs(trace[names[name]] - want).max()) / span
    return found
