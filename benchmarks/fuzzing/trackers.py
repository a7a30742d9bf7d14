"""Calls of trackers with malformed measurements, steps, controls, parameters and assignments."""

from __future__ import annotations

import copy
from collections.abc import Iterator
from typing import Any

import numpy as np

from arrivals.trackers import PositionEstimate, StateEstimate, Tracker
from fuzzing.judging import Call
from fuzzing.tracker_cases import CASES, is_symmetric_and_positive
from fuzzing.values import malformed, same, scalar, value_of, whatever

ASSIGNED = (
    "x",
    "P",
    "F",
    "Q",
    "H",
    "R",
    "B",
    "alpha",
    "inv",
    "M",
    "mu",
    "filters",
    "estimate",
    "xx",
)
WEIGHTS = {
    "update": 6,
    "same": 2,
    "predict": 3,
    "control": 2,
    "run": 2,
    "run_batch": 2,
    "batch_filter": 1,
    "options": 1,
    "set": 2,
    "construct": 2,
    "assign": 2,
    "config": 1,
}


def kinds() -> list[str]:
    """Return the names of the trackers."""
    return sorted(CASES)


def calls(kind: str, rng: np.random.Generator) -> Iterator[Call]:
    """Yield malformed calls of one tracker after a few usual steps, and usual steps between."""
    cases = CASES[kind]
    make, measurements = cases[int(rng.integers(len(cases)))]
    tracker = make()
    for z in measurements[: int(rng.integers(3))]:
        yield usual_step(kind, tracker, z)
    for _ in range(int(rng.integers(1, 4))):
        name = str(
            rng.choice(list(WEIGHTS), p=np.array([*WEIGHTS.values()]) / sum(WEIGHTS.values()))
        )
        if name == "batch_filter" and not hasattr(tracker, "batch_filter"):
            continue
        z = measurements[int(rng.integers(len(measurements)))]
        call = OPERATIONS[name](tracker, z, measurements, rng)
        yield call
        step = usual_step(kind, tracker, z)
        yield step
        if step.failed:
            return


def usual_step(kind: str, tracker: Tracker, z: Any) -> Call:
    """Return a usual predict and update: an error only where an assignment was wrong."""

    def run() -> None:
        tracker.predict()
        tracker.update(z)

    return Call("step", run, check=lambda _: wrong(tracker), counts=False)


def wrong(tracker: Tracker) -> str | None:
    """Return what is wrong with the belief and the estimate of a tracker, or None."""
    estimate = tracker.estimate
    x, P = np.asarray(tracker.x), np.asarray(tracker.P)
    if isinstance(estimate, StateEstimate):
        for name, value in (("x", x), ("P", P), ("estimate.x", estimate.x)):
            if not np.isfinite(value).all():
                return f"silent NaN or inf in {name}: {value.ravel()[:6]}"
        return None if is_symmetric_and_positive(P) else f"P not a covariance: {P.ravel()[:6]}"
    if np.isinf(x).any() or np.isnan(P).any():
        return f"silent NaN or inf in x or P: {x.ravel()[:6]}, {P.ravel()[:6]}"
    finite = np.where(np.isfinite(P), P, 0.0)
    if P.ndim == 2 and not is_symmetric_and_positive(finite):
        return f"P not a covariance: {P.ravel()[:6]}"
    has_levels = getattr(tracker, "rss", True) is not None  # `fused` may have none
    for name in ("doa", "position", *["log_amplitude"] * has_levels):
        value = getattr(estimate, name, np.zeros(0))
        if not np.isfinite(value).all():
            return f"silent NaN or inf in estimate.{name}: {value.ravel()[:6]}"
    existence = getattr(estimate, "existence", np.zeros(0))
    if ((existence < -1e-9) | (existence > 1 + 1e-9)).any():
        return f"existence outside [0, 1]: {existence}"
    return None


def _update(tracker: Tracker, z: Any, _: list[Any], rng: np.random.Generator) -> Call:
    text = malformed(rng, z)
    value = value_of(text, z)
    return Call(f"update({text})", lambda: tracker.update(value), tracker, (value,),
                lambda _: wrong(tracker))  # fmt: skip


def _same(tracker: Tracker, z: Any, _: list[Any], rng: np.random.Generator) -> Call:
    """Return an update by another form of a measurement, which has to give the same."""
    text = same(rng)
    value, plain = value_of(text, z), copy.deepcopy(tracker)

    def check(_: Any) -> str | None:
        plain.update(np.asarray(z))
        pairs = (plain.x, tracker.x), (plain.P, tracker.P)
        same = [np.allclose(a, b, 1e-9, 1e-9, equal_nan=True) for a, b in pairs]
        return None if all(same) else f"another result from another form: {tracker.x.ravel()[:6]}"

    return Call(f"update({text})", lambda: tracker.update(value), tracker, (value,), check, ())


def _predict(tracker: Tracker, z: Any, _: list[Any], rng: np.random.Generator) -> Call:
    text = scalar(rng)
    dt = value_of(text)
    return Call(f"predict(dt={text})", lambda: tracker.predict(dt=dt), tracker,
                check=lambda _: wrong(tracker))  # fmt: skip


def _control(tracker: Tracker, z: Any, _: list[Any], rng: np.random.Generator) -> Call:
    text = whatever(rng)
    u = value_of(text)
    return Call(f"predict({text})", lambda: tracker.predict(u), tracker,
                check=lambda _: wrong(tracker))  # fmt: skip


def _run(tracker: Tracker, z: Any, measurements: list[Any], rng: np.random.Generator) -> Call:
    """Return a run with a malformed measurement, step or sequence; earlier steps may stay."""
    how, text = int(rng.integers(3)), malformed(rng, z)
    if how == 0:
        bad = [*measurements[:2], value_of(text, z)]
        return Call(f"run([.., {text}])", lambda: tracker.run(bad), check=lambda _: wrong(tracker))
    if how == 1:
        text = scalar(rng)
        dt = value_of(text)
        return Call(f"run([..], dt={text})", lambda: tracker.run(measurements[:2], dt), tracker,
                    check=lambda _: wrong(tracker))  # fmt: skip
    text = whatever(rng)
    sequence = value_of(text)
    return Call(f"run({text})", lambda: tracker.run(sequence), check=lambda _: wrong(tracker))


def _run_batch(tracker: Tracker, z: Any, measurements: list[Any], rng: np.random.Generator) -> Call:
    how, text = int(rng.integers(4)), malformed(rng, z)
    batch: Any = [measurements[:2], [value_of(text, z), measurements[0]]]
    dt: Any = 1.0
    shown = f"run_batch([[..], [{text}, ..]])"
    if how == 1:
        text = scalar(rng)
        batch, dt, shown = [measurements[:2]] * 2, value_of(text), f"run_batch([..], dt={text})"
    elif how == 2:
        text = whatever(rng)
        batch, shown = value_of(text), f"run_batch({text})"
    elif how == 3:
        text = whatever(rng)
        batch, shown = [measurements[:2], value_of(text)], f"run_batch([[..], {text}])"

    def check(runs: Any) -> str | None:
        bad = [run for run in runs if np.isinf(run.x).any()]
        return "silent inf in a run of the batch" if bad else wrong(tracker)

    return Call(shown, lambda: tracker.run_batch(batch, dt), tracker, check=check)


def _batch_filter(tracker: Any, z: Any, measurements: list[Any], rng: np.random.Generator) -> Call:
    name = str(rng.choice(["zs", "Fs", "Qs", "Hs", "Rs", "Bs", "us"]))
    text = malformed(rng, z) if name == "zs" and rng.random() < 0.5 else whatever(rng)
    bad = value_of(text, z)
    filled = name == "zs" or rng.random() < 0.5
    arguments = {"zs": measurements[:2]} | {name: [bad, measurements[0]] if filled else bad}
    shown = f"batch_filter({name}={f'[{text}, ..]' if filled else text})"

    def check(results: Any) -> str | None:
        finite = all(
            np.isfinite(np.asarray(result, dtype=np.float64)).all() for result in results[:2]
        )
        return None if finite else "silent NaN or inf from batch_filter"

    return Call(shown, lambda: tracker.batch_filter(**arguments), check=check)


def _options(tracker: Any, z: Any, _: list[Any], rng: np.random.Generator) -> Call:
    """Return a step with malformed matrices of that step."""
    if not hasattr(tracker, "batch_filter"):
        return _update(tracker, z, _, rng)
    name = str(rng.choice(["F", "Q", "B", "R", "H"]))
    text = whatever(rng)
    bad = {name: value_of(text)}
    if name in "FQB":
        u = 1.0 if name == "B" else None
        return Call(f"predict({name}={text})", lambda: tracker.predict(u, **bad), tracker,
                    check=lambda _: wrong(tracker), allowed=(ValueError, TypeError))  # fmt: skip
    return Call(f"update(z, {name}={text})", lambda: tracker.update(z, **bad), tracker,
                check=lambda _: wrong(tracker))  # fmt: skip


def _parameter(tracker: Tracker, rng: np.random.Generator, deep: bool) -> tuple[str, str, Any]:
    params = tracker.get_params(deep=deep)
    name = str(rng.choice(sorted(params)))
    text = malformed(rng, params[name])
    return name, text, value_of(text, params[name])


def _set(tracker: Tracker, z: Any, _: list[Any], rng: np.random.Generator) -> Call:
    name, text, value = _parameter(tracker, rng, deep=True)
    return Call(f"set_params({name}={text})", lambda: tracker.set_params(**{name: value}), tracker)


def _construct(tracker: Tracker, z: Any, _: list[Any], rng: np.random.Generator) -> Call:
    """Return the construction with a malformed parameter, and a step of what it gives."""
    name, text, value = _parameter(tracker, rng, deep=False)
    params = tracker.get_params(deep=False) | {name: value}
    kind: Any = type(tracker)

    def run() -> Tracker:
        made: Tracker = kind(**params)
        made.predict()
        made.update(z)
        return made

    return Call(f"{kind.__name__}({name}={text}) and a step", run, tracker, check=wrong)


def _assign(tracker: Any, z: Any, _: list[Any], rng: np.random.Generator) -> Call:
    """Return an assignment; a wrong `x` or `P` may also be refused by the next step."""
    has_belief = isinstance(tracker.estimate, StateEstimate | PositionEstimate)
    known = [name for name in ASSIGNED if has_belief and hasattr(tracker, name)] or ["estimate"]
    name = str(rng.choice(known if rng.random() < 0.9 else ["nothing"]))
    old = getattr(tracker, name, None)
    text = malformed(rng, old)
    value = value_of(text, old)
    return Call(f"self.{name} = {text}", lambda: setattr(tracker, name, value), tracker,
                allowed=(ValueError, TypeError, AttributeError), deliberate=False)  # fmt: skip


def _config(tracker: Tracker, z: Any, _: list[Any], rng: np.random.Generator) -> Call:
    """Return a round trip by a configuration with a malformed entry."""
    try:
        config = tracker.to_dict()
    except Exception:
        config = {"type": "kalman"}
    name = str(rng.choice(sorted(config)))
    text = whatever(rng)
    config[name] = value_of(text)
    return Call(f"from_dict({name}: {text})", lambda: type(tracker).from_dict(config), tracker)


OPERATIONS: dict[str, Any] = {
    "update": _update,
    "same": _same,
    "predict": _predict,
    "control": _control,
    "run": _run,
    "run_batch": _run_batch,
    "batch_filter": _batch_filter,
    "options": _options,
    "set": _set,
    "construct": _construct,
    "assign": _assign,
    "config": _config,
}
