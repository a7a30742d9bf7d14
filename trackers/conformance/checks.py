"""What every tracker is put through, ours and other people's.

Each check takes a function that makes a fresh tracker and a few valid measurements, and raises an
AssertionError that says what differed. With pytest, one test a check:

    @pytest.mark.parametrize("check", CHECKS, ids=lambda check: check.__name__)
    def test_conforms(check):
        check(lambda: MyTracker(...), measurements)

and without, `check_tracker(lambda: MyTracker(...), measurements)`.
"""

from __future__ import annotations

import copy
import dataclasses
import functools
import json
import pickle
from collections.abc import Callable, Mapping, Sequence
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from arrivals.parameters import Configurable, FrozenModel
from arrivals.trackers.base import Tracker
from arrivals.trackers.estimates import Estimate

MakeTracker: TypeAlias = Callable[[], Tracker]
Measurements: TypeAlias = Sequence[ArrayLike] | NDArray[Any]
Check: TypeAlias = Callable[[MakeTracker, Measurements], None]


def check_tracker(make: MakeTracker, measurements: Measurements) -> None:
    """Put a tracker through all checks.

    Parameters
    ----------
    make : callable
        Makes a fresh tracker, always the same.
    measurements : array_like, shape (n_steps, ...), or sequence
        A few valid measurements, at least two.

    Raises
    ------
    AssertionError
        If a check fails; the message starts with its name.

    Examples
    --------
    >>> from arrivals.measurement_models import ArraySnapshot, SensorArray
    >>> from arrivals.trackers import CBF
    >>> model = ArraySnapshot(SensorArray.ula(4, spacing=0.5), wavelength=1.0)
    >>> check_tracker(lambda: CBF(model), [[1, 1, 1, 1], [1, 1j, -1, -1j]])
    """
    for check in CHECKS:
        check(make, measurements)


def named(check: Check) -> Check:
    """Let every failure of a check, exceptions of the tracker included, carry its name."""

    @functools.wraps(check)
    def run(make: MakeTracker, measurements: Measurements) -> None:
        try:
            _true(len(measurements) >= 2, "needs two measurements at least")
            check(make, copy.deepcopy(measurements))
        except AssertionError as error:
            raise AssertionError(f"{check.__name__}: {error}") from None
        except Exception as error:
            kind = type(error).__name__
            raise AssertionError(f"{check.__name__}: raised {kind}: {error}") from error

    return run


# Comparing


def difference(a: Any, b: Any, where: str = "value") -> str | None:
    """Tell where two values differ, NaN equal to NaN, or return None.

    Arrays, numbers, containers and the attributes of objects are gone through.

    Examples
    --------
    >>> difference({"x": np.zeros(2)}, {"x": np.ones(2)}, "belief")
    'belief.x: [0. 0.] became [1. 1.]'
    >>> difference([1.0, np.nan], [1.0, np.nan])
    """
    return _difference(a, b, where, set())


def _difference(a: Any, b: Any, where: str, seen: set[tuple[int, int]]) -> str | None:
    if a is b or (id(a), id(b)) in seen:
        return None
    seen.add((id(a), id(b)))
    changed = f"{where}: {a!r} became {b!r}"
    if type(a) is not type(b):
        return changed
    if isinstance(a, np.ndarray) and a.dtype != object:
        same = a.dtype == b.dtype and np.array_equal(a, b, equal_nan=a.dtype.kind in "fc")
        return None if same else f"{where}: {a} became {b}"
    if isinstance(a, float | complex | np.number):
        return None if a == b or (a != a and b != b) else changed
    if isinstance(a, np.random.Generator):
        a, b = a.bit_generator.state, b.bit_generator.state
    parts_a, parts_b = _parts(a), _parts(b)
    if parts_a is None or parts_b is None:
        return None if a == b else changed
    if parts_a.keys() != parts_b.keys():
        return f"{where}: {sorted(map(str, parts_a))} became {sorted(map(str, parts_b))}"
    found = (_difference(parts_a[key], parts_b[key], f"{where}.{key}", seen) for key in parts_a)
    return next(filter(None, found), None)


def _parts(value: Any) -> dict[Any, Any] | None:
    """Return what a container or an object consists of, or None for what has no parts."""
    if isinstance(value, Mapping):
        return dict(value)
    if isinstance(value, list | tuple | np.ndarray):
        return dict(enumerate(value))
    if callable(value) or not hasattr(value, "__dict__"):
        return None
    parts: dict[str, Any] = vars(value)
    return parts


def _same(a: Any, b: Any, what: str) -> None:
    found = difference(a, b, what)
    if found:
        raise AssertionError(found)


def _near(a: dict[str, Any], b: dict[str, Any], what: str) -> None:
    """Raise where two sets of arrays differ by more than rounding of an array program."""
    _same(sorted(a), sorted(b), what)
    for name, array in a.items():
        other = b[name]
        same = array.shape == other.shape and np.allclose(
            array, other, rtol=1e-9, atol=1e-9, equal_nan=array.dtype.kind in "fc"
        )
        _true(same, f"{what}.{name}: {array} became {other}")


def _true(fact: bool | np.bool_, message: str) -> None:
    if not fact:
        raise AssertionError(message)


# Stepping


def _step(tracker: Tracker, z: ArrayLike | None) -> dict[str, Any]:
    """Predict, update, and return a copy of what is believed then."""
    tracker.predict()
    tracker.update(z)
    return _belief(tracker)


def _belief(tracker: Tracker) -> dict[str, Any]:
    return copy.deepcopy({"x": tracker.x, "P": tracker.P, "estimate": tracker.estimate})


def _steps(tracker: Tracker, measurements: Measurements) -> list[dict[str, Any]]:
    return [_step(tracker, z) for z in measurements]


def _state(tracker: Tracker) -> dict[str, Any]:
    """Return a copy of every attribute."""
    return copy.deepcopy(vars(tracker))


def _halfway(make: MakeTracker, measurements: Measurements) -> tuple[Tracker, Measurements]:
    """Return a tracker that has seen the first measurements, and the others."""
    half = (len(measurements) + 1) // 2
    tracker = make()
    _steps(tracker, measurements[:half])
    return tracker, measurements[half:]


# The checks


@named
def belief_has_mean_and_covariance(make: MakeTracker, measurements: Measurements) -> None:
    """Check that `x`, `P` are real and keep their shapes, `P` symmetric and not negative."""
    tracker = make()
    shapes = np.shape(tracker.x), np.shape(tracker.P)
    for n, z in enumerate([None, *measurements, None]):
        if n:
            _step(tracker, z)
        x, P = tracker.x, tracker.P
        for name, value in (("x", x), ("P", P)):
            real = isinstance(value, np.ndarray) and value.dtype.kind == "f"
            _true(real, f"{name} must be an array of floats; got {value!r}")
        _true((x.shape, P.shape) == shapes, f"shapes {shapes} became {(x.shape, P.shape)}")
        _true(x.ndim == 1 or x.shape == (x.size, 1), f"x must be (n,) or (n, 1); got {x.shape}")
        _true(P.shape == (x.size, x.size), f"P must be {(x.size, x.size)}; got {P.shape}")
        used = ~np.isnan(x.ravel())
        block = P[np.ix_(used, used)]
        _true(np.isfinite(x.ravel()[used]).all(), f"x must be finite or NaN; got {x}")
        _true(np.isfinite(block).all(), f"P must be finite where x is in use; got {P}")
        scale = 1e-9 * np.abs(block).max(initial=0.0)
        _true(np.abs(block - block.T).max(initial=0.0) <= scale, f"P is not symmetric: {P}")
        lowest = np.linalg.eigvalsh(block).min(initial=0.0)
        _true(lowest >= -scale, f"P has the negative eigenvalue {lowest}: {P}")


@named
def same_input_gives_same_output(make: MakeTracker, measurements: Measurements) -> None:
    """Check that two fresh trackers that take turns, and a third one, agree to the last bit."""
    one, two = make(), make()
    turns = [(_step(one, z), _step(two, z)) for z in measurements]
    for n, (first, second) in enumerate(turns):
        _same(first, second, f"step {n} of two trackers that take turns")
    _same([first for first, _ in turns], _steps(make(), measurements), "a later tracker, step")


@named
def missed_measurement_leaves_belief(make: MakeTracker, measurements: Measurements) -> None:
    """Check that after None or NaN, first thing or later, the belief is what `predict` left."""
    for missing in (None, np.nan, np.full(np.shape(measurements[0]), np.nan)):
        for tracker in (make(), _halfway(make, measurements)[0]):
            tracker.update(missing)
            tracker.predict()
            before = _sources(tracker)
            tracker.update(missing)
            _same(before, _sources(tracker), f"after update({missing})")
            _steps(tracker, measurements)


def _sources(tracker: Tracker) -> dict[str, Any]:
    """Return a copy of the belief, less what an estimate says of its own making."""
    estimate = tracker.estimate
    sources = {name: getattr(estimate, name) for name in estimate.per_source}
    return copy.deepcopy({"x": tracker.x, "P": tracker.P, "estimate": sources})


@named
def estimate_is_a_frozen_record(make: MakeTracker, measurements: Measurements) -> None:
    """Check that estimates are frozen, of one kind, and their fields and rows agree."""
    tracker = make()
    kind = type(tracker.estimate)
    dtypes = _checked(tracker.estimate)
    for z in measurements:
        tracker.predict()
        _same(dtypes, _checked(tracker.estimate), "types of the fields after predict")
        tracker.update(z)
        _same(dtypes, _checked(tracker.estimate), "types of the fields after update")
        _true(type(tracker.estimate) is kind, f"{kind} became {type(tracker.estimate)}")


def _checked(estimate: Estimate) -> dict[str, str]:
    """Check one estimate; return the types of its per-source fields."""
    _true(isinstance(estimate, Estimate), f"{estimate!r} is no Estimate")
    try:
        setattr(estimate, next(iter(estimate.per_source)), None)
    except dataclasses.FrozenInstanceError:
        pass
    else:
        raise AssertionError(f"{type(estimate).__name__} is not frozen")
    fields = {name: getattr(estimate, name) for name in estimate.per_source}
    lengths = {name: len(value) for name, value in fields.items()}
    _true(len(set(lengths.values())) == 1, f"fields differ in length: {lengths}")
    for name in ("doa", "position"):
        place = fields.get(name, np.zeros(0))
        _true(np.isfinite(place).all(), f"{name} must be finite; got {place}")
    existence = fields.get("existence", np.zeros(0))
    likely = np.isnan(existence) | ((existence >= 0) & (existence <= 1))
    _true(likely.all(), f"existence must lie in [0, 1] or be NaN; got {existence}")
    label = np.asarray(fields.get("label", np.zeros(0, dtype=np.int64)))
    _true(label.dtype.kind == "i", f"labels must be whole numbers; got {label}")
    kept = label[label >= 0]
    _true(len(np.unique(kept)) == len(kept), f"labels are given twice: {label}")
    rows = estimate.rows()
    _true(len(rows) == estimate.n_found, f"{estimate.n_found} sources gave {len(rows)} rows")
    for row in rows:
        _true(len(row) == len(estimate.columns), f"row {row} fits not {estimate.columns}")
        _true(all(np.ndim(cell) == 0 for cell in row), f"row {row} holds arrays")
    return {name: value.dtype.kind for name, value in fields.items()}


@named
def pickle_goes_on_like_the_original(make: MakeTracker, measurements: Measurements) -> None:
    """Check that a tracker that was pickled half-way goes on as if nothing had been."""
    tracker, rest = _halfway(make, measurements)
    loaded = pickle.loads(pickle.dumps(tracker))
    _same(_belief(tracker), _belief(loaded), "after pickling")
    _same(_steps(tracker, rest), _steps(loaded, rest), "after pickling, step")


@named
def deep_copy_is_independent(make: MakeTracker, measurements: Measurements) -> None:
    """Check that a deep copy goes on like the original, and moves nothing of it."""
    tracker, rest = _halfway(make, measurements)
    before = _state(tracker)
    copied = _steps(copy.deepcopy(tracker), rest)
    _same(before, _state(tracker), "the original, while its copy moved")
    _same(copied, _steps(tracker, rest), "after copying, step")


@named
def run_is_the_loop(make: MakeTracker, measurements: Measurements) -> None:
    """Check that `run` gives what the loop by hand gives, and ends in the same state."""
    gaps = [None, *measurements, None]
    by_hand, tracker = make(), make()
    steps = [_step(by_hand, z) for z in gaps]
    run = tracker.run(gaps)
    _same(len(steps), len(run), "number of steps")
    for n, step in enumerate(steps):
        _same(step["x"], run.x[n], f"x of step {n}")
        _same(step["estimate"], run.estimate(n), f"estimate of step {n}")
    _same(_belief(by_hand), _belief(tracker), "after the run")
    _true(len(make().run([])) == 0, "a run of nothing has steps")


@named
def batch_is_single_runs(make: MakeTracker, measurements: Measurements) -> None:
    """Check that `run_batch` gives what single runs from the present state give, to 1e-9."""
    tracker, _ = _halfway(make, measurements)
    before = _state(tracker)
    batch = [list(measurements), list(measurements)[::-1]]
    runs = list(tracker.run_batch(batch))
    _same(before, _state(tracker), "after run_batch")
    _same(len(batch), len(runs), "number of runs")
    for n, sequence in enumerate(batch):
        single = copy.deepcopy(tracker).run(sequence)
        _near(dict(single.fields), dict(runs[n].fields), f"run {n} of the batch")
        _near({"x": single.x}, {"x": runs[n].x}, f"run {n} of the batch")


@named
def kept_arrays_stay(make: MakeTracker, measurements: Measurements) -> None:
    """Check that what a caller kept of earlier steps is not written into by later ones."""
    tracker = make()
    kept: list[dict[str, Any]] = []
    copies: list[dict[str, Any]] = []

    def keep() -> None:
        kept.append({"x": tracker.x, "P": tracker.P, "estimate": tracker.estimate})
        copies.append(copy.deepcopy(kept[-1]))

    keep()
    for z in measurements:
        tracker.predict()
        keep()
        tracker.update(z)
        keep()
    _same(copies, kept, "what was kept, half step")


@named
def measurement_stays_the_callers(make: MakeTracker, measurements: Measurements) -> None:
    """Check that a measurement is not modified, and its array free again after `update`."""
    expected = _steps(make(), copy.deepcopy(measurements))
    tracker = make()
    for n, z in enumerate(measurements):
        buffer = np.array(z)
        tracker.predict()
        tracker.update(buffer)
        _same(np.array(z), buffer, f"measurement {n}")
        buffer[...] = 0
        _same(expected[n], _belief(tracker), f"step {n}, once the measurement's array was reused")


@named
def constructor_takes_the_parameters(make: MakeTracker, measurements: Measurements) -> None:
    """Check that what `get_params` gives makes the same tracker."""
    params = make().get_params(deep=False)
    rebuilt = type(make())(**params)
    _same(params, rebuilt.get_params(deep=False), "parameters")
    _same(_steps(make(), measurements), _steps(rebuilt, measurements), "the rebuilt one, step")


@named
def own_parameters_change_nothing(make: MakeTracker, measurements: Measurements) -> None:
    """Check that `set_params` with the tracker's own values keeps belief and results."""
    for deep in (False, True):
        tracker, rest = _halfway(make, measurements)
        expected = _steps(copy.deepcopy(tracker), rest)
        before = _belief(tracker)
        changed = tracker.set_params(**tracker.get_params(deep=deep))
        _true(changed is tracker, "set_params must return the tracker itself")
        _same(before, _belief(tracker), "after set_params")
        _same(expected, _steps(tracker, rest), "after set_params, step")


@named
def unknown_parameter_is_refused(make: MakeTracker, measurements: Measurements) -> None:
    """Check that a name that no parameter, or no part's, has is a ValueError and no change."""
    tracker, _ = _halfway(make, measurements)
    before = _state(tracker)
    parts = [
        f"{name}__"
        for name, part in tracker.get_params(deep=False).items()
        if isinstance(part, Configurable)
    ]
    for part in ["", *parts]:
        name = f"{part}no_such_parameter"
        _refused(tracker.set_params, f"set_params({name}=1)", **{name: 1})
        _same(before, _state(tracker), f"after set_params({name}=1)")


def _refused(call: Callable[..., object], what: str, **params: Any) -> None:
    try:
        call(**params)
    except ValueError:
        return
    raise AssertionError(f"{what} was accepted")


@named
def sklearn_clones_it(make: MakeTracker, measurements: Measurements) -> None:
    """Check that `sklearn.base.clone` makes a tracker with the same parameters."""
    from sklearn.base import clone

    fresh = clone(make())
    _same(_steps(make(), measurements), _steps(fresh, measurements), "the clone, step")
    moved, _ = _halfway(make, measurements)
    _same(moved.get_params(deep=False), clone(moved).get_params(deep=False), "parameters")


@named
def configuration_survives_json(make: MakeTracker, measurements: Measurements) -> None:
    """Check that `to_dict`, through JSON and back, gives a tracker with the same output."""
    config = json.loads(json.dumps(make().to_dict()))
    rebuilt = Tracker.from_dict(config)
    _true(type(rebuilt) is type(make()), f"{type(make())} became {type(rebuilt)}")
    _same(_steps(make(), measurements), _steps(rebuilt, measurements), "the rebuilt one, step")
    config["no_such_parameter"] = 1
    _refused(Tracker.from_dict, "from_dict with an unknown parameter", config=config)


@named
def bad_measurement_leaves_everything(make: MakeTracker, measurements: Measurements) -> None:
    """Check that wrong shapes and text are a ValueError or TypeError, and change nothing."""
    shape = np.shape(measurements[0]) or (1,)
    longer = (*shape[:-1], shape[-1] + 1)
    bad: dict[str, ArrayLike] = {
        "one number too many": np.ones(longer),
        "two measurements at once": np.ones((2, *longer)),
        "text": "text",
        "an array of text": np.full(shape, "text"),
    }
    for tracker in (make(), _halfway(make, measurements)[0]):
        tracker.predict()
        before = _state(tracker)
        for what, z in bad.items():
            try:
                tracker.update(z)
            except (ValueError, TypeError):
                _same(before, _state(tracker), f"after {what}")
            else:
                raise AssertionError(f"{what} was accepted: update({z!r})")


@named
def parts_are_immutable(make: MakeTracker, measurements: Measurements) -> None:
    """Check that the models of a tracker are what they were after it has moved."""
    tracker = make()
    parts = {k: v for k, v in tracker.get_params(deep=False).items() if isinstance(v, FrozenModel)}
    numbers = copy.deepcopy({name: part.to_dict() for name, part in parts.items()})
    _steps(tracker, measurements)
    for name, part in parts.items():
        _true(getattr(tracker, name) is part, f"{name} was replaced")
        _same(numbers[name], part.to_dict(), name)
        _true(copy.deepcopy(part) is part, f"{name} must return itself from deepcopy")


@named
def filterpy_saver_works(make: MakeTracker, measurements: Measurements) -> None:
    """Check that `filterpy.common.Saver` records it, and its lists become arrays."""
    from filterpy.common import Saver

    tracker = make()
    saver = Saver(tracker, save_current=True)
    beliefs = [_belief(tracker)]
    for z in measurements:
        beliefs.append(_step(tracker, z))
        saver.save()
    saver.to_array()
    for name in ("x", "P"):
        _same(np.array([belief[name] for belief in beliefs]), getattr(saver, name), name)


CHECKS: tuple[Check, ...] = (
    belief_has_mean_and_covariance,
    same_input_gives_same_output,
    missed_measurement_leaves_belief,
    estimate_is_a_frozen_record,
    pickle_goes_on_like_the_original,
    deep_copy_is_independent,
    run_is_the_loop,
    batch_is_single_runs,
    kept_arrays_stay,
    measurement_stays_the_callers,
    constructor_takes_the_parameters,
    own_parameters_change_nothing,
    unknown_parameter_is_refused,
    sklearn_clones_it,
    configuration_survives_json,
    bad_measurement_leaves_everything,
    parts_are_immutable,
    filterpy_saver_works,
)
