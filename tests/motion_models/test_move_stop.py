"""A walk that may stand still: an interacting bank of two Kalman filters."""

import numpy as np
import pytest

from arrivals.measurement_models import LinearMeasurement
from arrivals.motion_models import MoveStopWalk, RandomWalk
from arrivals.trackers import IMM, Kalman


def test_bank_equals_imm_of_two_kalman_filters() -> None:
    """With the transition matrix s I + (1-s) 1 ω' the bank is the IMM of its two walks."""
    walk, q, R = MoveStopWalk(still=0.3, stay=0.9, slow=0.1), 0.04, 0.25
    measurement = LinearMeasurement([[1.0]], [[R]])
    members = [Kalman(RandomWalk(v, 1), measurement, [0.0], [[1.0]]) for v in (q * 0.1**2, q)]
    transition = 0.9 * np.eye(2) + 0.1 * np.array([[0.3, 0.7], [0.3, 0.7]])
    imm = IMM(members, [0.3, 0.7], transition)
    modes, mean = walk.initial(1.0), 0.0
    for z in np.random.default_rng(0).standard_normal(30):
        imm.predict()
        shift, variance, modes = walk.predict(modes, q)
        mean += float(shift)
        np.testing.assert_allclose([imm.x[0], imm.P[0, 0]], [mean, float(variance)], rtol=1e-10)
        imm.update([z])
        shift, variance, modes = walk.update(modes, z - mean, R)
        mean += float(shift)
        np.testing.assert_allclose([imm.x[0], imm.P[0, 0]], [mean, float(variance)], rtol=1e-10)
        np.testing.assert_allclose(imm.mu, modes[2], rtol=1e-9)


def test_leading_axes_are_independent_components() -> None:
    rng, walk = np.random.default_rng(1), MoveStopWalk()
    variance, deviation = rng.uniform(0.1, 1.0, (4, 3)), rng.standard_normal((4, 3))
    _, _, modes = walk.predict(walk.initial(variance), 0.1)
    together = walk.update(modes, deviation, 0.2)
    for i in np.ndindex(4, 3):
        single = walk.update(walk.predict(walk.initial(variance[i]), 0.1)[2], deviation[i], 0.2)
        for each, expected in zip(together[:2], single[:2], strict=True):
            np.testing.assert_allclose(each[i], expected)


def test_no_time_keeps_the_mixture() -> None:
    walk = MoveStopWalk()
    _, variance, modes = walk.predict(walk.initial(0.5), 0.1)
    _, variance, modes = walk.update(modes, 0.3, 0.2)
    shift, same, kept = walk.predict(modes, 0.1, dt=0.0)
    np.testing.assert_allclose(kept, modes, atol=1e-12)
    assert same == pytest.approx(float(variance))
    assert shift == pytest.approx(0.0, abs=1e-12)


def test_modes_of_another_variance_begin_anew() -> None:
    walk = MoveStopWalk()
    modes = walk.initial([0.5, 0.5])
    np.testing.assert_array_equal(walk.renewed(modes, [0.5, 0.7])[1], [[0.5, 0.5], [0.7, 0.7]])


@pytest.mark.parametrize("name", ["still", "stay"])
@pytest.mark.parametrize("value", [0.0, 1.0, -1.0, np.nan])
def test_probability_outside_its_range_is_refused(name: str, value: float) -> None:
    with pytest.raises(ValueError, match=name):
        MoveStopWalk(**{name: value})
