"""Tasks, samplers and the steps of a study without worker processes: ids, batches, counts, what is left out."""

from __future__ import annotations

import hashlib
import json
import math
from dataclasses import replace
from types import SimpleNamespace
from typing import Any, ClassVar

import numpy as np
import pytest
from scipy.stats import qmc

from hystfmu import InputError
from hystfmu.scenario import build
from hystfmu.scenario.outcome.trace import Stopped
from hystfmu.studies import run, sampling, task
from hystfmu.studies.failed import is_final, with_limits
from hystfmu.studies.run import Outcome, _Missing, _tasks
from hystfmu.studies.spec import ObjectiveSpec, ParameterSpec, Study
from hystfmu.studies.task import Runner, Task, identity, row_of


# ---- tasks ----------------------------------------------------------------------------------------------------------
def test_the_id_of_a_run_is_a_hash_of_its_content() -> None:
    content = json.dumps(["mark", {"a": 1.0, "b": 2.0}], sort_keys=True).encode()
    want = hashlib.sha256(content).hexdigest()[:24]
    assert identity("mark", {"b": 2.0, "a": 1.0}) == want  # in any order
    assert len({want, identity("other", {"a": 1.0}), identity("mark", {"b": 2.0, "a": 1.0}, True)}) == 3
    assert Task(0, 0, 0, "", {}, {}).margins is False


def test_the_fingerprint_of_a_case_changes_with_what_its_results_depend_on(write: Any) -> None:
    study = Study(write())
    one, half = (build(c) for c in study.cases)
    assert task.fingerprint(one) == task.fingerprint(build(study.cases[0])) != task.fingerprint(half)
    assert len(task.fingerprint(one)) == 64
    case = one.case
    m = dict(case.metrics)
    m["last"] = m["last"].model_copy(update={"limit": 3.0, "text": "other"})
    assert task.fingerprint(replace(one, case=replace(case, metrics=m))) == task.fingerprint(one)  # only a judgement
    turned = dict(reversed(case.metrics.items()))
    assert task.fingerprint(replace(one, case=replace(case, metrics=turned))) == task.fingerprint(one)
    m["last"] = m["last"].model_copy(update={"signal": "command.d"})
    assert task.fingerprint(replace(one, case=replace(case, metrics=m))) != task.fingerprint(one)


def test_tasks_of_a_batch_are_numbered_by_variation_and_case() -> None:
    cases = [SimpleNamespace(name="a"), SimpleNamespace(name="b")]
    study: Any = SimpleNamespace(settings=lambda v: {"s": v["x"] * 2}, cases=cases, spec=SimpleNamespace(margins="b"))
    found = list(_tasks(study, [{"x": 1.0}, {"x": 5.0}], ["A", "B"], 7))
    assert [(t.index, t.variation, t.case, t.margins) for t in found] == [
        (14, 7, 0, False), (15, 7, 1, True), (16, 8, 0, False), (17, 8, 1, True),
    ]  # fmt: skip
    assert [t.values["x"] for t in found] == [1.0, 1.0, 5.0, 5.0]
    assert [t.id for t in found] == [identity(m, {"s": 2 * x}, m == "B") for x in (1.0, 5.0) for m in "AB"]


def test_a_known_or_repeated_run_is_not_made_again() -> None:
    def made(k: int, name: str) -> Task:
        return Task(k, k, 0, name, {}, {})

    missing = _Missing(iter([made(0, "a"), made(1, "b"), made(2, "a"), made(3, "c"), made(4, "d")]), {"b": 1})
    missing.leave_out = {3: "outside"}
    assert [t.index for t in missing] == [0, 4]
    assert missing.there == 3
    assert [t.index for t in missing.left_out] == [3]
    assert [t.index for t in missing.all] == [0, 1, 2, 3, 4]


@pytest.mark.parametrize(
    ("fault", "status", "reason"),
    [
        (Stopped("left its bounds"), "stopped", "left its bounds"),
        (InputError("no such unit"), "refused", "no such unit"),
        (MemoryError(), "memory", "the run exceeds the memory limit of a worker"),
        (None, "ok", ""),
    ],
)
def test_a_failed_run_is_a_row_with_its_reason(
    monkeypatch: Any, fault: Exception | None, status: str, reason: str
) -> None:
    def metrics(self: Any, task: Task) -> dict[str, float]:
        if fault is not None:
            raise fault
        return {"m": 1.0}

    monkeypatch.setattr(Runner, "_metrics", metrics)
    systems: Any = [SimpleNamespace(case=SimpleNamespace(name="one"))]
    t = Task(3, 1, 0, "id", {"v": 2.0}, {})
    assert Runner(systems, "native")(t) == {
        "index": 3, "variation": 1, "id": "id", "case": "one", "values": {"v": 2.0},
        "metrics": {} if fault else {"m": 1.0}, "status": status, "reason": reason,
    }  # fmt: skip


@pytest.mark.parametrize(
    ("status", "limits", "retry", "final"),
    [
        ("ok", None, True, True), ("timeout", (1.0, 9.0), False, False), ("timeout", (2.0, 1.0), False, True),
        ("timeout", (3.0, 1.0), False, True), ("memory", (9.0, 1.0), False, False), ("memory", (1.0, 4.0), False, True),
        ("killed", (9.0, 1.0), False, False), ("refused", (0.1, 0.1), False, True),
        ("refused", (9.0, 9.0), True, False), ("timeout", None, False, True),
    ],
)  # fmt: skip
def test_what_failed_at_a_limit_runs_again_under_a_higher_one(
    status: str, limits: Any, retry: bool, final: bool
) -> None:
    spec: Any = SimpleNamespace(timeout=2.0, memory=4.0)
    row = {"status": status} | (
        {} if limits is None else {"limits": dict(zip(("timeout", "memory"), limits, strict=True))}
    )
    assert is_final(row, spec, retry) is final
    kept = with_limits({"status": status}, spec)
    assert kept == {"status": status} | ({} if status == "ok" else {"limits": {"timeout": 2.0, "memory": 4.0}})


# ---- samplers -------------------------------------------------------------------------------------------------------
P = {
    "a": ParameterSpec.model_validate({"range": [1.0, 3.0], "steps": 3}),
    "b": ParameterSpec.model_validate({"scale": [0.5, 2.0], "log": True, "steps": 1}),
    "c": ParameterSpec.model_validate({"values": [7.0, 5.0]}),
}


def study(method: str, n: int = 6, **more: Any) -> Any:
    spec = SimpleNamespace(method=method, n=n, objective=None, start={}, **more)
    return SimpleNamespace(spec=spec, parameters=P, seed=11, file="s.toml", settings=lambda v: v)


def drawn(method: str, n: int = 6) -> list[dict[str, float]]:
    found = sampling.sampler(study(method, n))
    (batch,) = found.batches()
    assert found.n == len(batch)
    assert found.outside(0) == ""
    found.tell([])
    return batch


def test_a_grid_has_every_combination() -> None:
    batch = drawn("grid")
    assert [tuple(v.values()) for v in batch] == [(a, 0.5, c) for a in (1.0, 2.0, 3.0) for c in (7.0, 5.0)]


def test_a_grid_may_have_ten_million_points() -> None:
    one = {k: ParameterSpec.model_validate({"range": [0.0, 1.0], "steps": n}) for k, n in (("a", 10**5), ("b", 101))}
    given = study("grid")
    given.parameters = one
    with pytest.raises(InputError, match=r"s.toml: the grid must have at most 10000000 points"):
        sampling.sampler(given)


@pytest.mark.parametrize("method", ["random", "sobol", "latin_hypercube"])
def test_draws_are_those_of_their_generator(method: str) -> None:
    if method == "random":
        points = np.random.default_rng(11).random((6, 3))
    elif method == "sobol":
        points = qmc.Sobol(3, seed=11).random_base2(3)[:6]
    else:
        points = qmc.LatinHypercube(3, seed=11).random(6)
    batch = drawn(method)
    assert [v["a"] for v in batch] == pytest.approx(1 + 2 * points[:, 0])
    assert [v["b"] for v in batch] == pytest.approx(0.5 * 4 ** points[:, 1])
    assert [v["c"] for v in batch] == [7.0 if f < 0.5 else 5.0 for f in points[:, 2]]


class Loop:
    def __init__(self, study: Any, spec: Any) -> None:
        pass

    def excess(self, settings: Any) -> dict[str, float]:
        return {"Ms_db": settings["a"] - 2.0, "radius": -1.0}


def asked(monkeypatch: Any, n: int = 19, loop: bool = True, limits: Any = None, start: Any = None) -> Any:
    monkeypatch.setattr(sampling, "LoopLimits", Loop)
    objective = ObjectiveSpec.model_validate({"metric": "m", "limits": limits or {}})
    objective = objective.model_copy(update={"loop": object() if loop else None})
    given = study("optuna", n)
    given.spec.objective, given.spec.start = objective, start or {}
    given.parameters = {"a": P["a"], "c": P["c"]}
    return sampling.sampler(given)


def rows(value: float, status: str = "ok") -> list[dict[str, Any]]:
    return [{"case": c, "status": status, "metrics": {"m": v}} for c, v in (("x", value), ("y", value / 2))]


def test_optuna_is_asked_in_batches_of_eight_and_told(monkeypatch: Any) -> None:
    import optuna

    optuna.logging.set_verbosity(optuna.logging.INFO)
    sampler = asked(monkeypatch, start={"a": 1.5, "c": 5.0})
    assert optuna.logging.get_verbosity() == optuna.logging.WARNING
    sizes, states = [], []
    for batch in sampler.batches():
        sizes.append(len(batch))
        for k, v in enumerate(batch):
            assert 1.0 <= v["a"] <= 3.0
            assert v["c"] in (5.0, 7.0)
            assert sampler.outside(k) == ("Ms_db" if v["a"] > 2.0 else "")
        if len(sizes) == 1:
            assert batch[0] == {"a": 1.5, "c": 5.0}
        sampler.tell([rows(v["a"]) for v in batch])
        states += [(v["a"], t.state, t.value) for v, t in zip(batch, sampler._asker.trials[-len(batch) :], strict=True)]
    assert sizes == [8, 8, 3]
    assert sampler.n == 19
    for a, state, value in states:
        pruned = a > 2.0
        assert state == (optuna.trial.TrialState.PRUNED if pruned else optuna.trial.TrialState.COMPLETE)
        assert pruned or value == a  # the largest of both cases


def test_a_failed_case_fails_its_trial_and_a_limit_makes_it_infeasible(monkeypatch: Any) -> None:
    import optuna

    sampler = asked(monkeypatch, 2, loop=False, limits={"m": 1.0})
    (batch,) = sampler.batches()
    assert sampler.outside(0) == ""
    sampler.tell([rows(math.inf), rows(3.0)])
    first, second = sampler._asker.trials
    assert first.state == optuna.trial.TrialState.FAIL
    assert second.value == 3.0
    assert second.constraints == {"m": 2.0}
    assert len(batch) == 2


def test_a_limit_that_is_just_met_breaks_nothing(monkeypatch: Any) -> None:
    import optuna

    monkeypatch.setattr(Loop, "excess", lambda self, settings: {"Ms_db": 0.0})
    sampler = asked(monkeypatch, 1)
    next(iter(sampler.batches()))
    assert sampler.outside(0) == ""
    sampler.tell([rows(3.0)])
    assert sampler._asker.trials[0].state == optuna.trial.TrialState.COMPLETE


def test_a_design_adds_its_settings_and_is_made_once(write: Any) -> None:
    made = Study(write())
    asked: list[Any] = []

    def design(cases: Any, values: Any) -> dict[str, Any]:
        asked.append((cases, dict(values)))
        return {"rep.q": [1.0]}

    made.spec = made.spec.model_copy(update={"design": SimpleNamespace(settings=design)})
    values = {"command.step": 2.0, "lag.b": 0.5}
    for _ in range(2):
        assert made.settings(values) == {"command.step": 2.0, "lag.b": "*0.5", "rep.q": [1.0]}
    assert asked == [(made.scenario_cases, values)]


# ---- the steps of a study -------------------------------------------------------------------------------------------
class Here:
    """Runs tasks in this process; notes how it was made."""

    made: tuple[Any, ...] = ()

    def __init__(self, systems: Any, *given: Any) -> None:
        type(self).made = given
        self.runner = Runner(systems, "native")

    def __enter__(self) -> Here:
        return self

    def __exit__(self, *exception: object) -> None:
        self.runner.close()

    def stop(self) -> None:
        pass

    def run(self, tasks: Any, n: int) -> Any:
        type(self).announced = n  # type: ignore[attr-defined]
        yield from map(self.runner, tasks)


def test_a_study_counts_what_it_runs_and_what_was_there(write: Any, tmp_path: Any, monkeypatch: Any) -> None:
    monkeypatch.setattr(run, "Pool", Here)
    told: list[tuple[int, int, float]] = []
    path = write(timeout=7.0, memory=3.0)
    found = run.run_study(path, tmp_path / "out", workers=2, confined=False, progress=lambda *p: told.append(p))
    assert Here.made == ("native", 2, 7.0, 3.0, False)
    assert Here.announced == 24  # type: ignore[attr-defined]
    assert (found.ran, len(found.rows), found.failed, found.seed) == (24, 24, [], 0)
    assert [p[:2] for p in told] == [(k, 24) for k in range(1, 25)]
    assert all(p[2] > 0 for p in told)
    assert [r["index"] for r in found.rows] == list(range(24))
    assert found.seconds > 0
    assert repr(found) == f"Outcome(24 rows, 0 failed, {str(found.table)!r})"
    larger = write(
        parameters={
            "command.step": {"range": [1.0, 4.0], "steps": 4},
            "lag.b": {"scale": [0.5, 2.0], "steps": 5, "log": True},
        }
    )
    told.clear()
    found = run.run_study(larger, tmp_path / "out", progress=lambda *p: told.append(p))
    assert (found.ran, len(found.rows)) == (16, 40)
    done = [d for d, total, _ in told if total == 40]
    assert done == sorted(done)
    assert len(done) == 16
    assert (done[0], done[-1]) == (3, 38)  # those that were there count as they come up
    assert Here.made[1] is None
    none = Outcome([{"status": s} for s in ("ok", "outside", "timeout")], found.table, found.report, 0, 0.0)
    assert [r["status"] for r in none.failed] == ["timeout"]
    assert (none.summary, none.seed) == (None, 0)


def test_variations_outside_a_limit_of_the_loop_are_rows_without_a_run(
    write: Any, tmp_path: Any, monkeypatch: Any
) -> None:
    class Twice(sampling.Fixed):
        """Two batches; the second variation of each is outside."""

        told: ClassVar[list[Any]] = []

        def batches(self) -> Any:
            for k in (0, 4):
                yield self._variations[k : k + 4]

        def outside(self, k: int) -> str:
            return "radius" if k == 1 else ""

        def tell(self, rows: Any) -> None:
            self.told.append([[r["status"] for r in cases] for cases in rows])

    made = [{"command.step": float(k), "lag.b": 1.0} for k in range(1, 9)]
    monkeypatch.setattr(run, "Pool", Here)
    monkeypatch.setattr(run, "sampler", lambda study: Twice(made))
    progress: list[tuple[int, int]] = []
    found = run.run_study(write(), tmp_path / "out", progress=lambda done, total, rate: progress.append((done, total)))
    outside = [r for r in found.rows if r["status"] == "outside"]
    assert [r["variation"] for r in outside] == [1, 1, 5, 5]
    assert {r["reason"] for r in outside} == {"breaks a limit of the loop: radius"}
    assert [r["index"] for r in found.rows] == list(range(16))
    assert (found.ran, found.failed) == (12, [])
    assert Twice.told == [[["ok"] * 2, ["outside"] * 2, ["ok"] * 2, ["ok"] * 2]] * 2
    assert progress[-1] == (16, 16)
    assert len((tmp_path / "out" / "journal.jsonl").read_bytes().splitlines()) == 16  # those outside are kept too
    assert [d for d, _ in progress] == sorted(d for d, _ in progress)
    assert row_of(Task(0, 0, 0, "", {}, {}), "c", "ok", "")["metrics"] == {}
