"""States of the Newton solver near a solution."""

import numpy as np
from numpy.typing import ArrayLike

from arrivals.measurement_models import ArraySnapshot, SensorArray
from arrivals.motion_models.bessel import log_i0
from arrivals.trackers.svalse.components import ComponentPosterior, ComponentPrior
from arrivals.trackers.svalse.newton.batch import Components
from arrivals.trackers.svalse.newton.elbo import Evaluation, evaluate
from arrivals.trackers.svalse.newton.expected_response import ExpectedResponse
from arrivals.trackers.svalse.newton.problems import log_odds
from arrivals.trackers.svalse.svalse import SVALSE
from arrivals.typing import Complex

MODEL = ArraySnapshot(SensorArray.ula(15, spacing=0.5), wavelength=1.0)


def prior_of(tracker: SVALSE, z: ArrayLike) -> ComponentPrior:
    """Return the prior of the tracker's next step."""
    observed = tracker.observe(z)
    assert observed is not None
    return tracker.component_prior(observed)


def unit(y: Complex) -> Complex:
    return np.asarray(y / np.sqrt((np.abs(y) ** 2).mean(axis=-1, keepdims=True)))


def scene(seed: int, model: ArraySnapshot = MODEL, K: int = 5) -> Evaluation:
    """Five sources at 20 dB, components beside them, half of which have a prior."""
    rng = np.random.default_rng(seed)
    doa = np.linspace(-1.1, 1.0, K) + rng.uniform(-0.1, 0.1, K)
    y = model.replace(noise=K / 100).simulate(doa, np.exp(2j * np.pi * rng.random(K)), rng)
    components = Components.zeros(1, K)
    components.mu[0] = model.angle_manifold().from_doa(doa) + 0.03 * rng.standard_normal(K)
    components.variance[0] = rng.uniform(5e-4, 3e-3, K)
    components.prior_mu[0] = components.mu[0] + 0.1
    components.prior_kappa[0] = np.where(np.arange(K) % 2, 120.0, 0.0)
    components.kl_constant[0] = np.log(2 * np.pi * np.i0(components.prior_kappa[0]))
    components.log_odds[0] = np.where(np.arange(K) % 2, np.log(3.0), -2.2)
    response = ExpectedResponse(model.angle_manifold())
    return evaluation_of(response, unit(y)[None, None, :, None], components)


def evaluation_of(
    response: ExpectedResponse,
    y: Complex,
    components: Components,
    nu: float = 0.01,
) -> Evaluation:
    K = np.array([components.mu.shape[1]])
    return evaluate(response, y, components, K, np.array([[nu]]), np.array([[0.2]]), np.zeros(1))


def active_components(prior: ComponentPrior, posterior: ComponentPosterior) -> Components:
    """Return the active components of a posterior, one at least, with their priors."""
    on = np.flatnonzero(posterior.active)
    components = Components.zeros(1, max(len(on), 1))
    components.kl_constant[:] = np.log(2 * np.pi)
    components.log_odds[:] = log_odds(np.array(prior.birth))
    components.mu[0, : len(on)] = posterior.theta[on]
    components.variance[0, : len(on)] = 1 / posterior.kappa[on]
    for i, k in enumerate(on):
        if k < len(prior.mu):
            components.prior_mu[0, i], components.prior_kappa[0, i] = prior.mu[k], prior.kappa[k]
            components.kl_constant[0, i] += log_i0(prior.kappa[k])
            components.log_odds[0, i] = log_odds(prior.existence[k])
    return components
