"""Moving sources: what Doppler's factor, which the paper leaves out, does to a tracker."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from arrivals.measurement_models import AveragedEnvelope, LogGains, LogNormalRSS, db_to_neper
from arrivals.measurement_models.signal_strength.path_loss import doppler_log_gain
from arrivals.motion_models import ConstantVelocity
from arrivals.plots.colours import PALETTE
from arrivals.plots.labels import legend_beside
from arrivals.scenarios.experiments.statistics import standard_error
from arrivals.scenarios.reproduce.claims import Claim
from arrivals.scenarios.reproduce.decisions import Both, Decision, below, by_forms, negative
from arrivals.scenarios.reproduce.report import Report
from arrivals.scenarios.simulations.signal_strength import in_disc
from arrivals.trackers import RSSVB, AmplitudePrior
from arrivals.typing import Float

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SPEEDS = (5, 15, 30)  # m/s
WAVE_SPEED = 343.0  # m/s
PATH, DISTANCE = 120.0, 15.0  # m: length of the path, and its largest offset
STEPS = 24
ABSENT, IGNORED, USED = (
    "no Doppler in the sound",
    "Doppler ignored (the paper)",
    "own velocity used",
)
FORMS = (ABSENT, IGNORED, USED)
NEGLIGIBLE = 1.1  # times the error without Doppler in the sound
BARS = "bars: two standard errors of the mean of the runs"
SETTLED = 6  # steps after which errors count
REMARKS = (
    "One source of 80 dB on a straight path through 100 sensors in a disc of 100 m, 24 steps of "
    "5 m, N = 50, noise 40 dB, sound at 343 m/s; `ConstantVelocity`, started 5 m and 3 m/s off "
    "(standard deviations). "
    "The readings have the factor (1 - v/c cos ψ)⁻² of a moving monopole. The lead is the mean "
    "error in the direction of motion. NEES, the normalised estimation error squared, is 2 if the "
    "stated covariances are true. ± is the standard error of the mean of the runs. q = 1 m²/s³.",
    "`AmplitudePrior(wave_speed=343)` uses the predicted velocity of the track; by default the "
    "factor is ignored, as in the paper. Beside the errors of its Table 1, 7 to 14 m, the lead at "
    "5 m/s is small.",
)


class DopplerErrors(NamedTuple):
    """Errors of a form in each run: means over the steps.

    Parameters
    ----------
    error, lead, nees : ndarray, shape (n_runs,)
        Distance, m, error along the motion, m, and normalised square.
    """

    error: Float
    lead: Float
    nees: Float


Results = Mapping[tuple[int, str], DopplerErrors]


def doppler(runs: int, seed: int) -> Report:
    """Errors of tracked positions at 5, 15 and 30 m/s, with Doppler's factor ignored and used."""
    results: dict[tuple[int, str], DopplerErrors] = {}
    rows: list[tuple[Any, ...]] = []
    for speed in SPEEDS:
        each = [_run(speed, np.random.default_rng([seed, run])) for run in range(runs)]
        for form in FORMS:
            one = results[speed, form] = DopplerErrors(*np.array([r[form] for r in each]).T)
            error = standard_error(one.error)
            rows.append((speed, form, *(float(part.mean()) for part in one), error))
    columns = ("speed m/s", "form", "error m", "lead m", "NEES", "± of the error")
    figures = {"lead": _draw(results)}
    title = f"Doppler's factor, Sec. 3: {runs} runs"
    return Report(title, columns, rows, REMARKS, figures, columns, results)


def _run(speed: float, rng: np.random.Generator) -> dict[str, tuple[float, float, float]]:
    """Track one source by each form: the same sensors, path and noise."""
    model = LogNormalRSS(
        in_disc(rng, (100,), 100.0), AveragedEnvelope(50), log_noise=float(db_to_neper(40.0))
    )
    phi, offset = rng.uniform(0, 2 * np.pi), rng.uniform(-DISTANCE, DISTANCE)
    along = np.array([np.cos(phi), np.sin(phi)])
    across = np.array([-along[1], along[0]])
    track = np.linspace(-PATH / 2, PATH / 2, STEPS)[:, None] * along + offset * across
    dt = PATH / (STEPS - 1) / speed
    v = speed * along
    u = db_to_neper([80.0])
    noise_seed = int(rng.integers(2**31))
    x0 = np.zeros(4)
    x0[::2] = track[0] + 5.0 * rng.standard_normal(2)
    x0[1::2] = v + 3.0 * rng.standard_normal(2)
    found = {}
    for form in FORMS:
        noise = np.random.default_rng(noise_seed)
        z = []
        for theta in track:
            gain = 0.0 if form == ABSENT else doppler_log_gain(v[None], theta[None], model.sensors,
                                                                WAVE_SPEED)  # fmt: skip
            z.append(model.replace(gains=LogGains(paths=gain)).draw(u, theta[None], noise))
        prior = AmplitudePrior(wave_speed=WAVE_SPEED if form == USED else None)
        tracker = RSSVB(ConstantVelocity(q=1.0), model, [x0], np.diag([5.0, 3.0] * 2) ** 2,
                        amplitude=prior)  # fmt: skip
        found[form] = _errors(tracker, np.array(z), track, along, dt)
    return found


def _errors(
    tracker: RSSVB, z: Float, track: Float, along: Float, dt: float
) -> tuple[float, float, float]:
    run = tracker.run(z, dt=dt)
    error = (np.asarray(run.position)[:, 0] - track)[SETTLED:]
    P = np.asarray(run.fields["covariance"])[SETTLED:, 0]
    nees = np.einsum("ti,ti->t", error, np.linalg.solve(P, error[..., None])[..., 0])
    return (
        float(np.linalg.norm(error, axis=1).mean()), float((error @ along).mean()),
        float(nees.mean()),
    )  # fmt: skip


def _draw(results: Results) -> Figure:
    from matplotlib.figure import Figure

    figure = Figure(figsize=(10.5, 3.8), layout="constrained")
    colours = dict(zip(FORMS, ("0.5", PALETTE[1], PALETTE[2]), strict=True))
    for ax, name, label in zip(
        figure.subplots(1, 2), ("error", "lead"), ("(a) error", "(b) lead"), strict=True
    ):
        for n, form in enumerate(FORMS):
            parts = [getattr(results[speed, form], name) for speed in SPEEDS]
            half = [2 * standard_error(part) for part in parts]
            x = np.array(SPEEDS) + 0.3 * (n - 1)
            ax.errorbar(x, [float(part.mean()) for part in parts], half, color=colours[form],
                        marker="o", capsize=3, label=form)  # fmt: skip
        ax.set(xlabel="speed, m/s", ylabel=f"{name}, m", title=label)
        ax.set_xticks(SPEEDS)
        ax.grid(alpha=0.3)
    figure.axes[0].set_ylim(bottom=0)
    legend_beside(figure.axes[1], title=BARS, title_fontsize=8)
    return figure


# -- claims -------------------------------------------------------------------------------------


def negligible(speed: int) -> Both:
    """Decide that Doppler in the sound makes the error at most a tenth larger."""
    return by_forms((IGNORED, USED), _negligible, speed)


def _negligible(speed: int, form: str, results: Results) -> Decision:
    here, without = (results[speed, name].error for name in (form, ABSENT))
    d = here - NEGLIGIBLE * without
    error = standard_error(d)
    numbers = (
        f"{form}: {here.mean():.2f} m, without Doppler in the sound {without.mean():.2f} m, "
        f"{here.mean() / without.mean():.2f} ± {error / without.mean():.2f} times"
    )
    return Decision(negative(float(d.mean()), error), numbers)


def _better(speed: int, results: Results) -> Decision:
    used, ignored = results[speed, USED].error, results[speed, IGNORED].error
    holds, numbers = below(used, ignored, "m")
    return Decision(holds, f"used and ignored: {numbers}")


CLAIMS: tuple[Claim, ...] = tuple(
    Claim("rss-doppler", "", f"the track's own velocity lowers the error at {speed} m/s", None,
          partial(_better, speed), "ours")
    for speed in SPEEDS
)  # fmt: skip
