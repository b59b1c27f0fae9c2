"""The class of studies that are built in Python: a scenario, the varied parameters, and the sampling method."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, Literal, get_args

from hystfmu.base import InputError, check, checked, write_toml
from hystfmu.face.scenario import Scenario
from hystfmu.scenario.system.case import check_name
from hystfmu.studies import Outcome, study
from hystfmu.studies.spec import ParameterSpec, StudySpec

Method = Literal["random", "grid", "sobol", "latin_hypercube"]  # a search by optuna needs a study file

__all__ = ["Study"]


@checked
class Study:
    """Study: many simulations of a scenario with varied parameters.

    A study file may also contain objectives and varied design settings, which this class does not support. Use
    `hystfmu.study` to run such a file.

    Parameters
    ----------
    name : str
        Name of the study: a letter, followed by letters, digits or _.
    scenario : Scenario or path
        The scenario, or the folder of a scenario.
    method : {"random", "grid", "sobol", "latin_hypercube"}
        Sampling method of the parameters.
    n : int
        Number of variations. For a grid, it is the product of the numbers of values of all parameters instead.
    seed : int
        Seed of the random numbers.
    cases : sequence of str, optional
        Names of the cases to simulate. The default is all cases.
    engine : {"native", "fmpy"}
        Simulation engine, see `hystfmu.run`.

    Raises
    ------
    InputError
        The name is invalid, the path contains no scenario, or an option is out of range.

    Examples
    --------
    >>> import hystfmu as hy
    >>> loop = hy.Scenario("loop", step=1e-3, stop=0.01).add("source", hy.blocks.Reference(frequency=50.0))
    >>> loop = loop.metric("peak", "peak", "source.r", limit=2.5)
    >>> study = hy.Study("size", loop, method="grid").vary("source.amplitude", values=[1.0, 2.0, 3.0])
    >>> outcome = study.run("out", workers=1)
    >>> [round(row["metrics"]["peak"], 6) for row in outcome.rows]
    [1.0, 2.0, 3.0]
    """

    def __init__(
        self,
        name: str,
        scenario: Scenario | str | Path,
        *,
        method: Method = "random",
        n: int = 64,
        seed: int = 0,
        cases: Sequence[str] | None = None,
        engine: Literal["native", "fmpy"] = "native",
    ) -> None:
        self._origin = f"study {name!r}"
        check_name(name, self._origin)
        if method not in get_args(Method):
            raise InputError(
                f"{self._origin}: The method must be one of {', '.join(get_args(Method))}. Got {method!r}."
            )
        self._scenario = scenario if isinstance(scenario, Scenario) else Scenario.load(scenario)
        self._spec: dict[str, Any] = {"name": name, "scenario": self._scenario.name, "method": method, "n": n}
        self._spec |= {"seed": seed, "engine": engine} | ({"cases": list(cases)} if cases is not None else {})
        check(self._spec | {"parameters": {"unit.parameter": {"values": [0.0]}}}, StudySpec, self._origin)

    def vary(
        self,
        parameter: str,
        *,
        values: Sequence[float] | None = None,
        range: tuple[float, float] | None = None,
        scale: tuple[float, float] | None = None,
        log: bool = False,
        steps: int = 5,
    ) -> Study:
        """Add a varied parameter.

        Parameters
        ----------
        parameter : str
            Name of the parameter, ``unit.parameter``.
        values : sequence of float, optional
            Values of the parameter.
        range : (float, float), optional
            Lowest and highest value.
        scale : (float, float), optional
            Smallest and largest factor by which the value in the scenario is multiplied.
        log : bool
            Whether the values are sampled on a logarithmic scale.
        steps : int
            Number of values that a grid takes from a range.

        Returns
        -------
        Study
            This study.

        Raises
        ------
        InputError
            None or several of `values`, `range` and `scale` are given, or a range is not increasing.
        """
        given = {"values": values, "range": range, "scale": scale}
        table = {key: [float(v) for v in what] for key, what in given.items() if what is not None}
        more: dict[str, Any] = {**table, "log": log, "steps": steps}
        check(more, ParameterSpec, f"{self._origin}: {parameter}")
        self._spec.setdefault("parameters", {})[parameter] = more
        return self

    def limits(self, case: str, limits: Mapping[str, float]) -> Study:
        """Set the limits of a case for this study. These limits replace the limits of the scenario.

        Parameters
        ----------
        case : str
            Name of the case.
        limits : mapping of str to float
            Largest allowed value of each metric, by name of the metric.

        Returns
        -------
        Study
            This study.
        """
        self._spec.setdefault("limits", {})[case] = {name: float(v) for name, v in limits.items()}
        return self

    def save(self, folder: str | Path) -> Path:
        """Write the scenario and the file ``NAME.study.toml``, which ``hystfmu study`` runs.

        Parameters
        ----------
        folder : str or Path
            Folder to write.

        Returns
        -------
        Path
            Path of the study file.

        Raises
        ------
        InputError
            No parameter is varied, or a file cannot be written.
        """
        check(self._spec, StudySpec, self._origin)
        self._scenario.save(Path(folder) / self._scenario.name)
        path = Path(folder) / f"{self._spec['name']}.study.toml"
        write_toml(path, self._spec)
        return path

    def run(
        self,
        folder: str | Path,
        *,
        workers: int | None = None,
        progress: Callable[[int, int, float], None] = lambda done, total, rate: None,
    ) -> Outcome:
        """Save the study, and simulate all variations. An interrupted study is continued.

        Parameters
        ----------
        folder : str or Path
            Folder into which study, scenario, table and report are written.
        workers : int, optional
            Number of local processes. The default is one process per processor core.
        progress : function, optional
            Called with the number of finished rows, the number of all rows, and rows per second.

        Returns
        -------
        Outcome

        Raises
        ------
        InputError
            The scenario does not contain a parameter or a case of the study. See also `save`.
        """
        return study(self.save(folder), folder, workers=workers, progress=progress)

    def __repr__(self) -> str:
        varied = ", ".join(self._spec.get("parameters", {})) or "nothing varies yet"
        return f"Study({self._spec['name']!r}, {self._spec['scenario']!r}, {self._spec['method']}: {varied})"
