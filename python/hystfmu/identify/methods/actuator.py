"""Actuator model: hysteresis, static nonlinearity, creep, and linear dynamics with delay.

  x = scaled u,  v = w0 x + sum_i w_i p_i[x],  b = b(v),  c = b + sum_j k_j L_{T_j}[b],  y = e^(-s tau) G0(s) c + offset

This is the structure of a piezoelectric, magnetostrictive or polymer actuator. The first part is a rate-independent
hysteresis with the elements p_i (Kuhnen 2003). A smooth static nonlinearity b, which is also called bend, follows. The
creep is a sum of a few first-order lags L_T, whose time constants T are one decade apart (Krejci & Kuhnen 2001). If
such a sum leaves a clear error, weights k_j of both signs are tried: an ionic polymer relaxes back (Nemat-Nasser 2002).
Their time constants are a third of a decade apart. G0(s) is the second-order transfer function of Yu & Alici 2005 with
the natural frequency f_n and the damping ratio zeta. The delay is tau. `bent_sum` fits the weights, the nonlinearity
and the creep for given dynamics. An outer search determines f_n, zeta and tau (variable projection).

A component is kept only if its use reduces the error on validation blocks inside the training rows to less than
`BETTER` times the error without this component. Stops replace plays if the loop is clockwise. Relays with a smooth
density (Preisach) replace plays if the shape of minor loops depends on their position. A nonlinearity that is not
monotone has no inverse, so its use must reduce the error to less than `NEEDED` times the error without it.

The nonlinearity can depend on covariates such as temperature and load. A covariate changes only the offset, both offset
and gain, or all coefficients of the nonlinearity (see `bent_sum`). The errors on the validation blocks determine this
choice for each covariate. A covariate without effect is not an input of the model.
"""

from dataclasses import replace
from typing import Any

import numpy as np

from hystfmu.base import Progress, silent
from hystfmu.data import Dataset
from hystfmu.identify.catalogue import ANY, STRUCTURE, Built, Candidate, Memory, Option, Options, Row
from hystfmu.identify.estimate.dynamics import DYNAMICS_OPTIONS, told, uncertainty
from hystfmu.identify.features.bent_chain import PLAYS, RELAYS, STOPS, Fitting, Parts, Trial, chain
from hystfmu.identify.features.bent_sum import LEVELS, Following
from hystfmu.identify.features.plays import u0_option

TEXT = "plays, stops or relays, static nonlinearity, creep, G0(s) with delay; validation blocks select the parts"
FIRST = 3  # the first search of the dynamics uses every third row
DEGREES = (1, 3, 5, 8)  # degrees of the nonlinearity, tried one after the other
LAGS = 6  # maximum number of lags, if their time constants are one decade apart
PER_DECADE = 3  # number of lags of back-relaxation per decade; their weights have both signs and represent any lag
# largest response of the lags to a unit step: large weights of opposite signs imitate a derivative at the frequency of
# the record, and the model is then off by a multiple of the span for other signals
LARGEST = 5.0
FRESH = 3  # degree of the nonlinearity of a fit with back-relaxation that begins without the previous parts
# relays are tried if the error exceeds CLEAR times the noise and the share ENOUGH of the span; the ratio of the errors
# must then be below GAINED
CLEAR, ENOUGH, GAINED = 2.0, 5e-4, 0.7
POOR = 0.05  # error of plays and stops (share of the span) above which relays are tried with each nonlinearity

YES, NO, BACK = CREEP = ("yes", "no", "back-relaxation")
# in a record with few loops, lags can imitate a part of the hysteresis: the model without them is compared as well
CANDIDATES = (
    Candidate(ANY, 0.6, 0.08, structured=True),
    Candidate(ANY, 0.6, 0.08, options={"creep": NO}, structured=True),
)
OPTIONS = (
    Option("N", 40, 1, 10000, text="number of plays"),
    Option(
        "operator",
        None,
        choices=(PLAYS, STOPS, RELAYS),
        text="hysteresis operator; default: selected on validation blocks",
    ),
    Option(
        "bend",
        None,
        1,
        20,
        text="degree of the static nonlinearity, 1 for none; default: selected on validation blocks",
    ),
    Option(
        "creep",
        None,
        choices=CREEP,
        text="lags with weights >= 0, or of both signs; default: selected on validation blocks",
    ),
    Option(
        "dynamics", None, choices=("yes", "no"), text="whether there is G0(s); default: selected on validation blocks"
    ),
    Option(
        "covariates",
        None,
        choices=LEVELS[1:],
        text="part that covariates change; default: selected on validation blocks",
    ),
    Option("w0_min", 1e-3, 0.0, 1.0, text="least weight of the linear term, relative to the sum of all weights"),
    u0_option("every play rests"),
    *DYNAMICS_OPTIONS,
)


def build(data: Dataset, options: Options, seed: int, progress: Progress) -> Built:
    """Fit the model with the components that the data support; return graph, number of parameters, further results.

    The further results contain the names of the components, the options that fix them, f_n (Hz), zeta and the delay
    (s). They also contain a warning for each of these three values that the data do not determine.
    """
    f = Fitting(data, options)
    best = _following(f, _operated(f, Parts(levels=(options["covariates"] or "gain",) * len(data.covariates.names))))
    progress(0.2)
    best = _exchanged(f, _with_dynamics(f, best, lambda done: progress(0.2 + 0.4 * done)))
    if options["creep"] in (None, BACK):
        best = _relaxing(f, best)
    best = _following(f, _bent(f, best))
    progress(0.8)
    parts = best.parts
    for _ in range(2 if parts.g else 0):
        parts = replace(parts, g=f.dynamics(replace(best, parts=parts), f.all, silent))
        best = replace(best, parts=parts, fit=f.fit(parts, f.all, best.fit))
    fitted = f.fit(parts, f.all, best.fit)
    warned = [
        f"the covariate {name!r} does not reduce the error on validation blocks: it is not an input of the model"
        for name, level in zip(data.covariates.names, parts.levels, strict=True)
        if level == "none"
    ]
    found: dict[str, Any] = {"parts": _named(parts, data), "validation_percent": 100 * best.error / data.span}
    if parts.g:
        spread = uncertainty(f.behind(replace(best, fit=fitted), f.all), parts.g, data, options)
        found |= told(parts.g, spread, data, options)
    found[STRUCTURE] = _structure(parts)
    found["warnings"] = [*warned, *found.get("warnings", ())]
    count = len(fitted.w) + parts.degree + 1 + len(parts.T) + (parts.g.parameters if parts.g else 0)
    count += Following(f.theta, parts.levels).parameters(parts.degree + 1)
    return chain(f, parts, fitted), count, found


def _following(f: Fitting, trial: Trial) -> Trial:
    """Choose how the nonlinearity depends on each covariate.

    `bent_sum` explains the levels. Each covariate begins with the level ``gain``. The level ``bend`` is chosen if its
    validation error is clearly smaller. A simpler level is chosen if the more complex level has no clearly smaller
    validation error.
    """
    if f.options["covariates"] is not None:
        return trial
    best = trial

    def at(j: int, level: str) -> Trial:
        levels = list(best.parts.levels)
        levels[j] = level
        return f.tried(replace(best.parts, levels=tuple(levels)), best.fit)

    for j in range(len(trial.parts.levels)):
        if best.parts.degree > 1 and best.parts.levels[j] != LEVELS[-1]:
            best = best.or_better(at(j, LEVELS[-1]))
        while (place := LEVELS.index(best.parts.levels[j])) > 0:
            simpler = at(j, LEVELS[place - 1])
            if simpler.or_better(best) is best:
                break
            best = simpler
    return best


def _operated(f: Fitting, parts: Parts) -> Trial:
    """Choose plays or stops, or relays if the error is large, by the validation errors of fits with a nonlinearity.

    Plays are preferred, because they have an exact inverse.
    """
    asked = f.options["operator"]
    if asked is not None:
        return _with_other_start(f, _bent(f, f.tried(replace(parts, operator=asked))))
    best = _bent(f, f.tried(parts))
    if not f.settled(best):
        best = best.or_better(_bent(f, f.tried(replace(parts, operator=STOPS))))
    if best.error <= POOR * f.data.span:
        return best
    # relays without a bend do not show that they fit a butterfly loop
    relays = replace(parts, operator=RELAYS)
    bent = _with_other_start(f, f.tried(replace(relays, degree=best.parts.degree))), _bent(f, f.tried(relays))
    found = min(bent, key=lambda trial: trial.error)
    return best.or_better(_bent(f, found)) if found.error < GAINED * best.error else best


def _with_dynamics(f: Fitting, trial: Trial, progress: Progress) -> Trial:
    """Add dynamics and creep that are requested or reduce the validation error, with a nonlinearity that fits them."""
    best = trial
    if f.options["dynamics"] != "no":
        # creep can be identified only with the nonlinearity, and the nonlinearity only with the dynamics
        best = _bent(f, _moving(f, best, progress))
    return _creeping(f, best) if f.options["creep"] in (None, YES) else best


def _exchanged(f: Fitting, best: Trial) -> Trial:
    """Replace plays or stops by relays, or relays by plays, if the validation errors justify this.

    Relays have no exact inverse. Therefore they are used only if their error is less than `GAINED` times the error of
    plays or stops. They are tried with dynamics and creep, without which the best operator is not visible. If they are
    better, the other components are fitted again, because those of the plays represent a part of the hysteresis.
    """
    if f.options["operator"] is not None or not _clear(f, best):
        return best
    other = PLAYS if best.parts.operator == RELAYS else RELAYS
    trial = _with_other_start(f, f.tried(replace(best.parts, operator=other)))
    if other == PLAYS:
        return trial if GAINED * trial.error < best.error else best
    if not trial.error < GAINED * best.error:
        return best
    again = _bent(f, _with_other_start(f, f.tried(replace(trial.parts, T=(), g=None))))
    return trial.or_better(_with_dynamics(f, again, silent))


def _with_other_start(f: Fitting, trial: Trial) -> Trial:
    """Repeat the fit of relays with a nonlinearity, starting from equal weights, and return the better result.

    For butterfly loops, weights from a fit without nonlinearity can be a poor start.
    """
    if trial.parts.degree == 1 or trial.parts.operator != RELAYS:
        return trial
    return trial.or_better(f.tried(trial.parts, replace(trial.fit, w=np.ones_like(trial.fit.w)), trial.fit.rms))


def _bent(f: Fitting, trial: Trial) -> Trial:
    """Increase the degree of the nonlinearity while the validation error decreases, or set the requested degree.

    The weights of a fit with a straight line are a poor start if the output is even in v (butterfly loops). Therefore
    another fit begins with equal weights.
    """
    if f.options["bend"] is not None:
        parts = replace(trial.parts, degree=int(f.options["bend"]))
        if trial.parts.degree == parts.degree:
            return trial
        found = f.tried(parts, trial.fit)
        return found.or_better(f.tried(parts, replace(trial.fit, w=np.ones_like(trial.fit.w)), trial.fit.rms))
    best = trial
    for degree in DEGREES[DEGREES.index(trial.parts.degree) + 1 :]:
        if f.settled(best):
            break
        parts = replace(trial.parts, degree=degree)
        best = best.or_better(f.tried(parts, best.fit))
        if best.parts.degree != degree:
            best = best.or_better(f.tried(parts, replace(best.fit, w=np.ones_like(best.fit.w)), best.fit.rms))
        if best.parts.degree != degree:
            break
    return best


def _moving(f: Fitting, trial: Trial, progress: Progress) -> Trial:
    """Add linear dynamics if they are requested or reduce the validation error."""
    if f.settled(trial) and f.options["dynamics"] != "yes":
        return trial
    g = f.dynamics(trial, f.kept[::FIRST], progress)
    moved = f.tried(replace(trial.parts, g=g), trial.fit)
    return moved if f.options["dynamics"] == "yes" else trial.or_better(moved)


def _creeping(f: Fitting, trial: Trial) -> Trial:
    """Add creep if it is requested or reduces the validation error.

    The time constants are one decade apart, from at least ten samples to a third of the record.
    """
    if f.settled(trial) and f.options["creep"] != YES:
        return trial
    crept = _moved_again(f, f.tried(replace(trial.parts, T=_lags(f, 1)), trial.fit))
    return crept if f.options["creep"] == YES else trial.or_better(crept)


def _relaxing(f: Fitting, best: Trial) -> Trial:
    """Let the output relax back if a clear error remains and this reduces it.

    The weights of the lags are then free, and their time constants are closer. If back-relaxation is requested, it is
    not compared with the fit without it.
    """
    asked = f.options["creep"] == BACK
    if not _clear(f, best) and not asked:
        return best
    back = _moved_again(f, f.tried(replace(best.parts, T=_lags(f, PER_DECADE), signed=True), best.fit))
    if _clear(f, back) and (asked or best.parts.g or back.error < GAINED * best.error):
        # operator and dynamics that were fitted without back-relaxation represent a part of it
        degree, operator = int(f.options["bend"] or FRESH), f.options["operator"] or PLAYS
        fresh = f.tried(replace(back.parts, operator=operator, degree=degree, g=None))
        back = back.or_better(_moving(f, fresh, silent) if f.options["dynamics"] != "no" else fresh)
    return back if asked or (back.error < GAINED * best.error and _relaxes(back)) else best


def _relaxes(trial: Trial) -> bool:
    """Return whether the step response 1 + sum_j k_j (1 - exp(-t / T_j)) stays between -LARGEST and LARGEST."""
    T = np.array(trial.parts.T)
    t = np.geomspace(T.min() / 10, T.max() * 10, 200)
    return bool(np.abs(1 - np.expm1(-t[:, None] / T) @ trial.fit.k).max() <= LARGEST)


def _clear(f: Fitting, trial: Trial) -> bool:
    """Return whether the validation error exceeds the noise and a small share of the span."""
    return trial.error > max(CLEAR * f.noise, ENOUGH * f.data.span)


def _lags(f: Fitting, per_decade: int) -> tuple[float, ...]:
    """Return time constants (s) from at least ten samples to a third of the record."""
    h, n = f.data.h, f.data.train.stop
    longest = np.log10(max(n * h / 3, 20 * h))
    T = 10 ** np.arange(longest, np.log10(10 * h) - 1e-9, -1 / per_decade)[: LAGS * per_decade]
    return tuple(float(t) for t in T[::-1])


def _moved_again(f: Fitting, crept: Trial) -> Trial:
    """Fit the dynamics again: dynamics that were fitted without creep represent a part of it."""
    if not crept.parts.g:
        return crept
    return f.tried(replace(crept.parts, g=f.dynamics(crept, f.kept[::FIRST], silent)), crept.fit)


def _structure(parts: Parts) -> dict[str, Any]:
    """Return the options of a fit with the same components; covariates are left to its validation blocks."""
    creep = (BACK if parts.signed else YES) if parts.T else NO
    dynamics = YES if parts.g else NO
    return {"operator": parts.operator, "bend": parts.degree, "creep": creep, "dynamics": dynamics}


def _named(parts: Parts, data: Dataset) -> str:
    words = [parts.operator]
    words += [f"static nonlinearity of degree {parts.degree}"] if parts.degree > 1 else []
    for name, level in zip(data.covariates.names, parts.levels, strict=True):
        varied = "static nonlinearity" if level == "bend" else level
        words += [] if level == "none" else [f"{varied} that follows {name}"]
    words += [f"{'back-relaxation' if parts.signed else 'creep'} with {len(parts.T)} lags"] if parts.T else []
    modes = f" of {1 + len(parts.g.beside)} modes" if parts.g and parts.g.beside else ""
    return ", ".join([*words, *([f"G0(s){modes} with delay"] if parts.g else [])])


KINDS = {"actuator": Row(TEXT, build, OPTIONS, CANDIDATES, Memory(3500.0, "N"), covariates=True)}
