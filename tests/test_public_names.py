"""Public names of the packages: a change of this list is a change of the interface."""

import ast
import importlib
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
FOLDERS = ("trackers", "motion_models", "measurement_models", "scenarios", "src/arrivals")
NAMES = {
    "motion_models": """
        AutoregressiveSources BernoulliVonMises CombinedMotion ConstantVelocity CoordinatedTurn
        DelayDrift DelayWalk DirectionAmplitudeWalk FunctionMotion LinearMotion LinearMotionModel
        MotionModel MoveStopWalk RandomWalk VonMisesFisherWalk VonMisesWalk select_order wrap
        yule_walker
    """,
    "measurement_models": """
        AngleManifold ArrayManifold ArraySamples ArraySnapshot Autoregressive
        AveragedEnvelope Bearing CombinedMeasurement DelayInterpolator DelayLine
        DirectionMeasurement ElementResponse FlatBand FunctionMeasurement InterpolationDelay
        LinearMeasurement LogGains LogNormalRSS Manifold MeasurementModel NoiseCoherence
        Phasor PointManifold SensorArray Station StationEntries Tones composite db_to_neper
        dbm_to_neper neper_to_db steering_vector
    """,
    "trackers": """
        ARKalmanQRDRLS AmplitudePrior BearingDetection BirthDeath CBF CoordinateSolver
        DirectionEstimate DirectionTracker EKF ESPRIT Estimate Filter FixedPointSolver Fused
        FusedEstimate GaussianFilter GlobalHypotheses GridSearch IMM InterpolationEKF Kalman
        MAPSolver MUSIC MVDR MixtureSettings NewtonSolver PAST Particle PeaksGNN
        PositionEstimate QRDRLS RSSML RSSVB RangeEstimate RootMUSIC Run SBL SSBL SVALSE
        SourceEstimate SphereEstimate StateEstimate Tracker UKF VALSE VariationalSolver
        WidebandMixture as_filterpy available bearings create find find_peaks is_missing
        refine_peaks register update_by_cells
    """,
    "plots": """
        plot plot_array plot_bearing_time plot_coverage plot_map plot_metric plot_range
        plot_reliability plot_sky plot_tracks
    """,
    "trackers.filterpy": "ExtendedKalmanFilter IMMEstimator KalmanFilter UnscentedKalmanFilter",
    "scenarios": """
        Gospa Method Network Recording Reliability Scenario Study Trial ar_signals available
        best_assignment_rmse calibrate create exact_detection find gospa grid mean_gospa mean_rmse
        monte_carlo network_detection nmse ospa plot_array plot_bearing_time plot_range plot_sky
        read read_network register reliability rmse rss_bound sdr
    """,
}
PACKAGES = sorted({f.resolve() for top in FOLDERS for f in (ROOT / top).rglob("__init__.py")})


@pytest.mark.parametrize("package", NAMES)
def test_public_names_are_listed(package: str) -> None:
    module = importlib.import_module(f"arrivals.{package}")
    listed = NAMES[package].split()
    assert sorted(module.__all__) == listed
    assert [name for name in listed if not hasattr(module, name)] == []


@pytest.mark.parametrize("file", PACKAGES, ids=lambda file: file.relative_to(ROOT).as_posix())
def test_package_that_imports_names_has_all(file: Path) -> None:
    body = ast.parse(file.read_text(encoding="utf-8")).body
    imports = any(isinstance(node, ast.ImportFrom) for node in body)
    assigned = [ast.unparse(node.targets[0]) for node in body if isinstance(node, ast.Assign)]
    assert not imports or "__all__" in assigned
