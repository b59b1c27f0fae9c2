"""The public functions fit, study and validate."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from hystfmu.base.calls import checked
from hystfmu.base.errors import InputError
from hystfmu.data import Dataset
from hystfmu.face.model import Model, held_out

if TYPE_CHECKING:
    from collections.abc import Mapping

    from hystfmu.data.reader.arrays import Columns
    from hystfmu.fmu.check.check import Findings
    from hystfmu.graph import Graph
    from hystfmu.graph.blocks import Block
    from hystfmu.identify.estimate.free import Spec
    from hystfmu.identify.kinds import Kind
    from hystfmu.studies.run import Outcome

__all__ = ["fit", "study", "validate"]


@checked
def fit(
    data: Dataset | Columns,
    key: Kind | Path | Graph | Block = "auto",
    seed: int = 0,
    progress: Callable[[float], None] | None = None,
    purpose: Literal["model", "inverse"] = "model",
    free: Mapping[str, Spec] | None = None,
    **options: Any,
) -> Model:
    """Identify a model.

    Parameters
    ----------
    data : Dataset or data frame
        Data of the fit. The simulation of the model starts at row 0; the fit uses the residuals on `data.train`.
    key : str, Graph, block of `hystfmu.blocks` or Path
        Kind of model (``hystfmu fit --models`` lists all kinds), or a graph of blocks with free parameters. A path
        names a file with graph and free parameters, as for ``hystfmu fit --graph``. For a single block, the input is
        scaled to [-1, 1], and the output of the model is a weighted sum of the outputs of the block. ``"auto"`` tests
        the data for return-point memory and rate dependence. It discards the kinds of model that cannot represent these
        properties. It then selects the kind with the smallest error on validation blocks, which are cut between
        reversals in all parts of the training rows.
    seed : int
        Seed of the random starts. The same seed gives the same model.
    progress : function, optional
        Called with the fraction done, 0..1.
    purpose : {"model", "inverse"}
        "inverse": ``"auto"`` compares only kinds of model with a useful exact or implicit inverse, and a named kind
        must have such an inverse.
    free : dict, optional
        The free parameters of a graph. A key is ``"node.parameter"`` or ``"node.parameter[1]"``. A value is True,
        bounds ``(lower, upper)``, or a dict. The keys of this dict are ``lower``, ``upper``, ``scale`` ("log" or
        "linear"), ``rising`` (True: the elements do not decrease) and ``sum`` (the elements are positive with this
        sum); all keys are optional. The fit detects and eliminates parameters that enter the output linearly. Such
        parameters are non-negative if their lower bound is 0. For a single block, all real parameters without a given
        value are free by default.
    **options
        Options of the kind of model. A graph has the options ``starts`` and ``seconds``.

    Returns
    -------
    Model
        `fit` of the model contains errors, number of parameters and warnings. If rows follow the training rows, `fit`
        also contains the errors on these rows. ``fit["evidence"]`` contains the evidence of linear dynamics in the
        record (`hystfmu.identify.evidence`). After the fit of a graph, ``fit["free"]`` contains each free parameter
        with its standard error.

    Raises
    ------
    InputError
        The kind or an option is unknown, or a value is out of range. The data have no output or do not vary. No kind of
        ``"auto"`` can represent the data. No kind has a useful inverse. The graph does not have a free parameter, or
        the bounds exclude the value of the parameter in the graph.

    Examples
    --------
    >>> import hystfmu as hy
    >>> data = hy.synthetic.piezo(60, 1000.0).with_train("0:2000")
    >>> model = hy.fit(data, "prandtl_ishlinskii", N=20)
    >>> model.fit["held_out_rms_percent"] < 2.0
    True
    >>> alone = hy.fit(data, hy.blocks.BoucWen(), free={"beta": True, "gamma": True, "n": (1.0, 3.0)}, starts=2)
    >>> sorted(alone.fit["free"])[:3]
    ['bouc_wen.beta', 'bouc_wen.gamma', 'bouc_wen.n']
    """
    from threadpoolctl import threadpool_limits

    from hystfmu.data.reader.reading import dataset_of
    from hystfmu.face.evidence import with_evidence
    from hystfmu.identify import fit, fit_graph
    from hystfmu.inverse.worth import Inverses

    if purpose not in ("model", "inverse"):
        raise InputError(f"The purpose of a fit must be 'model' or 'inverse'. Got {purpose!r} instead.")
    data = dataset_of(data)
    if wrong := next((n for n in options if n in ("model", "kind", "method")), None):
        raise InputError(
            f"The kind of model must be the second argument, fit(data, 'preisach'). Got {wrong!r} as a name."
        )
    inverses = Inverses()
    # small matrices: several threads wait for each other, up to twenty times longer on a loaded machine
    with threadpool_limits(1):
        if isinstance(key, str):
            if free is not None:
                raise InputError(f"The free parameters must be those of a graph. Got the kind {key!r}.")
            model = fit(data, key, seed, progress, inverses, purpose == "inverse", **options)
        else:
            model = fit_graph(data, key, free, seed, progress, **options)
        if purpose == "inverse" and (fault := inverses.fault(model)):
            raise InputError(f"{data.path or data.name}: The model {model.key} must have a useful inverse. {fault}")
        return with_evidence(held_out(Model.of(model), data), data)


@checked
def study(
    path: str | Path,
    folder: str | Path | None = None,
    *,
    workers: int | None = None,
    on: str | None = None,
    retry: Literal["failed"] | None = None,
    confined: bool = True,
    progress: Callable[[int, int, float], None] = lambda done, total, rate: None,
) -> Outcome:
    """Run a scenario over many variations; an interrupted study resumes.

    Parameters
    ----------
    path : str or Path
        A file ``*.study.toml``.
    folder : str or Path, optional
        Folder for the table and the report. The default is a folder with the name of the study file, in the current
        folder.
    workers : int, optional
        Number of local processes; by default one per core.
    on : str, optional
        Scheduler of a Dask cluster, ``dask://HOST:PORT``, instead of local processes.
    retry : {"failed"}, optional
        Run failed rows again. A row that failed at a limit of time or memory always runs again if this limit is now
        higher.
    confined : bool
        Whether foreign FMUs run without network and write into a folder of their own only, where the system can.
    progress : function, optional
        Called with the number of finished rows, the number of all rows, and rows per second.

    Returns
    -------
    Outcome
        The outcome has the attributes `rows`, `table` and `report`; the last two are files.

    Raises
    ------
    InputError
        The study or the scenario is invalid, the disk is full, or the cluster is not available. Finished rows are kept.

    Examples
    --------
    >>> import hystfmu as hy
    >>> from pathlib import Path
    >>> loop = hy.Scenario("loop", step=1e-3, stop=0.01).add("source", hy.blocks.Reference(frequency=50.0))
    >>> folder = loop.metric("peak", "peak", "source.r").save("loop")
    >>> lines = ['name = "size"', 'scenario = "loop"', 'method = "grid"', "[parameters]"]
    >>> lines.append('"source.amplitude" = { values = [1.0, 2.0, 3.0] }')
    >>> characters = Path("size.study.toml").write_text("\\n".join(lines))
    >>> outcome = hy.study("size.study.toml", workers=1)
    >>> [round(row["metrics"]["peak"], 6) for row in outcome.rows]
    [1.0, 2.0, 3.0]
    """
    from hystfmu.studies import run_study

    into = Path(Path(path).name.removesuffix(".toml").removesuffix(".study")) if folder is None else folder
    return run_study(path, into, workers=workers, on=on, retry=retry, confined=confined, progress=progress)


@checked
def validate(
    path: str | Path,
    seconds: float = 60.0,
    confined: bool = True,
    progress: Callable[[float], None] = lambda fraction: None,
) -> Findings:
    """Check an FMU of any origin: archive, description, behaviour.

    Parameters
    ----------
    path : str or Path
        The FMU. Its native code is executed in a child process.
    seconds : float
        Time limit of each check (s).
    confined : bool
        Whether the FMU runs without network and writes into a folder of its own only, where the system can.
    progress : function, optional
        Called with the fraction done, 0..1.

    Returns
    -------
    Findings
        A list with one line per problem; empty if there is no problem. The attribute `checks` states which checks ran,
        and their extent.

    Raises
    ------
    InputError
        The file cannot be read, or it is not a complete zip archive.

    Examples
    --------
    >>> import hystfmu as hy
    >>> model = hy.Model("creep", hy.blocks.Creep().graph)
    >>> found = hy.validate(model.export("creep.fmu"))
    >>> found
    []
    >>> next(c.tried for c in found.checks if c.name == "making 100 steps")
    '1 instance, 100 values read, 100 values set, 100 steps'
    """
    from hystfmu.fmu.check.check import check_fmu

    return check_fmu(path, seconds, confined, progress)
