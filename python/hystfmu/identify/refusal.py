"""Refusal of a fit: one sentence that names every candidate with its error or its reason."""

from __future__ import annotations

from collections.abc import Mapping

from hystfmu.base.errors import InputError
from hystfmu.identify.excitation.minor_loops import Excitation
from hystfmu.identify.race import Race


def refusal(where: str, rule: str, race: Race, seen: Excitation, faults: Mapping[str, str] | None = None) -> InputError:
    """Return the refusal of a choice.

    Parameters
    ----------
    where : str
        File or name of the record.
    rule : str
        Requirement of a kind, without a full stop.
    race : Race
        Candidates that were fitted, and the reasons of the others.
    seen : Excitation
        Deficiency of the record.
    faults : dict, optional
        Reasons in addition to errors of candidates.
    """
    faults = faults or {}
    ranked = sorted(race.trials.values(), key=race.excess)
    errors = [f"{t.name} {race.excess(t):.3g} %" + _behind(faults.get(t.name)) for t in ranked]
    got = f"errors on validation blocks of {', '.join(errors)}" if errors else "no fit"
    by_reason: dict[str, list[str]] = {}
    for name, reason in race.reasons.items():
        by_reason.setdefault(reason.rstrip("."), []).append(name)
    others = "; ".join(f"{', '.join(names)}: {reason}" for reason, names in by_reason.items())
    poor = f" The record is poor: {'; '.join(seen.warnings)}." if seen.warnings else ""
    return InputError(
        f"{where}: {rule}. Got {got}{f'; {others}' if others else ''}.{poor} The output depends on more than the past "
        "of this input, or no kind describes it: measure what else acts on it, or name a kind to fit it all the same."
    )


def _behind(fault: str | None) -> str:
    return f" ({fault.rstrip('.')})" if fault else ""
