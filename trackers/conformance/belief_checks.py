"""Checks of the belief and the estimates of a tracker."""

from __future__ import annotations

import dataclasses

import numpy as np

from arrivals.trackers.conformance.comparison import assert_same, require
from arrivals.trackers.conformance.stepping import (
    MakeTracker,
    Measurements,
    named_check,
    run_step,
)
from arrivals.trackers.estimates import Estimate


@named_check
def belief_has_mean_and_covariance(make: MakeTracker, measurements: Measurements) -> None:
    """Check that `x`, `P` are real with constant shapes, `P` symmetric and semidefinite."""
    tracker = make()
    shapes = np.shape(tracker.x), np.shape(tracker.P)
    for n, z in enumerate([None, *measurements, None]):
        if n:
            run_step(tracker, z)
        x, P = tracker.x, tracker.P
        for name, value in (("x", x), ("P", P)):
            real = isinstance(value, np.ndarray) and value.dtype.kind == "f"
            require(real, f"{name} must be an array of floats; got {value!r}")
        require((x.shape, P.shape) == shapes, f"shapes {shapes} became {(x.shape, P.shape)}")
        require(x.ndim == 1 or x.shape == (x.size, 1), f"x must be (n,) or (n, 1); got {x.shape}")
        require(P.shape == (x.size, x.size), f"P must be {(x.size, x.size)}; got {P.shape}")
        used = ~np.isnan(x.ravel())
        block = P[np.ix_(used, used)]
        require(np.isfinite(x.ravel()[used]).all(), f"x must be finite or NaN; got {x}")
        require(np.isfinite(block).all(), f"P must be finite where x is not NaN; got {P}")
        scale = 1e-9 * np.abs(block).max(initial=0.0)
        require(np.abs(block - block.T).max(initial=0.0) <= scale, f"P is not symmetric: {P}")
        lowest = np.linalg.eigvalsh(block).min(initial=0.0)
        require(lowest >= -scale, f"P has the negative eigenvalue {lowest}: {P}")


@named_check
def estimate_is_a_frozen_record(make: MakeTracker, measurements: Measurements) -> None:
    """Check that estimates are frozen, of one class, with consistent fields and rows."""
    tracker = make()
    kind = type(tracker.estimate)
    dtypes = check_estimate(tracker.estimate)
    for z in measurements:
        tracker.predict()
        assert_same(dtypes, check_estimate(tracker.estimate), "types of the fields after predict")
        tracker.update(z)
        assert_same(dtypes, check_estimate(tracker.estimate), "types of the fields after update")
        require(type(tracker.estimate) is kind, f"{kind} became {type(tracker.estimate)}")


def check_estimate(estimate: Estimate) -> dict[str, str]:
    """Check one estimate, and return the types of its per-source fields."""
    require(isinstance(estimate, Estimate), f"estimate must be an Estimate; got {estimate!r}")
    try:
        setattr(estimate, next(iter(estimate.per_source)), None)
    except dataclasses.FrozenInstanceError:
        pass
    else:
        raise AssertionError(f"{type(estimate).__name__} is not frozen")
    fields = {name: getattr(estimate, name) for name in estimate.per_source}
    lengths = {name: len(value) for name, value in fields.items()}
    require(len(set(lengths.values())) == 1, f"fields differ in length: {lengths}")
    for name in ("doa", "position"):
        value = fields.get(name, np.zeros(0))
        require(np.isfinite(value).all(), f"{name} must be finite; got {value}")
    existence = fields.get("existence", np.zeros(0))
    is_valid = np.isnan(existence) | ((existence >= 0) & (existence <= 1))
    require(is_valid.all(), f"existence must lie in [0, 1] or be NaN; got {existence}")
    label = np.asarray(fields.get("label", np.zeros(0, dtype=np.int64)))
    require(label.dtype.kind == "i", f"labels must be whole numbers; got {label}")
    used = label[label >= 0]
    require(len(np.unique(used)) == len(used), f"labels must be unique; got {label}")
    rows = estimate.rows()
    require(len(rows) == estimate.n_found, f"{estimate.n_found} sources gave {len(rows)} rows")
    for row in rows:
        require(
            len(row) == len(estimate.columns),
            f"row must have the columns {estimate.columns}; got {row}",
        )
        require(all(np.ndim(cell) == 0 for cell in row), f"row must hold single values; got {row}")
    return {name: value.dtype.kind for name, value in fields.items()}
