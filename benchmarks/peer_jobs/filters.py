"""Gaussian filters beside filterpy and simdkalman."""

from __future__ import annotations

import copy
from collections.abc import Callable
from importlib.util import find_spec

import numpy as np
from against_filterpy import F as TRANSITION
from against_filterpy import H, P, X, Z, ekf, ours, theirs
from against_filterpy import Q as NOISE
from interpolation import filterpy_doa

from arrivals.scenarios.reproduce.interpolation.trials import draws, tracker
from arrivals.scenarios.simulations.sampled_source import InterpolationTone
from arrivals.typing import Float
from peer_jobs import Job

N_STEPS, N_FILTERS, N_TRIALS = 10_000, 10_000, 4
Filtered = tuple[Float, Float, Float, Float]


def jobs() -> list[Job]:
    """Return the jobs; that of simdkalman if it is installed."""
    many = [_many()] if find_spec("simdkalman") else []
    return [*_interpolation(), *_sequences(), _ekf(), *many]


def _interpolation() -> list[Job]:
    """Return one run of variant B against filterpy's EKF, fed one vector update a snapshot."""
    scenario = InterpolationTone(doa_deg=60.0)
    samples, model = draws(scenario, N_TRIALS, 0), scenario.measurement
    made = tracker(model, "B", 50.0, scenario.n_steps)
    baseline = made.assembly.final.baseline_models[0]  # type: ignore[union-attr]  # not joint
    frames, x0, P0 = model.frame(samples), float(made.x[0]), float(made.P[0, 0])

    def peer() -> object:
        return [filterpy_doa(baseline, frame, x0, P0) for frame in frames]

    def work(sequential: bool) -> Callable[[], object]:
        changed = copy.deepcopy(made)
        changed.set_params(variant__sequential_update=sequential)
        return lambda: [copy.deepcopy(changed).run(z) for z in samples]

    name = f"interpolation EKF, {N_TRIALS} runs of {scenario.n_steps} snapshots"
    return [
        Job(f"{name}, quick form", work(False), peer, "filterpy", 1.5),
        Job(f"{name}, each sensor", work(True), peer, "filterpy", 4.0),
    ]


def _sequences() -> list[Job]:
    """Return filtering and smoothing of one sequence by constant linear models."""
    zs = np.random.default_rng(0).normal(Z, 1.0, (N_STEPS, 2))
    tracker, peer = ours(), theirs()

    def filtered() -> Filtered:
        tracker.x, tracker.P = X.copy(), P.copy()
        return tracker.batch_filter(zs)

    def filtered_by_peer() -> object:
        peer.x, peer.P = X.copy(), P.copy()
        return peer.batch_filter(zs)

    means, covariances, _, _ = filtered()
    return [
        Job(f"batch_filter, {N_STEPS} steps", filtered, filtered_by_peer, "filterpy", 0.8),
        Job(
            f"rts_smoother, {N_STEPS} steps",
            lambda: tracker.rts_smoother(means, covariances),
            lambda: peer.rts_smoother(means, covariances),
            "filterpy",
            0.8,
        ),
    ]


def _ekf() -> Job:
    """Return a step on two bearings: ours with the likelihood, filterpy's without."""
    peer, step = ekf()
    return Job("ekf on two bearings, with likelihood", step, peer, "filterpy, without", 1.0)


def _many(n_steps: int = 20) -> Job:
    """Return many linear Kalman filters at once."""
    import simdkalman

    zs = np.random.default_rng(0).normal(Z, 1.0, (N_FILTERS, n_steps, 2))
    tracker = ours()
    peer = simdkalman.KalmanFilter(TRANSITION, NOISE, H, np.eye(2))

    def by_peer() -> object:
        return peer.compute(
            zs, 0, initial_value=X, initial_covariance=P, filtered=True, smoothed=False,
            observations=False,
        )  # fmt: skip

    name = f"{N_FILTERS} linear Kalman filters, {n_steps} steps"
    return Job(name, lambda: tracker.run_batch(zs), by_peer, "simdkalman", 0.3)
