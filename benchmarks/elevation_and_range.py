"""Two unknowns a source: accuracy beside the specification's limits, and CPU beside one unknown."""

from __future__ import annotations

import argparse
import os
import time
import warnings
from dataclasses import dataclass

os.environ.setdefault("OMP_NUM_THREADS", "1")
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np
from horizontal_waves import horizontal_waves
from scipy.optimize import linear_sum_assignment
from svalse_fast import row
from svalse_fast_speed import Counted

from arrivals.measurement_models import ArraySnapshot, SensorArray
from arrivals.measurement_models.manifolds.line_phase import sine_line
from arrivals.measurement_models.manifolds.manifold import Manifold, Reference
from arrivals.scenarios import create, mean_gospa
from arrivals.scenarios.bounds import range_bound
from arrivals.scenarios.experiments.statistics import standard_error
from arrivals.scenarios.metrics.assignment import label_switches
from arrivals.scenarios.metrics.registry import existence_and_hits, gospa_of, pairs_of
from arrivals.scenarios.simulations import NearField, SourcesOnSphere
from arrivals.scenarios.simulations.line_arrays import complex_normal
from arrivals.symmetric import identity
from arrivals.trackers import SVALSE, VALSE, NewtonSolver
from arrivals.trackers.svalse.newton.batch import Components
from arrivals.trackers.svalse.newton.elbo import evaluate
from arrivals.trackers.svalse.newton.expected_response import ExpectedResponse
from arrivals.trackers.svalse.newton.step import newton_step
from arrivals.typing import Complex, Float

PARTS = ("cost", "near_field", "figures", "merging", "existence")


@dataclass(frozen=True)
class OnePoint(ArraySnapshot):
    """Snapshots whose direction is one unknown of a manifold of points, in place of a series."""

    def manifold(self, reference: Reference = "middle") -> Manifold:
        """Return sin β of a line, or the azimuth of horizontal waves."""
        return sine_line(self.waves) if self.array.dim == 1 else horizontal_waves(self.waves)


def one_point(model: ArraySnapshot) -> OnePoint:
    """Return the same model with its direction as a point."""
    return OnePoint(model.array, model.wavelengths, n_snapshots=model.n_snapshots)


def with_two(model: ArraySnapshot) -> ArraySnapshot:
    """Return the same model with two unknowns a source."""
    return model.replace(unknowns="range" if model.array.dim == 1 else "sphere")


# -- cost -------------------------------------------------------------------------------------


def square(n: int) -> SensorArray:
    """Return n by n sensors, half a metre apart."""
    return SensorArray(np.stack(np.meshgrid(*[0.5 * np.arange(n)] * 2), -1).reshape(-1, 2))


CASES = {
    "line of 16": ArraySnapshot(SensorArray.ula(16, 0.5), 1.0),
    "line of 64": ArraySnapshot(SensorArray.ula(64, 0.5), 1.0),
    "circle of 8": ArraySnapshot(SensorArray.uca(8, 0.65), 1.0),
    "circle of 8, 10 bins": ArraySnapshot(
        SensorArray.uca(8, 0.65), (1 / np.linspace(0.6, 1, 10)).tolist()
    ),
    "circle of 8, 10 snapshots": ArraySnapshot(SensorArray.uca(8, 0.65), 1.0, n_snapshots=10),
    "4 x 4": ArraySnapshot(square(4), 1.0),
    "8 x 8": ArraySnapshot(square(8), 1.0),
}


def scene(model: ArraySnapshot, n_steps: int) -> Complex:
    """Return snapshots of four sources that walk by half a degree a step, at 20 dB."""
    rng, t = np.random.default_rng(0), np.arange(n_steps)[:, None]
    doa = np.deg2rad([-50.0, -15.0, 20.0, 55.0] + t * [0.5, -0.5, 0.5, 0.0])
    shape = (n_steps, *model.shape[:-1], 4)
    w = (rng.standard_normal(shape) + 1j * rng.standard_normal(shape)) / np.sqrt(2)
    return model.replace(noise=0.04).simulate(doa, w, rng)


def run(model: ArraySnapshot, z: Complex) -> tuple[float, float]:
    """Return CPU ms a step, and Newton steps a step."""
    tracker, n = SVALSE(model), 0
    started = time.process_time()
    for y in z:
        tracker.predict()
        tracker.update(y)
        n += tracker.estimate.iterations
    return 1e3 * (time.process_time() - started) / len(z), n / len(z)


def cost(repeats: int, n_steps: int = 30) -> None:
    """CPU of a step: one unknown by a Fourier series and by points, two unknowns; interleaved."""
    print("| array | ms a step, Newton steps: series | one unknown on points | two unknowns | "
          "ratios to the series |\n| --- | --- | --- | --- | --- |")  # fmt: skip
    for name, model in CASES.items():
        z, kinds = scene(model, n_steps), (lambda m: m, one_point, with_two)
        took = np.array([[run(kind(model), z) for kind in kinds] for _ in range(repeats)])
        ms, steps = np.median(took, axis=0).T
        cells = [f"{a:.2f}, {b:.1f}" for a, b in zip(ms, steps, strict=True)]
        print(f"| {name} | {' | '.join(cells)} | {ms[1] / ms[0]:.2f}, {ms[2] / ms[0]:.2f} |")
    for name, model in {"one unknown": CASES["4 x 4"], "two": with_two(CASES["4 x 4"])}.items():
        print(f"{name}: {count_calls(model)} array calls a Newton step")


def count_calls(model: ArraySnapshot) -> int:
    """Return the array calls of one Newton step with the components of a first step."""
    z = scene(model, 1)[0]
    observed = model.observe(z)
    assert observed is not None
    fit = NewtonSolver().solve(observed.snapshots, observed.manifold, None)
    response, on = ExpectedResponse(observed.manifold), fit.active
    components = Components.zeros(1, int(on.sum()), response.chart.layout)
    components.point[0] = fit.theta[on].T
    components.covariance[0] = 0.01 * identity(response.n_unknowns)
    Y = observed.snapshots[None] / np.sqrt((np.abs(observed.snapshots) ** 2).mean())
    given = (Y, np.full((1, model.n_bins), 0.02), np.full((1, model.n_bins), 0.2), np.zeros(1))
    Y, nu, tau, zero = (each.view(Counted) for each in given)
    counted = components.like(components.packed.view(Counted))
    state = evaluate(response, Y, counted, np.array([int(on.sum())]), nu, tau, zero)
    Counted.calls = 0
    newton_step(response, state, np.array([False]))
    return Counted.calls


# -- accuracy ---------------------------------------------------------------------------------

NEAR = {  # directions, degrees, ranges, m, and snapshots
    "20 deg, 0.3 m": ((20.0,), (0.3,), 1),
    "20 deg, 0.5 m": ((20.0,), (0.5,), 1),
    "20 deg, 1 m": ((20.0,), (1.0,), 1),
    "20 deg, 2 m": ((20.0,), (2.0,), 1),
    "20 deg, 5 m": ((20.0,), (5.0,), 1),
    "10 deg, 0.5 and 2 m": ((10.0, 10.0), (0.5, 2.0), 10),
    "10 deg, 0.3 and 3 m": ((10.0, 10.0), (0.3, 3.0), 10),
}


def near_field(trials: int) -> None:
    """Errors of VALSE over the bound, 20 dB, of the trials with the right number of sources."""
    for name, (doa, ranges, n) in NEAR.items():
        scenario = create("near_field", doa_deg=doa, range_m=ranges, n_snapshots=n, n_steps=trials)
        assert isinstance(scenario, NearField)
        trial = scenario.sample(np.random.default_rng(0))
        run = trial.tracker("valse").run(trial.measurements)
        beta, distance = np.deg2rad(doa), np.asarray(ranges)
        w = scenario.amplitudes() * np.exp(
            2j * np.pi * np.random.default_rng(1).random((n, len(doa)))
        )
        w = w if n > 1 else w[0]
        C = range_bound(scenario.measurement, beta, distance, w, 0.01)
        bound = np.sqrt(C[:, [0, 1], [0, 1]])  # of direction and 1/R
        truth, errors = np.stack([beta, 1 / distance], axis=1), []
        for t in np.flatnonzero(run.n_found == len(doa)):
            found = np.stack([run.doa[t], 1 / run.range[t]], axis=1)[: len(doa)]
            error = (found[None] - truth[:, None]) / bound[:, None]
            k = linear_sum_assignment((error**2).sum(axis=2))
            errors.append(error[k])
        share, ratio = len(errors) / trials, np.sqrt(np.mean(np.square(errors), axis=0)).max(axis=0)
        least = 0.95 if len(doa) == 1 else 0.85
        row(f"{name}: right number", f"{share:.2f}", f">= {least}", share >= least)
        for what, each in zip(("direction", "1/R"), ratio, strict=True):
            row(f"{name}: rmse of {what} / bound", f"{each:.2f}", "<= 1.25", bool(each <= 1.25))


def figures(runs: int) -> None:
    """GOSPA of Figs 4 to 6 on points, and with ranges, minus that by a Fourier series."""
    forms = {"one unknown on points": one_point, "ranges": with_two}
    for name in ("svalse_fig4", "svalse_fig5", "svalse_fig6"):
        loss = []
        for seed in range(runs):
            trial = create(name).sample(np.random.default_rng([0, seed]))
            assert isinstance(trial.measurement, ArraySnapshot)
            models = (trial.measurement, *(form(trial.measurement) for form in forms.values()))
            doa = [SVALSE(model).run(trial.measurements).doa for model in models]
            scores = [mean_gospa(np.rad2deg(trial.truth), np.rad2deg(d), 10.0).total for d in doa]
            loss.append(np.subtract(scores[1:], scores[0]))
        for what, each in zip(forms, np.transpose(loss), strict=True):
            verdict = bool(each.mean() <= 0.2) if what == "ranges" else None
            limit = "<= 0.2" if what == "ranges" else ""
            row(f"{name}: loss by {what}", f"{mean_and_error(each)}, median {np.median(each):.2f}",
                limit, verdict)  # fmt: skip


def mean_and_error(values: Float) -> str:
    """Return the mean and its standard error as text."""
    return f"{np.mean(values):.2f} +- {standard_error(values):.2f}"


# -- components on the sphere -----------------------------------------------------------------


def merging(runs: int, trials: int) -> None:
    """Components merged by the distance of one unknown, or by the correlation of responses."""
    scene = SourcesOnSphere()
    cases = [scene.sample(np.random.default_rng(seed)) for seed in range(runs)]
    for method, merge in (("valse", 0.0), ("svalse", np.deg2rad(1.5))):
        solvers = {"distance": NewtonSolver(merge=merge), "correlation": NewtonSolver()}
        for what, solver in solvers.items():
            pairs = [(t, t.tracker(method, solver=solver).run(t.measurements)) for t in cases]
            scores = np.array([gospa_of(*pair).total for pair in pairs])
            text = mean_and_error(scores)
            if method == "svalse":
                changes = sum(label_switches(pairs_of(t, run), run.label) for t, run in pairs)
                text += f", {changes} labels changed"
            row(f"4 x 4, ten snapshots, 20 dB: {method}, by {what}", text, "", None)
    for degrees in (2.0, 3.0, 4.0):
        for what, solver in {
            "distance": NewtonSolver(merge=0),
            "correlation": NewtonSolver(),
        }.items():
            share = np.mean([resolved(degrees, solver, seed) for seed in range(trials)])
            row(f"{degrees:g} deg apart, 30 dB: both found by valse, by {what}", f"{share:.2f}",
                "", None)  # fmt: skip


def resolved(degrees: float, solver: NewtonSolver, seed: int) -> bool:
    """Return whether VALSE finds two sources side by side at 30° of elevation, and no other."""
    model, rng = SourcesOnSphere().measurement, np.random.default_rng(seed)
    elevation = np.deg2rad(30.0)
    doa = np.deg2rad(20.0) + np.array([-0.5, 0.5]) * np.deg2rad(degrees) / np.cos(elevation)
    w = complex_normal(rng, (*model.shape[:-1], 2))
    z = model.replace(noise=2e-3).simulate(doa, w, rng, np.full(2, elevation))
    tracker = VALSE(model, solver=solver)
    tracker.update(z)
    return len(tracker.estimate.doa) == 2


def existence(runs: int) -> None:
    """Share of the components stated to exist by 0.99 and more that are near a source, 0 dB."""
    for array in ("ura4", "sph12"):
        scene = SourcesOnSphere(array, snr_db=0.0)
        for method in ("svalse", "valse"):
            stated, hit = [], []
            for seed in range(runs):
                trial = scene.sample(np.random.default_rng(seed))
                of_run = existence_and_hits(trial, trial.tracker(method).run(trial.measurements))
                stated.append(of_run[0])
                hit.append(of_run[1])
            sure = np.concatenate(stated) >= 0.99
            right = np.concatenate(hit)[sure]
            row(f"{array}, 0 dB, {method}: right of those stated at 0.99 and more",
                f"{right.mean():.2f} of {len(right)}", "", None)  # fmt: skip


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--parts", nargs="*", default=PARTS, choices=PARTS)
    parser.add_argument("--runs", type=int, default=20, help="runs of scenes with motion (20)")
    parser.add_argument("--trials", type=int, default=100, help="trials of one step (100)")
    parser.add_argument("--repeats", type=int, default=5, help="repeats of the times (5)")
    options = parser.parse_args()
    warnings.filterwarnings("ignore", "directions .* are ambiguous")
    if "cost" in options.parts:
        cost(options.repeats)
    print("| what | ours | limit | |\n|---|---|---|---|")
    if "near_field" in options.parts:
        near_field(options.trials)
    if "figures" in options.parts:
        figures(options.runs)
    if "merging" in options.parts:
        merging(options.runs, options.trials)
    if "existence" in options.parts:
        existence(options.runs)


if __name__ == "__main__":
    main()
