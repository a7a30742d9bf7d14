"""The filterpy contract, D1 to D6 and D12: calls, attributes and copies."""

import copy
import pickle
import subprocess
import sys
from typing import Any

import numpy as np
import pytest
from filterpy.common import Saver
from filterpy_twins import (
    BEARING,
    POSITION,
    WALK,
    M,
    P,
    X,
    assert_twins,
    plain,
    theirs,
    track,
    twins,
)

from arrivals.measurement_models import LinearMeasurement
from arrivals.motion_models import (
    CoordinatedTurn,
    RandomWalk,
)
from arrivals.trackers import EKF, IMM, UKF, GaussianFilter, Kalman, Particle

# D1


@pytest.mark.parametrize("shape", [(3,), (3, 1)])
def test_d1_assigned_belief_is_used_by_the_next_call(shape: tuple[int, ...]) -> None:
    tracker, kf = twins(0, column=len(shape) == 2)
    for z in np.ones((3, 2)):
        for step in ("predict", "update"):
            for f in (tracker, kf):
                f.x, f.P = np.full(shape, 2.0), 3 * np.eye(3)
                getattr(f, step)(*([] if step == "predict" else [z.reshape(2, *shape[1:])]))
        assert_twins(tracker, kf)
        assert tracker.x.shape == shape


@pytest.mark.parametrize("kind", [Kalman, EKF, UKF])
def test_d1_assigned_x_keeps_its_number_of_axes(kind: type[GaussianFilter]) -> None:
    tracker = plain(kind=kind)
    tracker.x = X.reshape(4, 1)
    tracker.predict()
    tracker.update([8.0, 6.0])
    assert tracker.x.shape == (4, 1)
    assert tracker.y.shape == tracker.z.shape == (2, 1)


# D2


def test_d2_predict_first_argument_is_the_control_input() -> None:
    tracker, kf = twins(1)
    for u in (None, 0, 0.0, [0.0], [1.5], 2.0):
        tracker.predict(u)
        kf.predict(np.zeros(1) if u is None else np.atleast_1d(u))
        assert_twins(tracker, kf, names="x P x_prior P_prior")
    with pytest.raises(TypeError):
        tracker.predict(None, 0.5)  # type: ignore[call-arg]


# D3


def test_d3_update_accepts_every_shape_of_measurement() -> None:
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
def test_d3_update_r_and_h_replace_the_model_once(kind: type[GaussianFilter]) -> None:
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
def test_d4_missing_measurement_sets_the_record(column: bool, missing: Any) -> None:
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
def test_d5_attributes_have_their_final_shapes_after_construction(
    kind: type[GaussianFilter], column: bool
) -> None:
    tracker = kind(WALK, POSITION, X.reshape(4, 1) if column else X, P)
    shapes = {name: np.shape(getattr(tracker, name)) for name in NAMES}
    for z in (None, [8.0, 6.0], [8.0, np.nan]):
        tracker.predict()
        tracker.update(z)
        assert {name: np.shape(getattr(tracker, name)) for name in NAMES} == shapes
    assert shapes["y"] == ((2, 1) if column else (2,))
    assert shapes["K"] == (4, 2)


def test_d5_likelihood_is_always_positive() -> None:
    tracker = plain()
    tracker.update([1e6, 1e6])
    assert tracker.likelihood == sys.float_info.min
    assert tracker.log_likelihood < -1e9


def test_d5_nonlinear_filters_have_the_present_jacobians() -> None:
    tracker = EKF(CoordinatedTurn(0.1, 0.1), BEARING, [*X, 0.1], np.eye(5))
    tracker.predict(dt=0.5)
    np.testing.assert_array_equal(tracker.F, tracker.motion.F(tracker.x, 0.5))
    np.testing.assert_array_equal(tracker.H, BEARING.H(tracker.x))


# D6


@pytest.mark.parametrize("column", [False, True])
@pytest.mark.parametrize("kind", [Kalman, EKF, UKF])
def test_d6_saver_makes_arrays(kind: type[GaussianFilter], column: bool) -> None:
    tracker = kind(WALK, POSITION, X.reshape(4, 1) if column else X, P)
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


def test_d6_saver_saves_imm_and_particle() -> None:
    for tracker in (
        IMM([plain(), plain(1.0)], [0.5, 0.5], M),
        Particle(WALK, POSITION, X, P, n_particles=20, rng=0),
    ):
        saver = Saver(tracker, save_current=True)
        for z in track(3):
            tracker.predict()
            tracker.update(z)
            saver.save()
        saver.to_array()
        assert saver.x.shape == (4, 4)


# D12


@pytest.mark.parametrize("kind", [Kalman, EKF, UKF])
def test_d12_copies_and_pickles_continue_equally(kind: type[GaussianFilter]) -> None:
    tracker = plain(kind=kind)
    tracker.run(track(3))
    three = (tracker, copy.deepcopy(tracker), pickle.loads(pickle.dumps(tracker)))
    for f in three:
        f.predict()
        f.update([8.0, 6.0])
        assert_twins(tracker, f, 0, "x P K log_likelihood")


def test_d12_import_loads_neither_filterpy_nor_scipy() -> None:
    code = (
        "import sys, arrivals.trackers; "
        "print([name for name in ('filterpy', 'scipy', 'matplotlib') if name in sys.modules])"
    )
    ran = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert ran.stdout.strip() == "[]"
