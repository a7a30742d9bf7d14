"""Tests of covariances over several maxima, and of the scene in which coverage can be read."""

import numpy as np

from arrivals.measurement_models import LogNormalRSS
from arrivals.motion_models import RandomWalk
from arrivals.scenarios.metrics import METRICS
from arrivals.scenarios.simulations.moving_emitters import WalkingSources
from arrivals.scenarios.simulations.signal_strength import Table1K3
from arrivals.trackers import RSSVB, VariationalSolver
from arrivals.trackers.rss.mirror import Line

MODES = VariationalSolver(covariance="modes", tol_u=1e-8, tol_theta=1e-6, max_iterations=200)
JOINT = MODES.replace(covariance="joint")
LINE = LogNormalRSS(np.stack([np.arange(-60.0, 61.0, 12.0), np.zeros(11)], axis=1), position=(0, 1))


def tracker(solver: VariationalSolver, model: LogNormalRSS, start: tuple[float, float],
            variance: float = 400.0) -> RSSVB:  # fmt: skip
    walk = RandomWalk(q=0.0)
    return RSSVB(walk, model, [start], variance * np.eye(2), solver=solver)


def test_the_mirror_image_at_a_line_of_sensors_is_half_of_the_posterior() -> None:
    z = LINE.draw([9.2], [[7.0, 25.0]], np.random.default_rng(0))
    results = []
    for solver in (JOINT, MODES):
        one = tracker(solver, LINE, (0.0, 1e-6))  # nearly symmetric: the prior prefers no side
        one.update(z)
        results.append(one.estimate)
    joint, modes = results
    np.testing.assert_array_equal(modes.position, joint.position)
    line = Line.through(LINE.sensors)
    assert line is not None
    # the image of Σ is mirrored too: the covariances of along and across cancel
    expected = line.with_mirror(joint.covariance, joint.position) * np.eye(2)
    np.testing.assert_allclose(modes.covariance, expected, rtol=1e-4, atol=1e-4)


def test_a_single_maximum_has_the_covariance_of_the_joint_gaussian() -> None:
    rng = np.random.default_rng(1)
    model = LogNormalRSS(rng.uniform(-60, 60, (60, 2)), position=(0, 1))
    z = model.draw([9.2], [[7.0, 25.0]], rng)
    both = [tracker(solver, model, (6.0, 24.0), 4.0) for solver in (JOINT, MODES)]
    for one in both:
        one.update(z)
    np.testing.assert_allclose(both[1].P, both[0].P, rtol=1e-4, atol=1e-8)


def test_a_batch_has_the_covariances_of_single_runs() -> None:
    trial, quick = (
        Table1K3().sample(np.random.default_rng(0)),
        VariationalSolver(covariance="modes"),
    )
    z = [[trial.measurements[0]], [trial.measurements[0] + 0.05]]
    batch = trial.tracker("rss_vb", solver=quick).run_batch(z)
    for run, sequence in zip(batch, z, strict=True):
        single = trial.tracker("rss_vb", solver=quick).run(sequence)
        np.testing.assert_allclose(run.covariance, single.covariance, rtol=1e-6)


def test_three_near_sources_are_covered() -> None:
    covered = {}
    for solver in (VariationalSolver(), VariationalSolver(covariance="modes")):
        runs = []
        for seed in range(8):
            trial = Table1K3().sample(np.random.default_rng(seed))
            run = trial.tracker("rss_vb", solver=solver).run(trial.measurements)
            runs.append(METRICS["coverage95"](trial, run))
        covered[solver.covariance] = np.nanmean(runs)
    assert covered["joint"] < 0.75 < 0.85 < covered["modes"]


def test_a_walk_as_assumed_is_covered() -> None:
    found = []
    for seed in range(8):
        trial = WalkingSources(n_sources=1).sample(np.random.default_rng(seed))
        run = trial.tracker("rss_vb").run(trial.measurements)
        found.append([METRICS[name](trial, run) for name in ("coverage68", "coverage95", "nees")])
    inner, outer, nees = np.mean(found, axis=0)
    assert 0.55 < inner < 0.80
    assert 0.88 < outer < 0.99
    assert 0.7 < nees < 1.5
