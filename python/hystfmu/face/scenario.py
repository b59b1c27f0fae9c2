"""A scenario: the same object whether it was read from a scenario.toml or built in Python."""

from __future__ import annotations

import copy
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from hystfmu.base.calls import checked
from hystfmu.base.errors import InputError
from hystfmu.base.files import check
from hystfmu.face.defaults import completed
from hystfmu.face.parts import What, described, files
from hystfmu.face.result import Result
from hystfmu.face.saved import save
from hystfmu.model import Model
from hystfmu.scenario import Engine, Run, run_scenarios
from hystfmu.scenario import Scenario as Cases
from hystfmu.scenario.system.case import NAME, split_end
from hystfmu.scenario.system.folders import inside
from hystfmu.scenario.system.spec import MetricKind, ScenarioSpec, Scheme, UnitSpec

if TYPE_CHECKING:
    from hystfmu.scenario.loop.opened import OpenedLoop

__all__ = ["Scenario"]


@checked
class Scenario:
    """A closed loop of units: what runs, how it is connected, what is measured, in which cases.

    Units run in the order in which they were added (`order` states another one), each with the newest values: first the
    plant advances with the command that was held since the last step, then the other units see its new output.

    Parameters
    ----------
    name : str
        A letter followed by letters, digits or _.
    step : float
        Step of the units (s).
    stop : float, optional
        End of the run (s); by default three periods of the slowest reference, and metrics count from the second on.
    ripple : int
        Steps of the units that are `fine` in each step.
    text : str
        One line for a reader.
    coupling : {"gauss_seidel", "jacobi", "iterative"}
        How units that step at the same time exchange values.

    Raises
    ------
    InputError
        An invalid name, a step that is not greater than 0.

    Notes
    -----
    If connections or metrics name the unit ``reference`` and none was added, a sine over 80 % of the plant's stroke is
    added: `r`, and `r_lead` one step ahead for an inverse.

    Examples
    --------
    >>> import hystfmu as hy
    >>> plant = hy.fit(hy.synthetic.piezo(60, 1000.0), "prandtl_ishlinskii")
    >>> loop = hy.Scenario("tracking", step=1e-4)
    >>> loop = loop.add("plant", plant, fine=True).add("inverse", plant.inverse())
    >>> loop = loop.connect("reference.r_lead", "inverse.u").connect("inverse.y", "plant.u")
    >>> loop = loop.metric("tracking", "rms_percent", "plant.y", against="reference.r", limit=0.05)
    >>> loop
    Scenario('tracking', 2 units, 1 metric, 1 case)
    >>> loop.run().passed
    True
    >>> loop.save("mine").name
    'mine'
    """

    def __init__(
        self,
        name: str,
        *,
        step: float,
        stop: float | None = None,
        ripple: int = 1,
        text: str = "",
        coupling: Scheme = "gauss_seidel",
    ) -> None:
        self._origin = f"scenario {name!r}"
        if not re.fullmatch(NAME, name):
            raise InputError(f"{self._origin}: The name must be a letter followed by letters, digits or _.")
        self._folder: Path | None = None
        self._attached: dict[str, Model | Path] = {}
        if not (isinstance(step, (int, float, np.number)) and np.isfinite(step) and step > 0):
            raise InputError(f"{self._origin}: The step must be a float in (0, inf). Got {step} instead.")
        self._spec: dict[str, Any] = {"name": name, "step": _number(step)}
        self._spec |= {"text": text} if text else {}
        self._spec |= {"stop": _number(stop)} if stop is not None else {}
        self._spec |= {"ripple": ripple} if ripple != 1 else {}
        if coupling != "gauss_seidel":
            self._spec["coupling"] = {"scheme": coupling}

    @classmethod
    def load(cls, path: str | Path) -> Scenario:
        """Read a scenario.toml.

        Parameters
        ----------
        path : str or Path
            The file, or the folder that holds it.

        Raises
        ------
        InputError
            One line with the file, the key, the rule and the value.
        """
        read = Cases(path)
        made = cls(read.spec.name, step=read.spec.step)
        made._origin, made._folder = read.origin, read.folder
        made._spec = read.spec.model_dump(by_alias=True, exclude_unset=True, exclude={"format"})
        return made

    # ---- what a scenario says ---------------------------------------------------------------------------------------
    @property
    def name(self) -> str:
        """Name of the scenario."""
        return str(self._spec["name"])

    @property
    def cases(self) -> tuple[str, ...]:
        """Names of the cases; without any there is one, ``nominal``."""
        return tuple(c["name"] for c in self._spec.get("case", ())) or ("nominal",)

    def add(
        self,
        name: str,
        what: What,
        *,
        fine: bool = False,
        every: int = 1,
        substeps: int = 1,
        hold: Literal["zero", "first"] = "zero",
        runs_as: Literal["fmu2", "fmu3"] = "fmu2",
        inputs: Mapping[str, float] | None = None,
        set: Mapping[str, Any] | None = None,
        text: str = "",
    ) -> Scenario:
        """Add a unit.

        Parameters
        ----------
        name : str
            Its ports are then ``name.port``.
        what : Model, block, Node, Graph, or path
            A path is that of an FMU of any origin or of a ``*.model.toml``.
        fine : bool
            Runs `ripple` times per step: plants, and what is measured between samples.
        every : int
            Runs once in so many steps.
        substeps : int
            Steps of the unit in each of its periods.
        hold : {"zero", "first"}
            Its connected inputs during a period: held, or on the straight line through the last two values.
        runs_as : {"fmu2", "fmu3"}
            Version of FMI of the unit, for the engine "fmpy".
        inputs : mapping of str to float, optional
            Constant values of inputs that nothing is connected to.
        set : mapping, optional
            Parameters by name; a string ``"*1.2"`` scales.
        text : str
            One line for a reader.

        Returns
        -------
        Scenario
            This one.

        Raises
        ------
        InputError
            A second unit of that name, something that is no unit.
        """
        where = f"{self._origin}: units.{name}"
        if not re.fullmatch(NAME, name):
            raise InputError(
                f"{where}: The name must be a letter followed by letters, digits or _. Got {name!r} instead."
            )
        if name in self._spec.get("units", {}):
            raise InputError(f"{where}: The name of a unit must occur once. Got a second {name!r}.")
        table, attached = described(what, name, where)
        said = {"fine": fine, "every": every, "substeps": substeps, "hold": hold, "as": runs_as, "text": text}
        usual = {"fine": False, "every": 1, "substeps": 1, "hold": "zero", "as": "fmu2", "text": ""}
        table |= {k: v for k, v in said.items() if v != usual[k]}
        table |= {"inputs": {k: _number(v) for k, v in inputs.items()}} if inputs else {}
        table |= {"set": dict(set)} if set else {}
        check(table, UnitSpec, where)
        self._edit()
        self._spec.setdefault("units", {})[name] = table
        if "order" in self._spec:
            self._spec["order"].append(name)
        self._attached |= attached
        return self

    def connect(self, source: str, target: str) -> Scenario:
        """Connect the output `source` to the input `target`, each ``unit.port``.

        Raises
        ------
        InputError
            An end that is not of that form, an input that is connected already.
        """
        for end in (source, target):
            split_end(end, f"{self._origin}: connections")
        known = self._spec.get("connections", {}).get(target)
        if known is not None:
            raise InputError(
                f"{self._origin}: connections: The input {target!r} must have one source. Got {source!r} and {known!r}."
            )
        self._edit()
        self._spec.setdefault("connections", {})[target] = source
        return self

    def metric(
        self,
        name: str,
        kind: MetricKind,
        signal: str,
        against: str | None = None,
        limit: float | None = None,
        *,
        stroke: float | None = None,
        after: float | None = None,
        lines: bool = False,
        text: str = "",
    ) -> Scenario:
        """Add a metric, with a limit if there is one.

        Parameters
        ----------
        name : str
        kind : str
            What is computed: rms_percent, max_percent, between_samples_percent (all of `signal` - `against`),
            variation_ratio, rms, peak, final, loop_area_percent; `hystfmu.scenario.outcome.metrics` defines them.
        signal, against : str
            ``unit.output``; most kinds compare two.
        limit : float, optional
            Largest value that passes.
        stroke : float, optional
            What 100 percent is; default: the span of `against`.
        after : float, optional
            Rows at or after this time (s) count.
        lines : bool
            Of rms_percent, rms and max_percent: only the lines of a scan, without its turns.
        text : str
            One line for a reader.

        Returns
        -------
        Scenario
            This one.
        """
        numbers = {"limit": limit, "stroke": stroke, "after": after}
        self._edit()
        self._spec.setdefault("metrics", {})[name] = (
            {"kind": kind, "signal": signal}
            | ({"against": against} if against is not None else {})
            | {k: _number(v) for k, v in numbers.items() if v is not None}
            | ({"lines": True} if lines else {})
            | ({"text": text} if text else {})
        )
        return self

    def case(
        self,
        name: str,
        text: str = "",
        *,
        stop: float | None = None,
        after: float | None = None,
        set: Mapping[str, Any] | None = None,
        limits: Mapping[str, float] | None = None,
        units: Mapping[str, What] | None = None,
        order: Sequence[str] | None = None,
        connections: Mapping[str, str] | None = None,
    ) -> Scenario:
        """Add a case: what differs from the scenario.

        Parameters
        ----------
        name : str
        text : str
            One line for a reader.
        stop, after : float, optional
            End of the run, and first time that metrics count (s).
        set : mapping, optional
            ``{"unit.parameter": value}``; a string ``"*1.2"`` scales.
        limits : mapping, optional
            Limits of metrics by name.
        units : mapping, optional
            Units that are added, or replaced as a whole (they keep how they run).
        order : sequence of str, optional
            Order of the units, when it differs.
        connections : mapping, optional
            ``{"unit.input": "unit.output"}``, added or replaced.

        Returns
        -------
        Scenario
            This one.
        """
        table: dict[str, Any] = {"name": name}
        table |= {"text": text} if text else {}
        table |= {k: _number(v) for k, v in (("stop", stop), ("after", after)) if v is not None}
        table |= {k: dict(v) for k, v in (("set", set), ("connections", connections)) if v}
        table |= {"limits": {k: _number(v) for k, v in limits.items()}} if limits else {}
        table |= {"order": list(order)} if order is not None else {}
        self._edit()
        for unit, what in (units or {}).items():
            made, attached = described(what, f"{name}_{unit}", f"{self._origin}: case {name}: units.{unit}")
            kept = ("fine", "every", "substeps", "hold", "as", "inputs")
            old = {k: v for k, v in self._spec.get("units", {}).get(unit, {}).items() if k in kept}
            table.setdefault("units", {})[unit] = old | made
            self._attached |= attached
        self._spec.setdefault("case", []).append(table)
        return self

    def order(self, *names: str) -> Scenario:
        """State the order in which the units run: the `names` of all, once each."""
        self._edit()
        self._spec["order"] = list(names)
        return self

    def record(self, *signals: str) -> Scenario:
        """State the `signals` that a baseline keeps and a report shows; by default those of the metrics."""
        self._edit()
        self._spec["record"] = list(signals)
        return self

    def loop(self, abscissa: str, ordinate: str) -> Scenario:
        """Add a pair of outputs, `abscissa` and `ordinate`, that a report draws as a loop."""
        self._edit()
        self._spec.setdefault("loops", []).append([abscissa, ordinate])
        return self

    def margins(
        self,
        case: str | None = None,
        *,
        Ms_db: float | None = None,
        corners: Sequence[str] = ("*",),
        slopes: tuple[float, float] | None = None,
        stable_to_steps: float | None = None,
        expected_unstable: Sequence[str] = (),
    ) -> Scenario:
        """State limits of the linearised loop; ``hystfmu margins`` checks them.

        Parameters
        ----------
        case : str, optional
            Case whose sensitivity is limited, for slope 1 of plant over inverse; default the first.
        Ms_db : float, optional
            Largest peak of its sensitivity (dB).
        corners : sequence of str
            Cases whose loops must be stable; ``?`` and ``*`` stand for any letters.
        slopes : (float, float), optional
            Local slopes of plant over inverse in the corners; default those along their paths.
        stable_to_steps : float, optional
            Steps beyond the delay of a corner up to which it is stable.
        expected_unstable : sequence of str
            Cases whose linear loop is unstable for a slope of their path although their run is good; any other such
            case fails.

        Returns
        -------
        Scenario
            This one.
        """
        numbers = {"Ms_db": Ms_db, "stable_to_steps": stable_to_steps}
        table = {"case": case} | {k: _number(v) for k, v in numbers.items()} | {"corners": list(corners)}
        table |= {"slopes": [_number(v) for v in slopes]} if slopes is not None else {}
        table |= {"expected_unstable": list(expected_unstable)} if expected_unstable else {}
        self._edit()
        self._spec["margins"] = {k: v for k, v in table.items() if v is not None}
        return self

    # ---- what is done with it ---------------------------------------------------------------------------------------
    def run(
        self,
        case: str | None = None,
        *,
        engine: Engine = "fmpy",
        set: Mapping[str, Any] | None = None,
        coupling: Scheme | None = None,
        seconds: float = 600.0,
        confined: bool = True,
        out: str | Path | None = None,
    ) -> Result:
        """Run one case; `hystfmu.run(scenario)` runs all.

        Parameters
        ----------
        case : str, optional
            Needed where there are several.
        engine : {"fmpy", "native"}
            FMUs by fmpy (the reference), or the whole loop in the C core; both give the same bits.
        set : mapping, optional
            ``{"unit.parameter": value}`` for this run.
        coupling : str, optional
            Scheme for this run.
        seconds : float
            Longest time of a run with foreign FMUs.
        confined : bool
            Whether these run without network and write into a folder of their own only, where the system can.
        out : path, optional
            Write all outputs there, as CSV.

        Returns
        -------
        Result
            Compared with the limits; an unchanged scenario from a file also with its baseline.

        Raises
        ------
        InputError
            A key, a unit or a connection that does not fit; the sentence names it.
        """
        if case is None and len(self.cases) > 1:
            raise InputError(
                f"{self._origin}: The case of run() must be one of {', '.join(self.cases)}. Got none; hystfmu.run() "
                "runs all."
            )
        how = Run(engine, coupling, seconds, confined=confined)
        found = run_scenarios([self.ready()], how, case=case, overrides=set, out=out)
        return Result.of(found[0])

    def save(self, folder: str | Path) -> Path:
        """Write `folder`/scenario.toml, with the models and FMUs of its units beside it.

        ``hystfmu run folder`` runs it with the same bits; the first time with ``--record``, which makes its baseline.

        Returns
        -------
        Path
            The folder.

        Raises
        ------
        InputError
            A scenario that is not complete, or a file that cannot be written.
        """
        whole = copy.deepcopy(self)
        whole._edit()
        spec = completed(whole._spec, whole._attached, whole._origin)
        whole.ready()  # what is written can be read
        return save(spec, whole._attached, Path(folder))

    def export_controller(
        self,
        path: str | Path,
        fmi: Literal[2, 3] = 2,
        case: str | None = None,
        name: str | None = None,
        platforms: Literal["host", "all"] = "host",
        source: bool = False,
    ) -> Path:
        """Write the controller alone as an FMU: all units between reference, measured output and command.

        Inputs are `r`, `y`, what the feed-forward reads ahead (`r_ahead`, `r_dot`, `r_ddot`) and `u_present`, output is
        `u`; the FMU is called once for each sample.

        Parameters
        ----------
        path : str or Path
            The file, usually ``*.fmu``; written as a whole or not at all.
        fmi : {2, 3}
            Version of the standard.
        case : str, optional
            Case whose values it takes; by default the first.
        name : str, optional
            Model name and identifier; by default the name of the scenario.
        platforms : {"host", "all"}
            Pack the binary of this machine, or those of all platforms; one that is not installed is an error.
        source : bool
            Pack the C source too.

        Returns
        -------
        Path
            The file.

        Raises
        ------
        InputError
            There is no such case, the loop has no controller of one command and one measured output, its units have
            different steps, one of them is a foreign FMU, or the file cannot be written.

        Examples
        --------
        >>> import hystfmu as hy
        >>> plant = hy.fit(hy.synthetic.piezo(60, 1000.0), "prandtl_ishlinskii")
        >>> loop = hy.Scenario("tracking", step=1e-3).add("plant", plant).add("inverse", plant.inverse())
        >>> loop = loop.connect("reference.r", "inverse.u").connect("inverse.y", "plant.u")
        >>> loop = loop.metric("tracking", "rms_percent", "plant.y", against="reference.r")
        >>> loop.export_controller("controller.fmu").name
        'controller.fmu'
        """
        from hystfmu.scenario.deploy.unit import write_controller

        ready = self.ready().named(case)
        return write_controller(ready, path, fmi, name, platforms, source).path

    def open_loop(self, case: str | None = None, *, set: Mapping[str, Any] | None = None) -> OpenedLoop:
        """Return the linearised loop of a case, opened at the input of its plant.

        Parameters
        ----------
        case : str, optional
            By default the first.
        set : mapping, optional
            ``{"unit.parameter": value}``; a string ``"*1.2"`` scales.

        Raises
        ------
        InputError
            An unknown case, or one without a loop that is linear at rest.

        Examples
        --------
        >>> import hystfmu as hy
        >>> hy.Scenario.load("scenarios/pid").open_loop("sine_10").margins().stable  # doctest: +SKIP
        True
        """
        from hystfmu.scenario import build
        from hystfmu.scenario.loop.opening import open_loop

        cases = {c.name: c for c in self.ready().changed(dict(set or {}), None).cases}
        if case is not None and case not in cases:
            raise InputError(f"{self._origin}: The case must be one of {', '.join(cases)}. Got {case!r} instead.")
        return open_loop(build(cases[case] if case is not None else next(iter(cases.values()))), (1.0, 1.0))

    @property
    def table(self) -> dict[str, Any]:
        """Complete table of the scenario: a copy, with the keys of a scenario.toml."""
        return copy.deepcopy(completed(self._spec, self._attached, self._origin))

    def changed(self, table: Mapping[str, Any]) -> Scenario:
        """Return a scenario with another table and the same files.

        Parameters
        ----------
        table : mapping
            As `table` returns it, changed.

        Raises
        ------
        InputError
            A key that does not fit.
        """
        made = copy.copy(self)
        made._edit()
        made._attached = dict(made._attached)
        check(dict(table), ScenarioSpec, made._origin)
        made._spec = copy.deepcopy(dict(table))
        return made

    def ready(self) -> Cases:
        """The complete cases, as `hystfmu.scenario` runs them.

        Raises
        ------
        InputError
            As `run`.
        """
        spec = completed(self._spec, self._attached, self._origin)
        return Cases.of(check(spec, ScenarioSpec, self._origin), self._origin, self._attached, self._folder)

    def _repr_html_(self) -> str:
        """As a notebook shows it: units in their order, connections, metrics, cases."""
        from hystfmu.face.listed import scenario_html

        return scenario_html(self._spec)

    def __repr__(self) -> str:
        counts = [(len(self._spec.get(key, ())), word) for key, word in (("units", "unit"), ("metrics", "metric"))]
        shown = [f"{n} {word}{'' if n == 1 else 's'}" for n, word in [*counts, (len(self.cases), "case")]]
        return f"Scenario({', '.join([repr(self.name), *shown])})"

    def _edit(self) -> None:
        """Separate the scenario from its file: it has no baseline, and its files are attached."""
        if self._folder is None:
            return
        self._attached = dict(self._attached)
        for unit, key in files(self._spec):
            self._attached.setdefault(unit[key], inside(self._folder, unit[key], f"{self._origin}: {key}"))
        self._folder, self._origin = None, f"scenario {self.name!r}"


def _number(value: Any) -> Any:
    """A number of any kind as TOML and the checks of the file take it; other values are refused there."""
    if isinstance(value, bool) or not hasattr(value, "__float__"):
        return value
    return float(value)
