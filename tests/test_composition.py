"""Models made of other models: combined motions and measurements, models from functions."""

import pickle
from typing import Any

import numpy as np
import pytest
from sklearn.base import clone

from arrivals.differentiation import numerical_jacobian
from arrivals.measurement_models import (
    ArraySnapshot,
    Bearing,
    CombinedMeasurement,
    FunctionMeasurement,
    LinearMeasurement,
    LogNormalRSS,
    SensorArray,
    composite,
    db_to_neper,
)
from arrivals.motion_models import (
    CombinedMotion,
    ConstantVelocity,
    CoordinatedTurn,
    DelayWalk,
    DirectionAmplitudeWalk,
    FunctionMotion,
    LinearMotion,
    RandomWalk,
    VonMisesWalk,
)
from arrivals.trackers import EKF, IMM, Kalman, Particle
from arrivals.typing import Float

STATIONS = [[-40.0, -50.0], [45.0, -50.0]]
RING = 40.0 * np.exp(2j * np.pi * np.arange(8) / 8)
SENSORS = np.column_stack([RING.real, RING.imag])
BEARINGS = Bearing(STATIONS, noise=np.deg2rad(3.0) ** 2)
RSS = LogNormalRSS(SENSORS, sigma=float(db_to_neper(3.0)), log_noise=float(db_to_neper(-40.0)))
SNAPSHOT = ArraySnapshot(SensorArray.ula(6, spacing=0.5), wavelength=1.0, noise=0.1)
LOUDNESS = LinearMotion([[1.0]], [[1e-4]], names=["log_amplitude"])

# -- motions -----------------------------------------------------------------------------------


def test_combined_motion_joins_names_angles_and_matrices_of_its_parts() -> None:
    walk = VonMisesWalk(50.0)
    three = CombinedMotion(ConstantVelocity(0.1), walk, DelayWalk(1e-3))
    assert three.state_names == ("x", "vx", "y", "vy", "doa", "delay")
    assert three.angles == (4,)
    nested = CombinedMotion(DelayWalk(), LinearMotion([[1]], [[1]]))
    assert CombinedMotion(walk, nested).angles == (0,)
    assert (three.dim_x, three.is_linear) == (6, False)
    assert CombinedMotion(RandomWalk(0.1), LOUDNESS).is_linear
    x = np.array([1.0, 2.0, 3.0, 4.0, 3.5, 0.1])
    np.testing.assert_allclose(three.f(x), [3.0, 2.0, 7.0, 4.0, 3.5 - 2 * np.pi, 0.1])
    np.testing.assert_allclose(three.F(x) @ x, [3.0, 2.0, 7.0, 4.0, 3.5, 0.1])
    assert three.Q().shape == (6, 6)
    drawn = three.sample(np.tile(x, (4000, 1)), np.random.default_rng(0))
    assert np.abs(drawn[:, 4]).max() <= np.pi
    assert drawn[:, 0].var() == pytest.approx(three.Q()[0, 0], rel=0.1)


def test_combined_motion_keeps_its_parameters() -> None:
    three = CombinedMotion(ConstantVelocity(0.1), VonMisesWalk(50.0), DelayWalk(1e-3))
    assert three == CombinedMotion(
        ConstantVelocity(0.1), CombinedMotion(VonMisesWalk(50.0), DelayWalk(1e-3))
    )
    assert pickle.loads(pickle.dumps(three)) == three == clone(three)
    assert CombinedMotion.from_dict(three.to_dict()) == three
    assert three.replace(second__second__q=0.5).get_params()["second__second__q"] == 0.5


def test_combined_motion_refuses_two_entries_of_one_name() -> None:
    walk = RandomWalk(0.1)
    with pytest.raises(ValueError, match="got 'x' in both: pass names for all entries"):
        CombinedMotion(walk, walk)
    assert CombinedMotion(walk, walk, names=()).state_names == ()
    assert CombinedMotion(walk, walk, walk, names=list("abcdef")).state_names == tuple("abcdef")
    with pytest.raises(ValueError, match="names must be 4 different strings"):
        CombinedMotion(walk, walk, names=["x", "y"])
    with pytest.raises(TypeError, match="second must be a MotionModel"):
        CombinedMotion(walk, None)  # type: ignore[arg-type]


@pytest.mark.parametrize("place", [0, 1, 4])
def test_imm_averages_the_angle_of_a_combined_state_on_the_circle(place: int) -> None:
    """At +-(pi - 0.05) the mean is +-pi, at any position in the state; filterpy has 0."""
    walk, others = VonMisesWalk(100.0), (RandomWalk(0.1, 1), ConstantVelocity(0.1))
    parts = {0: (walk, others[0]), 1: (others[0], walk), 4: (others[1], walk, DelayWalk(0.1))}
    motion = CombinedMotion(*parts[place])
    n = motion.dim_x
    compass = LinearMeasurement(np.eye(n)[place : place + 1], [[0.1]])
    members = []
    for side in (1, -1):
        x = np.zeros(n)
        x[place] = side * (np.pi - 0.05)
        members.append(EKF(motion, compass, x, 0.01 * np.eye(n)))
    imm = IMM(members, [0.5, 0.5], [[0.5, 0.5], [0.5, 0.5]])
    assert abs(imm.x[place]) == pytest.approx(np.pi)
    imm.predict()
    assert abs(imm.x[place]) == pytest.approx(np.pi)
    assert imm.P[place, place] < 0.1


def test_direction_and_amplitude_are_tracked_from_snapshots() -> None:
    walk = DirectionAmplitudeWalk(VonMisesWalk(2000.0), amplitude_noise=0.02)
    rng = np.random.default_rng(3)
    x, z, truth = np.array([0.2, 1.0, 0.5]), [], []
    for _ in range(60):
        x = walk.sample(x, rng)
        truth.append(x)
        z.append(SNAPSHOT.sample(x, rng))
    z[10] = np.full(12, np.nan)
    z[20][[0, 6]] = np.nan  # one sensor
    start, P = truth[0], np.diag([0.01, 0.1, 0.1])
    for tracker in (EKF(walk, SNAPSHOT, start, P), Particle(walk, SNAPSHOT, start, P, 2000, rng=1)):
        run = tracker.run(np.array(z))
        error = run.x - np.array(truth)
        assert np.sqrt((error[:, 0] ** 2).mean()) < 0.05
        assert np.sqrt((error[:, 1:] ** 2).mean()) < 0.25


def test_particle_filter_weights_of_complex_and_composite_snapshots_are_equal() -> None:
    walk = DirectionAmplitudeWalk(VonMisesWalk(500.0), amplitude_noise=0.02)
    z = SNAPSHOT.simulate([0.3], [1.0 + 0.5j], np.random.default_rng(0))
    for motion, x in ((walk, [0.2, 1.0, 0.5]), (VonMisesWalk(500.0), [0.2])):
        result = []
        for measured in (z, composite(z)):
            tracker = Particle(motion, SNAPSHOT, x, 0.1 * np.eye(len(x)), 200, rng=1)
            tracker.update(measured)
            result.append(tracker.log_likelihood)
        assert result[0] == pytest.approx(result[1], abs=1e-9)


def test_known_amplitudes_give_the_density_of_gaussian_noise() -> None:
    z = SNAPSHOT.simulate([0.3, -0.2], [1.0, 1j], np.random.default_rng(0))
    at = [[0.3, -0.2], [0.31, -0.2]]
    got = SNAPSHOT.log_likelihood(z, at, [[1.0, 1j], [1.0, 1j]])
    e = z - np.array([1.0, 1j]) @ SNAPSHOT.steering_vector(at)
    expected = -6 * np.log(np.pi * 0.1) - (np.abs(e) ** 2).sum(axis=-1) / 0.1
    np.testing.assert_allclose(got, expected)


# -- measurements ------------------------------------------------------------------------------


def test_combined_measurement_stacks_its_parts() -> None:
    both = CombinedMeasurement(BEARINGS, RSS, SNAPSHOT)
    names = ("x", "vx", "y", "vy", "doa", "amplitude_re", "amplitude_im")
    assert both.needs == ("x", "y", "doa", "amplitude_re", "amplitude_im")
    assert (both.dim_z, both.is_linear) == (2 + 8 + 12, False)
    model = both.for_state(names)
    assert model.for_state(names) is model
    x = np.array([3.0, 0.1, 4.0, 0.2, 0.3, 1.0, 0.5])
    parts = [BEARINGS.h(x[[0, 2]]), RSS.h(x[[0, 2]]), SNAPSHOT.h(x[4:])]
    np.testing.assert_allclose(model.h(x), np.concatenate(parts))
    np.testing.assert_allclose(model.h([x, x])[1], model.h(x))
    np.testing.assert_allclose(model.H(x), numerical_jacobian(model.h, x), atol=1e-7)
    turned = model.residual([3.1, *np.zeros(21)], [-3.1, *np.zeros(21)])
    assert turned[0] == pytest.approx(6.2 - 2 * np.pi)
    np.testing.assert_array_equal(model.R[2:10, 2:10], RSS.R)
    drawn = model.sample(np.tile(x, (4000, 1)), np.random.default_rng(0))
    np.testing.assert_allclose(drawn.mean(axis=0), model.h(x), atol=0.05)
    assert pickle.loads(pickle.dumps(both)) == both == clone(both)
    with pytest.raises(TypeError, match=r"ArraySnapshot needs 'doa'; got 'x', 'y'$"):
        both.for_state(("x", "y"))


def test_stack_takes_one_measurement_of_each_part() -> None:
    both = CombinedMeasurement(BEARINGS, SNAPSHOT)
    z = both.stack([0.1, np.nan], np.arange(6) * 1j)
    np.testing.assert_array_equal(z, [0.1, np.nan, *np.zeros(6), *np.arange(6)])
    assert np.isnan(both.stack(None, None)).all()
    with pytest.raises(ValueError, match="stack must get 2 measurements, one of each part; got 1"):
        both.stack([0.1, 0.2])
    with pytest.raises(ValueError, match="a measurement of Bearing must have 2 entries; got 3"):
        both.stack([0.1, 0.2, 0.3], None)


def test_a_missing_part_leaves_the_others_in_use() -> None:
    both, walk, P = CombinedMeasurement(BEARINGS, RSS), ConstantVelocity(0.01), np.eye(4)
    x = np.array([3.0, 0.0, 4.0, 0.0])
    bearing, readings = BEARINGS.h(x) + 0.01, RSS.h(x) - 0.05
    for z, model, part in ((both.stack(bearing, None), BEARINGS, bearing),
                           (both.stack(None, readings), RSS, readings)):  # fmt: skip
        together, alone = (EKF(walk, each, x + 0.5, P) for each in (both, model))
        together.update(z)
        alone.update(part)
        np.testing.assert_allclose(together.x, alone.x, atol=1e-12)
        np.testing.assert_allclose(together.P, alone.P, atol=1e-12)
        assert together.log_likelihood == pytest.approx(alone.log_likelihood)


def test_log_likelihood_is_the_sum_over_the_parts() -> None:
    walk = CombinedMotion(RandomWalk(0.1), VonMisesWalk(100.0))
    both = CombinedMeasurement(BEARINGS, SNAPSHOT).for_likelihood(walk.state_names)
    x = np.array([[3.0, 4.0, 0.3], [2.0, 4.0, 0.2]])
    z = SNAPSHOT.simulate([0.3], [1.0], np.random.default_rng(0))
    bearing = BEARINGS.h(x[0, :2]) + 0.01
    assert isinstance(both, CombinedMeasurement)
    whole = both.log_likelihood(both.stack(bearing, z), x)
    snapshots = both.log_likelihood(both.stack(None, z), x)
    np.testing.assert_allclose(snapshots, SNAPSHOT.log_likelihood(z, x[:, 2:]))
    var = np.deg2rad(3.0) ** 2
    y = BEARINGS.residual(bearing, BEARINGS.h(x[:, :2]))
    gaussian = -0.5 * (y**2).sum(axis=-1) / var - np.log(2 * np.pi * var)
    np.testing.assert_allclose(whole, snapshots + gaussian)
    np.testing.assert_array_equal(both.log_likelihood(np.full(14, np.nan), x), [0.0, 0.0])


def run_errors(model: Any, names: slice, seed: int) -> float:
    """Return the RMS position error of an EKF on some measurements of one moving emitter."""
    rng, x = np.random.default_rng(seed), np.array([-20.0, 0.8, -5.0, 0.4, 2.0])
    walk = CombinedMotion(ConstantVelocity(0.02), LOUDNESS)
    both, truth, z = CombinedMeasurement(BEARINGS, RSS).for_state(walk.state_names), [], []
    start = x + rng.standard_normal(5) * [5.0, 0.3, 5.0, 0.3, 0.3]
    for _ in range(50):
        x = walk.sample(x, rng)
        truth.append(x)
        z.append(both.sample(x, rng))
    tracker = EKF(walk, model, start, np.diag([25.0, 0.1, 25.0, 0.1, 0.1]))
    error = tracker.run(np.array(z)[:, names]).x[10:] - np.array(truth)[10:]
    return float(np.sqrt((error[:, [0, 2]] ** 2).sum(axis=-1).mean()))


def test_bearings_and_signal_strength_together_are_better_than_either_alone() -> None:
    """Paired over 20 runs; m: 2.50, bearings 2.95 (gain 0.45 +- 0.12), RSS 3.73 (1.23 +- 0.21)."""
    seeds = range(20)
    both = np.array([run_errors(CombinedMeasurement(BEARINGS, RSS), slice(None), s) for s in seeds])
    bearings = np.array([run_errors(BEARINGS, slice(2), s) for s in seeds])
    strength = np.array([run_errors(RSS, slice(2, None), s) for s in seeds])
    for alone in (bearings, strength):
        gain = alone - both
        assert gain.mean() > 3 * gain.std(ddof=1) / np.sqrt(len(gain))


# -- functions ---------------------------------------------------------------------------------


def range_of(x: Float) -> Any:
    return np.hypot(x[0], x[1])


def ranges(x: Float) -> Float:
    return np.asarray(np.hypot(x[..., :1], x[..., 1:2]))


def turning(x: Float, dt: float) -> list[float]:
    return [x[0] + dt * x[1], x[1]]


def turning_all(x: Float, dt: float) -> Float:
    return np.stack([x[..., 0] + dt * x[..., 1], x[..., 1]], axis=-1)


def test_numerical_jacobian_equals_that_of_the_models() -> None:
    turn, x = CoordinatedTurn(0.1, 0.1), np.array([1e4, 3.0, -2e3, -1.0, 0.4])
    motion = FunctionMotion(turn.f, Q=turn.Q, vectorized=True)
    np.testing.assert_allclose(motion.F(x, 0.5), turn.F(x, 0.5), rtol=1e-6, atol=1e-6)
    np.testing.assert_array_equal(motion.Q(0.5), turn.Q(0.5))
    seen = FunctionMeasurement(BEARINGS.h, R=BEARINGS.R, residual=BEARINGS.residual)
    for place in ([30.0, 20.0], [-41.0, -50.0]):  # the second is where a bearing wraps
        np.testing.assert_allclose(seen.H(place), BEARINGS.H(place), rtol=1e-6, atol=1e-8)


def test_functions_of_one_state_and_of_many_are_equal() -> None:
    one = FunctionMotion(turning, Q=np.eye(2), names=["angle", "rate"], angles=[0])
    many = FunctionMotion(turning_all, Q=np.eye(2), vectorized=True)
    x = np.random.default_rng(0).standard_normal((3, 4, 2))
    np.testing.assert_array_equal(one.f(x, 0.5), many.f(x, 0.5))
    near = FunctionMeasurement(range_of, R=0.04, needs=["x", "y"])
    far = FunctionMeasurement(ranges, R=[[0.04]], vectorized=True)
    np.testing.assert_array_equal(near.h(x), far.h(x))
    assert near.h(x).shape == (3, 4, 1)
    assert (one.dim_x, one.state_names, one.angles) == (2, ("angle", "rate"), (0,))
    for model in (one, many, near, far):
        again = pickle.loads(pickle.dumps(model))
        assert str(again.get_params()) == str(model.get_params())
        assert type(clone(model)) is type(model)
    assert one.replace(angles=()).angles == ()


def test_function_measurement_runs_in_a_filter_with_named_entries() -> None:
    def distance(station: list[float]) -> FunctionMeasurement:
        return FunctionMeasurement(lambda x: np.hypot(*(x - station)), R=0.01, needs=["x", "y"])

    stations = [[0.0, 0.0], [50.0, 0.0], [0.0, 50.0]]
    model = CombinedMeasurement(*map(distance, stations))
    tracker = EKF(ConstantVelocity(0.01), model, [20.0, 0, 20.0, 0], np.eye(4))
    for _ in range(5):
        tracker.predict()
        tracker.update(np.hypot(*(np.array([21.0, 19.0]) - stations).T))
    np.testing.assert_allclose(tracker.x[[0, 2]], [21.0, 19.0], atol=0.1)


@pytest.mark.parametrize(
    ("call", "error", "message"),
    [
        (lambda: FunctionMotion(3, Q=np.eye(2)), TypeError, "f must be a function; got int"),  # type: ignore[arg-type]
        (lambda: FunctionMotion(turning, Q=[[1.0, 2.0]]), ValueError, "Q must have shape"),
        (lambda: FunctionMotion(turning, Q=np.eye(2), angles=[2]), ValueError, "entries below 2"),
        (lambda: FunctionMotion(turning, Q=np.eye(2)).Q(0.5), ValueError, "pass a function Q"),
        (lambda: FunctionMotion(turning, Q=np.eye(3)).f(np.ones(3)), ValueError, r"f\(x, dt\)"),
        (lambda: FunctionMeasurement(None, R=1.0), TypeError, "h must be a function"),  # type: ignore[arg-type]
        (lambda: FunctionMeasurement(range_of, R=-1.0), ValueError, "R must have no negative"),
        (lambda: FunctionMeasurement(range_of, R=np.eye(2)).h([1, 2]), ValueError, r"h\(x\) must"),
        (lambda: CombinedMeasurement(BEARINGS, 3), TypeError, "second must be a Measurement"),  # type: ignore[arg-type]
        (lambda: DirectionAmplitudeWalk(3, 0.1), TypeError, "direction must be a VonMisesWalk"),  # type: ignore[arg-type]
        (lambda: DirectionAmplitudeWalk(VonMisesWalk(9.0), -1), ValueError, "amplitude_noise must"),
    ],
)  # fmt: skip
def test_invalid_arguments_are_refused(call: Any, error: type[Exception], message: str) -> None:
    with pytest.raises(error, match=message):
        call()


def test_combination_of_linear_parts_is_linear() -> None:
    walk = CombinedMotion(RandomWalk(0.1), LOUDNESS)
    matrix = LinearMeasurement(np.eye(3)[:1], [[1.0]])
    tracker = Kalman(walk, CombinedMeasurement(matrix, matrix), np.zeros(3), np.eye(3))
    tracker.update([1.0, 2.0])
    assert tracker.x[0] == pytest.approx(1.0)
