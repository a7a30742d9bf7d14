"""Directions and signals of autoregressive sources: Kalman filter and regularized QRD-RLS."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike

from arrivals.measurement_models.array_snapshot import ArraySnapshot
from arrivals.motion_models.autoregressive.sources import AutoregressiveSources
from arrivals.trackers.autoregressive.belief import SourceBelief
from arrivals.trackers.autoregressive.direction_covariance import (
    direction_std,
    with_direction_covariance,
)
from arrivals.trackers.autoregressive.initialization import (
    check_directions,
    check_form,
    manifold_of,
)
from arrivals.trackers.autoregressive.interval import finish_interval
from arrivals.trackers.autoregressive.interval_filter import assumed_noise, filter_interval
from arrivals.trackers.autoregressive.processing import BlockProcessor
from arrivals.trackers.autoregressive.regressions import (
    estimate_ar_models,
    estimate_directions,
    rows_of_factor,
)
from arrivals.trackers.autoregressive.settings import NoiseSettings, RegressionSettings
from arrivals.trackers.autoregressive.snapshots import completes_interval, to_snapshot
from arrivals.trackers.autoregressive.steady_state import StateSpace
from arrivals.trackers.direction_estimates import SourceEstimate
from arrivals.trackers.gaussian.linalg import transposed
from arrivals.trackers.registry import register
from arrivals.typing import Float
from arrivals.validation import count, instance, no_control, not_negative, positive, time_step


@register("ar_kalman_qrd_rls")
class ARKalmanQRDRLS(BlockProcessor):
    """Directions of autoregressive sources, and their signals.

    In each interval of snapshots, a Kalman filter estimates the samples of the sources with the
    present directions and AR models; a regression of the snapshots on them gives new directions,
    and one of the samples on earlier samples new AR models. There may be more sources than sensors.

    Parameters
    ----------
    measurement : ArraySnapshot
        A line, symmetric about its centre: M pairs and a centre sensor are 2M + 1 sensors. Without
        the centre sensor, as with two sensors, convergence takes longer and needs initial
        directions: acquisition is off by up to 20 degrees. Its noise is the initial estimate.
    motion : AutoregressiveSources
        Initial AR models; their powers, the expected long-term powers of the sources, should be
        right within 10 dB. Real-valued sources are received with half of the noise.
    doa : sequence of float, optional
        Initial directions, one a source, rad: nearer to their own source than to the next. If
        None, the maximum-likelihood directions on a grid for the first 60 snapshots or so with
        power above the gate; all placements are tried: 210 of two sources, 2730 of three and
        32760 of four with different models.
    doa_std : float
        Standard deviation of `doa`, rad, if given: its errors count in `std` until later
        snapshots outweigh it. The default is that of errors up to 5 degrees.
    interval : int
        N, snapshots of an interval.
    inner : int
        Iterations of each interval.
    gate : float
        γ: a source below this fraction of its long-term power is inactive and keeps its direction
        and its AR model; all do in silence, 20 dB below their long-term powers together.
    memory : float
        Intervals over which the long-term power of a source is averaged, pauses included.
    regression : RegressionSettings
        Forgetting, ridge, covariance correction and literal forms of the two regressions.
    noise : NoiseSettings
        Estimation of the innovation variances and of the measurement noise.

    Attributes
    ----------
    x, P : ndarray, shape (dim_x,), (dim_x, dim_x)
        Mean and covariance of the samples of the sources, as `motion` arranges them.
    signals : ndarray of complex, shape (interval, n_sources)
        Samples of the sources in the last interval; in a `Run`, of all steps.

    Raises
    ------
    ValueError
        If the array is not symmetric or ambiguous, or beyond a literal form, an AR order is longer
        than the interval, two initial directions coincide, or a parameter is out of range.

    Notes
    -----
    A measurement is a complex snapshot, (n_sensors,), NaN where a sensor has no data, and None if
    all of it is missing. The belief changes at the end of an interval; if the last snapshot of it
    is missing, at the next `predict`. `dt` is the time between snapshots, in any unit.

    `std` counts the noise with the memory of the regression, and the errors of the first
    directions; intervals without data add a random walk, that which makes λ the best forgetting, as
    do those of inactive sources. Of still sources (`ar_fig1`, `ar_fig5`, `ar_fig6`), 65 to 75 % of
    the errors lie within it and 93 to 97 % within 1.96 of it. It does not count exchanged labels,
    the bias without `correction`, nor the lag behind a moving source, since no rate is estimated:
    of the errors of `ar_fig4`, 48 and 83 % lie within the 95 % interval at 30 and 0 dB. In
    literal forms of the regression it is NaN.

    Labels are the indices of the sources in `motion`. `existence` is 1 for a source
    active in the last interval and 0 for an inactive one if there is a gate, else NaN.

    A pair of sensors one of which is missing is left out of that snapshot; so is a snapshot 25 dB
    above the expected power and most others of its interval, such as a click.

    References
    ----------
    Gu, Chan, Zhu and Swamy, IEEE TCAS-II 60(1), 46-50, 2013; equation numbers are those of
    Magakian's report on it. The covariance rows, the targets of the regularization, the gate and
    the noise estimates: ours.

    Examples
    --------
    Three sources on three sensors:

    >>> from arrivals.measurement_models import SensorArray
    >>> motion = AutoregressiveSources([[0.77, -0.45], [0.96, -0.77], [-1.2, -0.72]]).scaled(1.0)
    >>> model = ArraySnapshot(SensorArray.symmetric([0.5]), wavelength=1.0, noise=0.1)
    >>> rng, x, s = np.random.default_rng(0), np.zeros(motion.dim_x), []
    >>> for _ in range(3000):
    ...     x = motion.sample(x, rng)
    ...     s.append(motion.signals(x))
    >>> z = model.simulate(np.deg2rad([-35.0, 5.0, 40.0]), s, rng)
    >>> tracker = ARKalmanQRDRLS(model, motion, doa=np.deg2rad([-32.0, 2.0, 43.0]))
    >>> run = tracker.run(z)
    >>> bool(abs(np.rad2deg(run.doa[-1]) - [-35, 5, 40]).max() < 1), run.signals.shape
    (True, (3000, 3))
    """

    renamed: ClassVar[dict[str, str]] = {
        "adapt_drive": "noise__adapt_process_noise",
        "adapt_noise": "noise__adapt_measurement_noise",
        "r_start": "noise__r_start",
        "tau": "noise__tau",
    } | {
        name: f"regression__{name}"
        for name in ("forgetting", "ar_forgetting", "ridge", "ar_ridge", "correction")
    }

    def __init__(
        self,
        measurement: ArraySnapshot,
        motion: AutoregressiveSources = AutoregressiveSources(((0.0, 0.0), (0.0, 0.0))),  # noqa: B008  (models are immutable)
        *,
        doa: Sequence[float] | Float | None = None,
        doa_std: float = 0.05,
        interval: int = 30,
        inner: int = 1,
        gate: float = 0.0,
        memory: float = 1000.0,
        regression: RegressionSettings = RegressionSettings(),  # noqa: B008
        noise: NoiseSettings = NoiseSettings(),  # noqa: B008
    ) -> None:
        self.measurement = instance("measurement", measurement, ArraySnapshot)
        self.motion = instance("motion", motion, AutoregressiveSources)
        self.doa, self.interval = doa, count("interval", interval, 1, 100_000)
        self.doa_std = positive("doa_std", doa_std)
        self.inner, self.gate = count("inner", inner), not_negative("gate", gate)
        self.memory = positive("memory", memory)
        self.regression = instance("regression", regression, RegressionSettings)
        self.noise = instance("noise", noise, NoiseSettings)
        check_form(regression, manifold_of(measurement))
        if max(self.motion.orders) > self.interval:
            raise ValueError(
                f"AR orders must be at most the interval, {self.interval} snapshots; "
                f"got {max(self.motion.orders)}"
            )
        if doa is not None:
            check_directions(doa, self.motion.n_sources)
        self.restart()

    def predict(self, u: ArrayLike | None = None, *, dt: float = 1.0) -> None:
        """Process an interval whose last snapshot is missing; sources move within intervals.

        Parameters
        ----------
        u : None or 0
            Not used: sources have no control input.
        dt : float
            Time between snapshots.
        """
        if u is not None:
            no_control(u)
        if type(dt) is not float or dt != 1.0:
            time_step(dt)
        self.process_if_full()

    def update(self, z: ArrayLike | None) -> None:
        """Add one snapshot; the last of an interval updates the belief by Algorithm 1.

        Parameters
        ----------
        z : array_like of complex, shape (n_sensors,)
            NaN where a sensor has no data, None if all of it is missing.
        """
        snapshot = to_snapshot(z, self.measurement)
        self.process_if_full()
        self.append(snapshot)
        if completes_interval(snapshot):
            self.process_if_full()

    def update_interval(self, belief: SourceBelief, y: Float) -> tuple[SourceBelief, Float]:
        """Return the belief after an interval, and the states: Algorithm 1 of the report.

        Parameters
        ----------
        belief : SourceBelief
            Before the interval, with leading batch axes.
        y : ndarray, shape (..., interval * n_parts, n_sensors)
            Transformed snapshots (5), real; NaN where missing.

        Returns
        -------
        belief : SourceBelief
        X : ndarray, shape (..., interval * n_parts, n)
        """
        new, regression = belief, self.regression
        for _ in range(self.inner):
            # line 8: X(j) = F X(j-1) + V(j), y = A_T Γ X(j) + e(j)   (3), (5)
            model = self.state_space(belief, new)
            filtered = filter_interval(belief, y, model, regression)
            # lines 11-15: rows of A_T by least squares, then directions   (6), (7)
            rows, doa = estimate_directions(belief, filtered, model, self.manifold, regression)
            # line 10: AR coefficients and innovation variances   (1)
            factor, weight, a, q = estimate_ar_models(
                belief, new, filtered, self.layout, regression
            )
            q = q if self.noise.adapt_process_noise else new.q
            new = replace(
                new, doa=doa, a=a, q=q, manifold_factor=rows, ar_factor=factor, ar_weight=weight
            )
        # inactive sources keep their directions; r and long-term powers
        new = finish_interval(belief, new, filtered, self.noise, self.gate, self.memory)
        if regression.states_deviations:
            new = with_direction_covariance(
                belief, new, filtered, model, self.manifold, regression.forgetting, self.inner
            )
        return new, filtered.X

    def state_space(self, belief: SourceBelief, new: SourceBelief) -> StateSpace:
        """Return F, Q (3) and A_T (5) of `new`, and r of `belief`."""
        F, Q = self.layout.transition(new.a), self.layout.process_noise(new.q)
        if self.regression.rows == "estimated":
            A = rows_of_factor(new.manifold_factor, self.manifold)
        else:
            A = transposed(self.manifold.real_steering(new.doa))
        return StateSpace(F, Q, A, assumed_noise(belief, self.noise))

    @property
    def estimate(self) -> SourceEstimate:
        """Directions, AR models and latest samples of the sources, as of the last interval."""
        b, n, p = self.belief, self.motion.n_sources, max(self.motion.orders)
        if b is None:
            return SourceEstimate.empty(coefficients=np.zeros((0, p)))
        return SourceEstimate(
            doa=b.doa[0],
            std=direction_std(b.covariance[0], b.doa[0]),
            existence=b.active[0].astype(float) if self.gate > 0 else np.full(n, np.nan),
            amplitude=self.motion.signals(self.x),
            label=np.arange(n),
            noise=float(b.r[0]),
            coefficients=b.a[0],
            innovation_variance=b.q[0],
        )

    @property
    def coefficients(self) -> Float:
        """AR coefficients, (n_sources, largest order), zero beyond the order of a source."""
        return self.motion.coefficient_matrix if self.belief is None else self.belief.a[0]

    @property
    def innovation_variance(self) -> Float:
        """Variances of the innovations of the sources, (n_sources,)."""
        return np.array(self.motion.noise) if self.belief is None else self.belief.q[0]

    @property
    def noise_variance(self) -> float:
        """Variance of the noise of one sensor."""
        return self.measurement.noise if self.belief is None else float(self.belief.r[0])

    @property
    def power(self) -> Float:
        """Long-term powers of the sources, (n_sources,)."""
        return self.motion.power if self.belief is None else self.belief.power[0]
