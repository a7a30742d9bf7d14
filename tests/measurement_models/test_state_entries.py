"""Entries of a state by name: what a measurement reads, and where it finds it."""

import pickle
from dataclasses import dataclass

import numpy as np
import pytest
from numpy.typing import ArrayLike

from arrivals.measurement_models import (
    ArraySnapshot,
    Bearing,
    DelayInterpolator,
    DelayLine,
    InterpolationDelay,
    LinearMeasurement,
    LogNormalRSS,
    MeasurementModel,
    Phasor,
    SensorArray,
    Tones,
)
from arrivals.motion_models import (
    AutoregressiveSources,
    BernoulliVonMises,
    ConstantVelocity,
    CoordinatedTurn,
    DelayDrift,
    DelayWalk,
    LinearMotion,
    MotionModel,
    RandomWalk,
    VonMisesWalk,
)
from arrivals.trackers import EKF
from arrivals.typing import Float

PHASOR = Phasor(3, 0.1, frequency=0.25)
SNAPSHOT = ArraySnapshot(SensorArray.ula(3, spacing=0.5), wavelength=1.0)
LINE = DelayLine(3, 0.1, Tones(0.25), kappa=2.0)
DELAY = InterpolationDelay(DelayInterpolator(Tones(0.25)), n_sensors=3, noise_ratio=0.1)
BEARING = Bearing([[0.0, 0.0], [10.0, 0.0]], noise=0.01)
RSS = LogNormalRSS([[0.0, 0.0], [10.0, 0.0], [0.0, 10.0]])


@pytest.mark.parametrize(
    ("motion", "names"),
    [
        (RandomWalk(0.1), "x y"),
        (RandomWalk(0.1, n_dims=4), "x1 x2 x3 x4"),
        (ConstantVelocity(0.1, n_dims=3), "x vx y vy z vz"),
        (CoordinatedTurn(0.1, 0.1), "x vx y vy turn_rate"),
        (VonMisesWalk(10.0), "doa"),
        (BernoulliVonMises(), "doa"),
        (DelayWalk(), "delay"),
        (DelayDrift(), "delay delay_rate"),
        (LinearMotion(np.eye(2), np.eye(2)), ""),
        (LinearMotion(np.eye(2), np.eye(2), names=["a", "b"]), "a b"),
        (
            AutoregressiveSources([[0.9], [0.5, 0.1]], real_valued=True),
            "source_0_lag_0 source_0_lag_1 source_1_lag_0 source_1_lag_1 source_1_lag_2",
        ),
        (
            AutoregressiveSources([[0.9]]),
            "source_0_lag_0_re source_0_lag_1_re source_0_lag_0_im source_0_lag_1_im",
        ),
    ],
    ids=str,
)
def test_state_names_of_shipped_motions(motion: MotionModel, names: str) -> None:
    assert motion.state_names == tuple(names.split())
    assert len(motion.state_names) in (0, motion.dim_x)
    assert motion.is_linear == isinstance(motion.F(np.ones(motion.dim_x)), np.ndarray) & (
        not isinstance(motion, CoordinatedTurn | VonMisesWalk | BernoulliVonMises)
    )


@pytest.mark.parametrize(
    ("measurement", "needs"),
    [
        (BEARING, "x y"),
        (BEARING.replace(position=(0, 1)), ""),
        (RSS, "x y"),
        (SNAPSHOT, "doa amplitude_re amplitude_im"),
        (DELAY, "delay"),
        (LINE, "delay waveform_lag_0 waveform_lag_1"),
        (PHASOR, "delay amplitude_re amplitude_im"),
        (LinearMeasurement([[1.0]], [[1.0]]), ""),
    ],
    ids=lambda model: type(model).__name__,
)
def test_needs_of_shipped_measurements(measurement: MeasurementModel, needs: str) -> None:
    assert measurement.needs == tuple(needs.split())
    assert measurement.for_state(()) is measurement
    assert measurement.for_state(measurement.needs).h is not None


def test_missing_entry_raises_with_its_name() -> None:
    message = (
        r"measurement must read entries of the state: Phasor needs 'amplitude_re'; "
        r"got 'delay', 'delay_rate'$"
    )
    with pytest.raises(TypeError, match=message):
        PHASOR.for_state(DelayDrift().state_names)
    with pytest.raises(TypeError, match=r"Bearing needs 'y'; got 'x', 'vx'$"):
        BEARING.for_state(ConstantVelocity(1.0, n_dims=1).state_names)


@pytest.mark.parametrize("model", [BEARING, RSS], ids=["bearing", "rss"])
def test_position_follows_the_state_names(model: Bearing | LogNormalRSS) -> None:
    located = model.for_state(("vx", "y", "vy", "x"))
    assert located.position == (3, 1)
    assert located.for_state(("x", "y")) is located
    explicit = model.replace(position=(0, 3))
    assert explicit.for_state(("x", "y")) is explicit
    np.testing.assert_array_equal(located.h([0, 2.0, 0, 1.0]), model.h([1.0, 2.0]))


@pytest.mark.parametrize("model", [BEARING, RSS], ids=["bearing", "rss"])
def test_position_without_names_follows_the_size(model: Bearing | LogNormalRSS) -> None:
    at = model.h([1.0, 2.0])
    for x in ([1.0, 2.0, 9.0], [1.0, 9.0, 2.0, 9.0], [1.0, 9.0, 2.0, 9.0, 9.0]):
        np.testing.assert_array_equal(model.h(x), at)
        assert model.H(x).shape == (model.dim_z, len(x))


def test_amplitude_follows_the_state_names() -> None:
    located = RSS.for_state(("log_amplitude", "x", "y"))
    assert (located.position, located.amplitude) == ((1, 2), 0)
    assert RSS.for_state(("x", "y")).amplitude is None
    with pytest.raises(ValueError, match=r"must be different entries; got \(0, 1\), 0"):
        RSS.replace(amplitude=0).h([1.0, 2.0, 3.0])


def test_entries_are_selected_from_a_longer_state() -> None:
    names = ("x", "amplitude_im", "doa", "amplitude_re")
    model = SNAPSHOT.for_state(names)
    x = np.array([9.0, 0.3, 0.2, 1.0])
    own = np.array([0.2, 1.0, 0.3])
    np.testing.assert_array_equal(model.h([x, x]), SNAPSHOT.h([own, own]))
    H = model.H(x)
    np.testing.assert_array_equal(H[:, [2, 3, 1]], SNAPSHOT.H(own))
    assert not H[:, 0].any()
    assert (model.dim_z, model.needs, model.is_linear) == (6, SNAPSHOT.needs, False)
    np.testing.assert_array_equal(model.R, SNAPSHOT.R)
    rng, other = np.random.default_rng(0), np.random.default_rng(0)
    np.testing.assert_array_equal(model.sample(x, rng), SNAPSHOT.sample(own, other))
    assert model.for_state(names) is model
    assert model.for_state(SNAPSHOT.needs) is SNAPSHOT
    assert pickle.loads(pickle.dumps(model)) == model


def test_model_with_entries_in_order_is_returned_unchanged() -> None:
    assert DELAY.for_state(DelayDrift().state_names) is DELAY
    assert PHASOR.for_state(("delay", "delay_rate", "amplitude_re", "amplitude_im")) is PHASOR
    moved = PHASOR.for_state(("amplitude_re", "amplitude_im", "delay"))
    np.testing.assert_array_equal(moved.h([1.0, 0.0, 0.5]), PHASOR.h([0.5, 1.0, 0.0]))


@dataclass(frozen=True, eq=False)
class Range(MeasurementModel):
    """Slant range, with R as a field and dim_z as a class attribute."""

    R: Float
    dim_z = 1

    def h(self, x: ArrayLike) -> Float:
        x = np.asarray(x, dtype=np.float64)
        return np.asarray(np.hypot(x[..., 0], x[..., 1])[..., None])

    def H(self, x: ArrayLike) -> Float:
        x = np.asarray(x, dtype=np.float64)
        return np.asarray(x[None] / np.hypot(*x))


@dataclass(frozen=True)
class Walk(MotionModel):
    """Two coordinates, with dim_x as a field."""

    dim_x: int

    def f(self, x: ArrayLike, dt: float = 1.0) -> Float:
        return np.asarray(x, dtype=np.float64)

    def F(self, x: ArrayLike, dt: float = 1.0) -> Float:
        return np.eye(self.dim_x)

    def Q(self, dt: float = 1.0) -> Float:
        return dt * np.eye(self.dim_x)


def test_dataclass_fields_implement_r_dim_z_dim_x() -> None:
    near, walk = Range(np.array([[0.01]])), Walk(2)
    ekf = EKF(walk, near, [3.0, 4.0], np.eye(2))
    for _ in range(5):
        ekf.predict()
        ekf.update([10.0])
    assert np.hypot(*ekf.x) == pytest.approx(10.0, abs=0.1)
    assert walk.replace(dim_x=3) == Walk(3)
    assert pickle.loads(pickle.dumps(near)).R == 0.01


def test_model_without_r_or_dim_z_is_refused() -> None:
    class NoNoise(MeasurementModel):
        dim_z = 1

        def h(self, x: ArrayLike) -> Float:
            return np.asarray(x)

        def H(self, x: ArrayLike) -> Float:
            return np.eye(1)

    with pytest.raises(TypeError, match=r"abstract class NoNoise .*R"):
        NoNoise()  # type: ignore[abstract]

    class Declared(NoNoise):  # annotated, but not a dataclass
        R: Float

    with pytest.raises(AttributeError, match="Declared declares R without a value"):
        _ = Declared().R
