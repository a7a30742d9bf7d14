"""Doppler's factor by the tracker's own velocity."""

from typing import Any

import numpy as np
import pytest

from arrivals.measurement_models import LogGains, LogNormalRSS
from arrivals.measurement_models.signal_strength.path_loss import doppler_log_gain
from arrivals.motion_models import ConstantVelocity, RandomWalk
from arrivals.trackers import RSSML, RSSVB, AmplitudePrior
from arrivals.typing import Float

SPEED, C = 30.0, 340.0
RSS = LogNormalRSS(np.random.default_rng(0).uniform(-80, 80, (100, 2)), log_noise=4.6)
X0, P0 = [[-50.0, SPEED, 10.0, 0.0]], np.diag([5.0, 3.0, 5.0, 3.0]) ** 2


def readings(steps: int) -> tuple[Float, Float]:
    """Return the track of a source at 30 m/s, and readings with Doppler's factor."""
    rng = np.random.default_rng(1)
    track = np.array([[-50 + SPEED * 0.2 * step, 10.0] for step in range(steps)])
    z = []
    for theta in track:
        gain = doppler_log_gain([[SPEED, 0.0]], theta[None], RSS.sensors, C)
        z.append(RSS.replace(gains=LogGains(paths=gain)).draw([9.2], theta[None], rng))
    return track, np.array(z)


def tracker(kind: Any = RSSVB, **amplitude: Any) -> Any:
    prior = AmplitudePrior(**amplitude)
    return kind(ConstantVelocity(1.0), RSS, X0, P0, amplitude=prior)


@pytest.mark.parametrize("kind", [RSSVB, RSSML])
def test_own_velocity_removes_the_bias_along_the_track(kind: Any) -> None:
    track, z = readings(12)
    aware, usual = (tracker(kind, wave_speed=c).run(z, dt=0.2).position[:, 0] for c in (C, None))
    lead = [float(np.mean((found - track)[4:, 0])) for found in (aware, usual)]
    assert abs(lead[0]) < 0.5
    assert lead[1] > 2.0


def test_batch_is_the_same_as_step_by_step() -> None:
    _, z = readings(4)
    one = tracker(wave_speed=C)
    each = np.array(one.run(z, dt=0.2).position)
    batch = tracker(wave_speed=C).run_batch([z, z[::-1]], dt=0.2)
    np.testing.assert_allclose(batch[0].position, each, atol=1e-9)
    assert not np.allclose(batch[1].position, each)


def test_infinitely_fast_waves_have_no_effect() -> None:
    _, z = readings(4)
    fast, usual = (tracker(wave_speed=c).run(z, dt=0.2).position for c in (1e12, None))
    np.testing.assert_allclose(fast, usual, atol=1e-6)


def test_faster_sources_than_waves_are_tracked_with_a_shorter_velocity() -> None:
    _, z = readings(3)
    slow_waves = tracker(wave_speed=10.0)
    assert np.isfinite(slow_waves.run(z, dt=0.2).position).all()


def test_wave_speed_needs_a_velocity_and_a_constant_number_of_sources() -> None:
    with pytest.raises(ValueError, match="wave_speed must be finite and positive; got -1"):
        AmplitudePrior(wave_speed=-1)
    with pytest.raises(ValueError, match="wave_speed must be None where sources may appear"):
        RSSVB(
            ConstantVelocity(1.0), RSS, X0, P0, births=True, amplitude=AmplitudePrior(wave_speed=C)
        )


def test_wave_speed_set_later_is_that_of_the_constructor() -> None:
    _, z = readings(4)
    later, first = tracker(), tracker(wave_speed=C)
    later.set_params(amplitude__wave_speed=C)
    np.testing.assert_array_equal(later.run(z, dt=0.2).position, first.run(z, dt=0.2).position)
    with pytest.raises(ValueError, match="motion must have vx and vy for wave_speed; got Random"):
        tracker(wave_speed=C).set_params(motion=RandomWalk(q=1.0, n_dims=4))
