"""Records that the compiled functions read and write, of one problem; fields as elsewhere."""

from __future__ import annotations

from typing import NamedTuple

from arrivals.typing import Bool, Complex, Float, Int

# Rows of components, in the order of `ONE_ANGLE`.
MU, VARIANCE, PRIOR_MU, PRIOR_KAPPA, LOG_ODDS, KL_CONSTANT, SLOT = range(7)


class ChartNumbers(NamedTuple):
    """Numbers of an `ExpectedResponse` of angles.

    Attributes
    ----------
    harmonics : ndarray, shape (n_k,)
    sizes : ndarray, shape (C,)
        Values of |k|.
    column : ndarray of int, shape (n_k,)
        Where the size of each stands.
    G : ndarray, shape (F, n_k, M)
        Coefficients of the harmonics; empty if the harmonics are the sensors.
    norm2 : ndarray, shape (F,)
    series : ndarray, shape (F, n_i)
        Series of ‖a‖²; empty if it is constant.
    tempering, power_floor, noise_floor, longest_step, max_variance : float
    step : float
        Electrical angle at endfire; 0 if the angle is the direction.
    front_back_ambiguous : bool
    """

    harmonics: Float
    sizes: Float
    column: Int
    G: Complex
    norm2: Float
    series: Complex
    tempering: float
    power_floor: float
    noise_floor: float
    longest_step: float
    max_variance: float
    step: float
    front_back_ambiguous: bool


class GridNumbers(NamedTuple):
    """Numbers of an `AngleCandidates`.

    Attributes
    ----------
    theta, doa : ndarray, shape (n_points,)
    A : ndarray, shape (F, n_points, M)
    R : ndarray, shape (F, n_points, 2 C)
        Real and imaginary parts of a, of one sensor of those with a and a*.
    column : ndarray of int, shape (M,)
        Where the real part of each sensor stands in R; the imaginary one C columns later.
    sign : ndarray, shape (M,)
        -1 if a* stands there, else 1.
    gram, norm2 : ndarray, shape (F, n_points)
    log_range, cos_apart, cos_merge, cos_near, merge : float
    merge_correlation : float
        0 if a distance decides.
    """

    theta: Float
    doa: Float
    A: Complex
    R: Float
    column: Int
    sign: Float
    gram: Float
    norm2: Float
    log_range: float
    cos_apart: float
    cos_merge: float
    cos_near: float
    merge: float
    merge_correlation: float


class SearchNumbers(NamedTuple):
    """Numbers of a `SupportSearch` and its `IterationLimits`; the table of `student_factor`."""

    inner: int
    removal: int
    fill: int
    final: int
    max_changes: int
    max_iterations: int
    n_components: int
    max_active: int
    inner_tolerance: float
    large_gain: float
    tolerance: float
    kl_weight: float
    reestimate: bool
    inverse_freedom: Float
    student_factor: Float


class Terms(NamedTuple):
    """The fields of an `Evaluation`, with space for L components, and numbers as arrays (1,).

    Attributes
    ----------
    responses : ndarray, shape (F, L, 3, M)
        â, ∂â and ∂²â.
    X : ndarray, shape (F, 3, L, L) or (F, 4, L, L)
    """

    Y: Complex
    packed: Float
    K: Int
    nu: Float
    tau: Float
    log_prior_inactive: Float
    responses: Complex
    X: Complex
    h: Complex
    uncertainty_loss: Float
    prior_gradient: Float
    prior_curvature: Float
    D: Float
    log_prior: Float
    W: Complex
    G: Complex
    explained: Float
    F: Float


class Removed(NamedTuple):
    """The fields of `RemovedComponents`, and the number of components in the memory, (1,)."""

    memory: Float
    can_reactivate: Bool
    excluded: Bool
    n_known: Int


class Progress(NamedTuple):
    """The fields of a `SolverState` that change: flags and counts, and the criteria.

    Attributes
    ----------
    filling, finished, on_trial, estimate_nu, done : ndarray of bool, shape (1,)
    steps_remaining, iterations, n_changes : ndarray of int, shape (1,)
    tolerance, record, before, rejected : ndarray, shape (1,)
    """

    filling: Bool
    finished: Bool
    on_trial: Bool
    estimate_nu: Bool
    done: Bool
    steps_remaining: Int
    iterations: Int
    n_changes: Int
    tolerance: Float
    record: Float
    before: Float
    rejected: Float


class Start(NamedTuple):
    """What problems start with, (B, ...), or one, (1,): fields of `InitialValues`.

    The components, their number and the variances become those of the solution. `packed` has
    space for those that are added.
    """

    Y: Complex
    packed: Float
    K: Int
    nu: Float
    tau: Float
    log_prior_inactive: Float
    estimate_rho: Bool
    log_odds_new: Float
    fill_target: Int


class Task(NamedTuple):
    """What does not change while a problem is solved."""

    chart: ChartNumbers
    grid: GridNumbers
    search: SearchNumbers
    start: Start


class Outcome(NamedTuple):
    """Result of each problem beside its components: (B,), (B, L), or of W (B, F, L, N).

    Attributes
    ----------
    iterations, finished : ndarray
        Newton steps, and whether the final ones were taken.
    W : ndarray
        Means of the amplitudes.
    covariance, stated_covariance, log_odds : ndarray
        As in `ComponentMarginals`.
    """

    iterations: Int
    finished: Bool
    W: Complex
    covariance: Float
    stated_covariance: Float
    log_odds: Float
