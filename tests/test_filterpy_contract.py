"""The contract with filterpy 2.0.0, D1 to D13, and the faults of filterpy that we do not share."""

import copy
import pickle
import subprocess
import sys
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from filterpy.common import Saver
from filterpy.kalman import (
    CubatureKalmanFilter,
    EnsembleKalmanFilter,
    ExtendedKalmanFilter,
    IMMEstimator,
    KalmanFilter,
    MerweScaledSigmaPoints,
    MMAEFilterBank,
    UnscentedKalmanFilter,
)
from filterpy.monte_carlo import systematic_resample as their_resample

from arrivals.measurement_models import Bearing, LinearMeasurement, MeasurementModel
from arrivals.motion_models import (
    ConstantVelocity,
    CoordinatedTurn,
    LinearMotion,
    MotionModel,
    RandomWalk,
    VonMisesWalk,
)
from arrivals.trackers import EKF, IMM, UKF, Filter, Kalman, KalmanType, Particle, as_filterpy
from arrivals.trackers.particle import systematic_resample
from arrivals.typing import Float

PLACES = [[0.0, 0.0], [20.0, 0.0], [5.0, 15.0]]
X = np.array([8.0, 0.3, 6.0, -0.2])
P = np.diag([1.0, 0.1, 1.0, 0.1])
WALK = ConstantVelocity(q=0.05)
BEARING = Bearing(PLACES, noise=1e-3)
SEEN = LinearMeasurement(np.eye(4)[::2], [[0.5, 0.1], [0.1, 0.3]])
M = np.array([[0.9, 0.1], [0.2, 0.8]])


def stable_system(rng: np.random.Generator, n: int, m: int) -> tuple[Float, ...]:
    F = rng.normal(size=(n, n))
    F *= 0.95 / np.abs(np.linalg.eigvals(F)).max()
    B, H = rng.normal(size=(n, 1)), rng.normal(size=(m, n))
    A, C, D = rng.normal(size=(n, n)), rng.normal(size=(m, m)), rng.normal(size=(n, n))
    return F, B, H, A @ A.T + 0.1 * np.eye(n), C @ C.T + 0.1 * np.eye(m), D @ D.T


def twins(seed: int, n: int = 3, m: int = 2, column: bool = False) -> tuple[Kalman, Any]:
    rng = np.random.default_rng(seed)
    F, B, H, Q, R, P0 = stable_system(rng, n, m)
    x = rng.normal(size=(n, 1) if column else n)
    kf = KalmanFilter(n, m, 1)
    kf.x, kf.P, kf.F, kf.B, kf.H, kf.Q, kf.R = x, P0, F, B, H, Q, R
    return Kalman(LinearMotion(F, Q, control=B), LinearMeasurement(H, R), x, P0), kf


def assert_twins(ours: Any, theirs: Any, tolerance: float = 1e-12, names: str = "x P") -> None:
    for name in names.split():
        a, b = getattr(ours, name), getattr(theirs, name)
        assert np.shape(a) == np.shape(b), name
        np.testing.assert_allclose(a, b, rtol=tolerance, atol=tolerance, err_msg=name)


def plain(q: float = 0.05, kind: type[KalmanType] = Kalman) -> KalmanType:
    return kind(ConstantVelocity(q), SEEN, X, P)


def theirs(q: float = 0.05, column: bool = False) -> Any:
    kf = KalmanFilter(4, 2)
    kf.x, kf.P = X.reshape(4, 1) if column else X, P
    walk = ConstantVelocity(q)
    kf.F, kf.Q, kf.H, kf.R = walk.F(), walk.Q(), SEEN.H(), SEEN.R
    return kf


def track(n: int = 12, seed: int = 0) -> Float:
    return np.random.default_rng(seed).normal([8.0, 6.0], 1.0, (n, 2))


# D1


@pytest.mark.parametrize("shape", [(3,), (3, 1)])
def test_d1_belief_may_be_assigned_between_any_two_calls(shape: tuple[int, ...]) -> None:
    tracker, kf = twins(0, column=len(shape) == 2)
    for z in np.ones((3, 2)):
        for step in ("predict", "update"):
            for f in (tracker, kf):
                f.x, f.P = np.full(shape, 2.0), 3 * np.eye(3)
                getattr(f, step)(*([] if step == "predict" else [z.reshape(2, *shape[1:])]))
        assert_twins(tracker, kf)
        assert tracker.x.shape == shape


@pytest.mark.parametrize("kind", [Kalman, EKF, UKF])
def test_d1_x_keeps_the_axes_it_is_given_later(kind: type[KalmanType]) -> None:
    tracker = plain(kind=kind)
    tracker.x = X.reshape(4, 1)
    tracker.predict()
    tracker.update([8.0, 6.0])
    assert tracker.x.shape == (4, 1)
    assert tracker.y.shape == tracker.z.shape == (2, 1)


# D2


def test_d2_predict_takes_the_control_first_and_none_or_zero_for_none() -> None:
    tracker, kf = twins(1)
    for u in (None, 0, 0.0, [0.0], [1.5], 2.0):
        tracker.predict(u)
        kf.predict(np.zeros(1) if u is None else np.atleast_1d(u))
        assert_twins(tracker, kf, names="x P x_prior P_prior")
    with pytest.raises(TypeError):
        tracker.predict(None, 0.5)  # type: ignore[call-arg]


# D3


def test_d3_update_takes_every_shape_of_measurement() -> None:
    for z in ([1.0, 2.0], (1, 2), np.array([1.0, 2.0]), np.array([[1.0], [2.0]])):
        tracker = plain()
        tracker.update(z)
        assert tracker.z.tolist() == [1.0, 2.0]
    scalars: list[Any] = [3.0, 3, [3.0], [[3.0]], np.float32(3)]
    for scalar in scalars:
        one = Kalman(RandomWalk(1.0, 1), LinearMeasurement([[1.0]], [[1.0]]), [0.0], [[1.0]])
        one.update(scalar)
        assert one.x == 1.5


@pytest.mark.parametrize("kind", [Kalman, EKF, UKF])
def test_d3_update_takes_r_and_h_for_once(kind: type[KalmanType]) -> None:
    tracker, kf = plain(kind=kind), theirs()
    H = np.array([[0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]])
    for R, once in ((2.0, None), (np.diag([1.0, 4.0]), None), (None, H), (0.5, H)):
        tracker.update([0.2, 0.1], R, once)
        kf.update(np.array([0.2, 0.1]), R, once)
        assert_twins(tracker, kf, 1e-12 if kind is Kalman else 1e-9)
    tracker.update([1.0], R=1.0, H=H[:1])
    assert tracker.S.shape == (1, 1)


# D4


@pytest.mark.parametrize("column", [False, True])
@pytest.mark.parametrize("missing", [None, np.nan, [np.nan, np.nan]])
def test_d4_missed_measurement(column: bool, missing: Any) -> None:
    tracker, _ = twins(2, column=column)
    tracker.update(np.ones(2))
    tracker.predict()
    x, P = tracker.x.copy(), tracker.P.copy()
    tracker.update(missing)
    np.testing.assert_array_equal(tracker.x_post, x)
    np.testing.assert_array_equal(tracker.P_post, P)
    shape = (2, 1) if column else (2,)
    assert tracker.y.shape == tracker.z.shape == shape
    assert not tracker.y.any()
    assert np.isnan(tracker.z).all()
    assert (tracker.log_likelihood, tracker.likelihood) == (0.0, 1.0)


# D5

NAMES = [
    "x",
    "P",
    "x_prior",
    "P_prior",
    "x_post",
    "P_post",
    "z",
    "y",
    "S",
    "SI",
    "K",
    "F",
    "Q",
    "H",
    "R",
    "B",
    "inv",
    "dim_x",
    "dim_z",
    "dim_u",
    "likelihood",
    "log_likelihood",
    "mahalanobis",
]


@pytest.mark.parametrize("column", [False, True])
@pytest.mark.parametrize("kind", [Kalman, EKF, UKF])
def test_d5_attributes_have_their_final_shapes_from_the_start(
    kind: type[KalmanType], column: bool
) -> None:
    tracker = kind(WALK, SEEN, X.reshape(4, 1) if column else X, P)
    shapes = {name: np.shape(getattr(tracker, name)) for name in NAMES}
    for z in (None, [8.0, 6.0], [8.0, np.nan]):
        tracker.predict()
        tracker.update(z)
        assert {name: np.shape(getattr(tracker, name)) for name in NAMES} == shapes
    assert shapes["y"] == ((2, 1) if column else (2,))
    assert shapes["K"] == (4, 2)


def test_d5_likelihood_never_falls_to_zero() -> None:
    tracker = plain()
    tracker.update([1e6, 1e6])
    assert tracker.likelihood == sys.float_info.min
    assert tracker.log_likelihood < -1e9


def test_d5_nonlinear_filters_publish_the_present_jacobians() -> None:
    tracker = EKF(CoordinatedTurn(0.1, 0.1), BEARING, [*X, 0.1], np.eye(5))
    tracker.predict(dt=0.5)
    np.testing.assert_array_equal(tracker.F, tracker.motion.F(tracker.x, 0.5))
    np.testing.assert_array_equal(tracker.H, BEARING.H(tracker.x))


# D6


@pytest.mark.parametrize("column", [False, True])
@pytest.mark.parametrize("kind", [Kalman, EKF, UKF])
def test_d6_saver_makes_arrays(kind: type[KalmanType], column: bool) -> None:
    tracker = kind(WALK, SEEN, X.reshape(4, 1) if column else X, P)
    saver = Saver(tracker, save_current=True)
    for z in (*track(3), None, [1.0, np.nan]):
        tracker.predict()
        tracker.update(z)
        saver.save()
    saver.to_array()
    assert saver.x.shape == (6, *tracker.x.shape)
    assert saver.K.shape == (6, 4, 2)
    assert saver.log_likelihood.shape == (6,)
    assert {"F", "Q", "H", "R"} <= set(saver.keys)


def test_d6_saver_takes_imm_and_particle() -> None:
    for tracker in (
        IMM([plain(), plain(1.0)], [0.5, 0.5], M),
        Particle(WALK, SEEN, X, P, n_particles=20, rng=0),
    ):
        saver = Saver(tracker, save_current=True)
        for z in track(3):
            tracker.predict()
            tracker.update(z)
            saver.save()
        saver.to_array()
        assert saver.x.shape == (4, 4)


# D7


@pytest.mark.parametrize("mixed", [False, True])
def test_d7_works_inside_their_imm(mixed: bool) -> None:
    bank = IMMEstimator([plain(), theirs(2.0) if mixed else plain(2.0)], [0.5, 0.5], M)
    right = IMMEstimator([theirs(), theirs(2.0)], [0.5, 0.5], M)
    for z in track():
        for f in (bank, right):
            f.predict()
            f.update(z)
        assert_twins(bank, right, names="x P mu")


@pytest.mark.parametrize("mixed", [False, True])
def test_d7_works_inside_their_mmae(mixed: bool) -> None:
    bank = MMAEFilterBank([plain(), theirs(2.0) if mixed else plain(2.0)], [0.5, 0.5], 4)
    right = MMAEFilterBank([theirs(), theirs(2.0)], [0.5, 0.5], 4)
    for z in track():
        for f in (bank, right):
            f.predict()
            f.update(z)
        assert_twins(bank, right, names="x P p")


# D8


def ready(made: Any, motion: MotionModel, measurement: MeasurementModel, x: Float, P: Float) -> Any:
    made.x, made.P, made.Q, made.R = x.copy(), P.copy(), motion.Q(), measurement.R
    return made


def test_d8_models_in_their_ekf() -> None:
    ekf = ready(ExtendedKalmanFilter(4, 3), WALK, BEARING, X, P)
    ekf.F = WALK.F()
    tracker = EKF(WALK, BEARING, X, P)
    for seed in range(10):
        z = BEARING.sample(X, np.random.default_rng(seed))
        ekf.predict()
        ekf.update(z, BEARING.H, BEARING.h, residual=BEARING.residual)
        tracker.predict()
        tracker.update(z)
        assert_twins(tracker, ekf, 1e-12, "x P K S y log_likelihood mahalanobis")


@pytest.mark.parametrize(
    ("motion", "x"), [(WALK, X), (CoordinatedTurn(0.05, 0.01), np.array([*X, 0.05]))]
)
def test_d8_models_in_their_ukf(motion: MotionModel, x: Float) -> None:
    points = MerweScaledSigmaPoints(len(x), alpha=0.5, beta=2.0, kappa=0.0)
    made = UnscentedKalmanFilter(len(x), 3, 1.0, BEARING.h, motion.f, points)
    ukf = ready(made, motion, BEARING, x, np.eye(len(x)) * 0.1)
    tracker = UKF(motion, BEARING, x, np.eye(len(x)) * 0.1)
    for seed in range(10):
        z = BEARING.sample(x, np.random.default_rng(seed))
        ukf.predict()
        ukf.update(z)
        tracker.predict()
        tracker.update(z)
        assert_twins(tracker, ukf, 1e-9, "x P K S y log_likelihood")


def test_d8_models_in_their_ckf() -> None:
    made = CubatureKalmanFilter(4, 3, 1.0, BEARING.h, WALK.f)
    ckf, tracker = ready(made, WALK, BEARING, X, P), EKF(WALK, BEARING, X, P)
    for seed in range(5):
        z = BEARING.sample(X, np.random.default_rng(seed))
        ckf.predict()
        ckf.update(z[:, None])  # it wants columns
        tracker.predict()
        tracker.update(z)
    np.testing.assert_allclose(ckf.x.ravel(), tracker.x, atol=0.1)


def test_d8_models_in_their_enkf() -> None:
    np.random.seed(0)  # noqa: NPY002  # filterpy draws from the global generator
    made = EnsembleKalmanFilter(X, P, 3, 1.0, 500, BEARING.h, WALK.f)
    made.Q, made.R = WALK.Q(), BEARING.R
    tracker = EKF(WALK, BEARING, X, P)
    for seed in range(5):
        for f in (made, tracker):
            f.predict()
            f.update(BEARING.sample(X, np.random.default_rng(seed)))
    np.testing.assert_allclose(made.x, tracker.x, atol=0.3)


def test_d8_arguments_are_not_modified_and_columns_are_refused_with_the_cure() -> None:
    x = X.copy()
    for call in (WALK.f, WALK.F, BEARING.h, BEARING.H, SEEN.h, SEEN.H):
        call(x)
        np.testing.assert_array_equal(x, X)
    for refuses in (WALK.f, BEARING.h, BEARING.H, SEEN.h):
        with pytest.raises(ValueError, match=r"column \(4, 1\): pass x.ravel\(\)"):
            refuses(X.reshape(4, 1))


@pytest.mark.parametrize("kind", ["ekf", "ukf", "ckf", "enkf"])
def test_d8_as_filterpy_is_ready_to_run(kind: Any) -> None:
    np.random.seed(1)  # noqa: NPY002
    f = as_filterpy(WALK, BEARING, kind, x=X, P=P, n_members=400)
    tracker = EKF(WALK, BEARING, X, P)
    for seed in range(5):
        z = BEARING.sample(X, np.random.default_rng(seed))
        for each in (f, tracker):
            each.predict()
            each.update(z)
    tolerance = 1e-12 if kind == "ekf" else 0.3
    np.testing.assert_allclose(np.ravel(f.x), tracker.x, atol=tolerance)
    again = copy.deepcopy(f)
    again.update(z)
    np.testing.assert_allclose(np.ravel(f.x), tracker.x, atol=tolerance)


def test_d8_as_filterpy_makes_their_kalman_filter() -> None:
    kf = as_filterpy(WALK, SEEN, "kf", x=X, P=P, dt=0.5)
    tracker = plain()
    for z in track():
        kf.predict()
        kf.update(z)
        tracker.predict(dt=0.5)
        tracker.update(z)
    assert_twins(tracker, kf)


def test_d8_as_filterpy_ekf_follows_a_turn() -> None:
    turn = CoordinatedTurn(0.05, 0.01)
    ekf = as_filterpy(turn, BEARING, "ekf", x=[*X, 0.3], P=np.eye(5))
    tracker = EKF(turn, BEARING, [*X, 0.3], np.eye(5))
    ekf = pickle.loads(pickle.dumps(ekf))
    for f in (ekf, tracker):
        f.predict()
        f.update([0.6, 2.7, -1.2])
    assert_twins(tracker, ekf, names="x P")


# D9


@pytest.mark.parametrize("column", [False, True])
@pytest.mark.parametrize("update_first", [False, True])
def test_d9_batch_filter_and_smoother_are_filterpys(column: bool, update_first: bool) -> None:
    tracker, kf = twins(3, column=column)
    rng = np.random.default_rng(5)
    zs: list[Any] = list(rng.normal(size=(8, 2, 1) if column else (8, 2)))
    zs[3] = None
    systems = [stable_system(rng, 3, 2) for _ in zs]
    Fs, Bs, Hs, Qs, Rs, _ = (list(matrices) for matrices in zip(*systems, strict=True))
    us = list(rng.normal(size=(8, 1, 1) if column else (8, 1)))
    given: dict[str, Any] = {"Fs": Fs, "Qs": Qs, "Hs": Hs, "Rs": Rs, "Bs": Bs, "us": us}
    for chosen in ({"us": us}, {"Fs": Fs, "Qs": Qs, "us": us}, given):
        ours = tracker.batch_filter(zs, update_first=update_first, **chosen)
        for a, b in zip(
            ours, kf.batch_filter(zs, update_first=update_first, **chosen), strict=True
        ):
            assert a.shape == b.shape
            np.testing.assert_allclose(a, b, rtol=1e-10, atol=1e-10)
        both: dict[str, Any] = {key: value for key, value in chosen.items() if key in ("Fs", "Qs")}
        smooth = tracker.rts_smoother(ours[0], ours[1], **both)
        for a, b in zip(smooth, kf.rts_smoother(ours[0], ours[1], **both), strict=True):
            assert a.shape == b.shape
            np.testing.assert_allclose(a, b, rtol=1e-9, atol=1e-9)


def test_d9_saver_in_batch_filter() -> None:
    tracker = plain()
    saver = Saver(tracker)
    means = tracker.batch_filter(track(5), saver=saver)[0]
    saver.to_array()
    np.testing.assert_array_equal(saver.x, means)


# D10


@pytest.mark.parametrize("column", [False, True])
@pytest.mark.parametrize("seed", range(10))
def test_d10_kalman_is_their_kalman_filter(seed: int, column: bool) -> None:
    tracker, kf = twins(seed, n=2 + seed % 3, m=1 + seed % 2, column=column)
    rng = np.random.default_rng(100 + seed)
    m = tracker.dim_z
    for step in range(30):
        z = None if step % 7 == 3 else rng.normal(size=(m, 1) if column else m)
        u = rng.normal(size=(1, 1) if column else 1) if step % 2 else None
        tracker.predict(u)
        kf.predict(u)
        tracker.update(z)
        kf.update(z)
        assert_twins(tracker, kf, 1e-12, "x P x_prior P_prior x_post P_post")
        if z is not None:
            assert_twins(tracker, kf, 1e-10, "y S SI K log_likelihood mahalanobis")


def test_d10_filterpys_own_scenario_of_a_manoeuvre_runs_with_our_class() -> None:
    """Bar-Shalom's turn of filterpy's IMM test: velocity, then acceleration, in two dimensions."""
    F_cv = np.kron(np.eye(2), [[1.0, 1.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 0.0]])
    F_ca = np.kron(np.eye(2), [[1.0, 1.0, 0.5], [0.0, 1.0, 1.0], [0.0, 0.0, 1.0]])
    H, x = np.eye(6)[::3], np.array([[2000.0], [0], [0], [1e4], [-15], [0]])
    q = np.array([0.25, 0.5, 1.0])
    Q, R, P0 = np.kron(np.eye(2), np.outer(q, q) * 1e-3), np.diag([1e4, 1e4]), np.eye(6) * 1e3

    def filters(ours: bool) -> list[Any]:
        made: list[Any] = []
        for F in (F_cv, F_ca):
            if ours:
                made.append(Kalman(LinearMotion(F, Q), LinearMeasurement(H, R), x, P0))
            else:
                made.append(KalmanFilter(6, 2))
                made[-1].x, made[-1].P, made[-1].F = x, P0, F
                made[-1].Q, made[-1].H, made[-1].R = Q, H, R
        return made

    switch = np.array([[0.97, 0.03], [0.03, 0.97]])
    banks: list[Callable[[list[Any]], Any]] = [
        lambda fs: IMMEstimator(fs, [0.5, 0.5], switch),
        lambda fs: MMAEFilterBank(fs, [0.5, 0.5], 6, H),
    ]
    for make in banks:
        one, other = make(filters(True)), make(filters(False))
        rng = np.random.default_rng(0)
        for step in range(60):
            z = np.array([[2000.0 + max(step - 40, 0) ** 2], [1e4 - 15 * step]])
            z += rng.normal(size=(2, 1)) * 100
            for bank in (one, other):
                bank.predict()
                bank.update(z)
        np.testing.assert_allclose(one.x, other.x, rtol=1e-9)
        np.testing.assert_allclose(one.P, other.P, rtol=1e-9)


# D11


class Constant:
    """The least that serves."""

    def __init__(self, value: float) -> None:
        self.x, self.P, self.likelihood = np.array([value]), np.eye(1), 1.0

    def predict(self, u: Any = None) -> None:
        pass

    def update(self, z: Any) -> None:
        self.likelihood = float(np.exp(-0.5 * (z - self.x[0]) ** 2))


def test_d11_anything_with_the_five_names_serves_inside_our_imm() -> None:
    for member in (Constant(0.0), plain(), theirs(), Particle(WALK, SEEN, X, P, rng=0)):
        assert isinstance(member, Filter)
    bank = IMM([Constant(0.0), Constant(1.0)], [0.5, 0.5], np.eye(2))
    bank.predict()
    bank.update(1.0)
    assert bank.mu[1] == pytest.approx(1 / (1 + np.exp(-0.5)))
    with pytest.raises(TypeError, match="EnsembleKalmanFilter lacks likelihood"):
        IMM([EnsembleKalmanFilter(X, P, 2, 1.0, 5, None, None)] * 2, [0.5, 0.5], M)


def test_d11_filterpys_filters_inside_our_imm() -> None:
    ukf = as_filterpy(WALK, SEEN, "ukf", x=X, P=P)
    mixed = IMM([theirs(), ukf, plain(1.0)], np.ones(3), np.full((3, 3), 1 / 3))
    right = IMM([plain(), plain(), plain(1.0)], np.ones(3) / 3, np.full((3, 3), 1 / 3))
    for z in track():
        for bank in (mixed, right):
            bank.predict()
            bank.update(z)
        assert_twins(mixed, right, 1e-9, "x P mu log_likelihood")
    with pytest.raises(ValueError, match="keeps the length of its own step"):
        mixed.predict(dt=0.5)


# D12


@pytest.mark.parametrize("kind", [Kalman, EKF, UKF])
def test_d12_copies_and_pickles_go_on(kind: type[KalmanType]) -> None:
    tracker = plain(kind=kind)
    tracker.run(track(3))
    three = (tracker, copy.deepcopy(tracker), pickle.loads(pickle.dumps(tracker)))
    for f in three:
        f.predict()
        f.update([8.0, 6.0])
        assert_twins(tracker, f, 0, "x P K log_likelihood")


def test_d12_filterpy_and_scipy_are_imported_only_where_they_are_used() -> None:
    code = (
        "import sys, arrivals.trackers; "
        "print([name for name in ('filterpy', 'scipy', 'matplotlib') if name in sys.modules])"
    )
    ran = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert ran.stdout.strip() == "[]"


# D13


@pytest.mark.parametrize("column", [False, True])
def test_d13_imm_is_theirs_where_that_is_right(column: bool) -> None:
    x = X.reshape(4, 1) if column else X
    ours = IMM([Kalman(ConstantVelocity(q), SEEN, x, P) for q in (0.05, 2.0)], [0.6, 0.4], M)
    other = IMMEstimator([theirs(0.05, column), theirs(2.0, column)], [0.6, 0.4], M)
    for z in track(30):
        for bank in (ours, other):
            bank.predict()
            bank.update(z.reshape(2, *x.shape[1:]))
        assert_twins(ours, other, 1e-12, "x P x_post P_post mu likelihood")


def test_d13_nonlinear_members_and_angles_on_the_circle() -> None:
    seen = LinearMeasurement([[1.0]], [[0.01]])
    bank = IMM(
        [
            EKF(VonMisesWalk(50.0), seen, [np.pi - 0.05], [[0.01]]),
            UKF(VonMisesWalk(50.0), seen, [-np.pi + 0.05], [[0.01]]),
        ],
        [0.5, 0.5],
        M,
    )
    assert abs(bank.x[0]) == pytest.approx(np.pi)
    assert bank.P[0, 0] == pytest.approx(0.01 + 0.05**2)
    bank.predict()
    bank.update(None)
    assert abs(bank.x[0]) > 3.0


def test_d13_weights_survive_measurements_that_both_models_deem_impossible() -> None:
    ours = IMM([plain(1e-6), plain(1.0)], [0.5, 0.5], np.eye(2))
    other = IMMEstimator([theirs(1e-6), theirs(1.0)], [0.5, 0.5], np.eye(2))
    for bank in (ours, other):
        bank.predict()
        bank.update([300.0, 300.0])
    np.testing.assert_allclose(other.mu, [0.5, 0.5])  # both likelihoods are at their floor
    assert ours.mu[1] > 1 - 1e-12


# Faults of filterpy 2.0.0, and the right answers


def test_fault_mmae_covariance() -> None:
    """Means (0, 0) and (2, 0): the variances are 0.78 and 2 by moments, filterpy has 1.61, 2.5."""

    def two() -> list[Any]:
        filters = [KalmanFilter(2, 1) for _ in range(2)]
        for f, x in zip(filters, ([0.0, 0.0], [2.0, 0.0]), strict=True):
            f.x, f.P, f.H, f.R = np.array(x), np.eye(2), np.array([[1.0, 0.0]]), np.eye(1)
        return filters

    bank = MMAEFilterBank(two(), [0.5, 0.5], 2)
    bank.predict()
    bank.update(1.0)
    np.testing.assert_allclose(bank.P, [[1.6111, 0.1667], [0.1667, 2.5]], atol=1e-4)
    right = sum(
        p * (f.P + np.outer(f.x - bank.x, f.x - bank.x))
        for p, f in zip(bank.p, bank.filters, strict=True)
    )
    np.testing.assert_allclose(right, [[0.7778, 0.0], [0.0, 2.0]], atol=1e-4)
    ours = IMM(two(), [0.5, 0.5], np.eye(2))  # an MMAE is an IMM that never switches
    ours.predict()
    ours.update(1.0)
    np.testing.assert_allclose(ours.P, right)


def test_fault_imm_averages_angles_to_their_opposite() -> None:
    members = [KalmanFilter(1, 1), KalmanFilter(1, 1)]
    for f, x in zip(members, (np.pi - 0.05, -np.pi + 0.05), strict=True):
        f.x = np.array([x])
    assert IMMEstimator(members, [0.5, 0.5], M).x == pytest.approx(0.0)
    ours = IMM(members, [0.5, 0.5], M, angles=(0,))
    assert abs(ours.x[0]) == pytest.approx(np.pi)


def test_fault_ukf_smoother_ignores_qs() -> None:
    zs = track(6)
    Qs = [WALK.Q() * scale for scale in (1.0, 1.0, 50.0, 1.0, 1.0, 1.0)]
    ukf = as_filterpy(WALK, SEEN, "ukf", x=X, P=P)
    kalman, tracker = plain(), plain(kind=UKF)
    xs, Ps = kalman.batch_filter(zs, Qs=Qs)[:2]
    np.testing.assert_array_equal(ukf.rts_smoother(xs, Ps, Qs=Qs)[0], ukf.rts_smoother(xs, Ps)[0])
    right = theirs().rts_smoother(xs, Ps, Qs=Qs)
    for ours in (kalman, tracker):
        for a, b in zip(ours.rts_smoother(xs, Ps, Qs=Qs), right, strict=True):
            np.testing.assert_allclose(a, b, atol=1e-9)


def test_fault_complex_h_fails_silently() -> None:
    kf = KalmanFilter(1, 1)
    kf.x, kf.H = np.array([1.0]), np.array([[2j]])
    kf.update(np.array([1j]))
    assert kf.P.real < 0 or kf.P.real > 1  # no error, and no covariance any more
    with pytest.raises(TypeError, match=r"must hold real numbers.*composite"):
        LinearMeasurement([[1j]], [[1.0]])
    tracker = Kalman(RandomWalk(1.0, 1), LinearMeasurement([[1.0]], [[1.0]]), [1.0], [[1.0]])
    with pytest.raises(TypeError, match="H must hold real numbers; got complex128"):
        tracker.update(1.0, H=[[1j]])
    with pytest.raises(TypeError, match=r"real numbers.*composite\(z\)"):
        tracker.update([1j])


def test_fault_second_update_uses_stale_sigma_points() -> None:
    """Two updates by linear measurements are two Kalman updates; not in filterpy's UKF and CKF."""
    right, ours = plain(), plain(kind=UKF)
    stale = [as_filterpy(WALK, SEEN, kind, x=X, P=P) for kind in ("ukf", "ckf")]
    for f in (right, ours, *stale):
        f.predict()
        for z in track(2):
            f.update(z)
    assert_twins(ours, right, 1e-9)
    for f in stale:
        assert np.abs(np.ravel(f.x) - right.x).max() > 0.01


def test_fault_resampling_draws_from_the_global_generator() -> None:
    weights = np.random.default_rng(0).dirichlet(np.ones(50))
    draws = []
    for _ in range(2):
        np.random.seed(3)  # noqa: NPY002
        draws.append(their_resample(weights))
    np.testing.assert_array_equal(*draws)
    before = np.random.get_state()[1].copy()  # type: ignore[index]  # noqa: NPY002
    ours = systematic_resample(weights, np.random.default_rng(1))
    np.testing.assert_array_equal(before, np.random.get_state()[1])  # type: ignore[index]  # noqa: NPY002
    assert np.abs(np.bincount(ours, minlength=50) - 50 * weights).max() < 1
