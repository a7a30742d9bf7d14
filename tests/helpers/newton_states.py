"""States of the Newton solver near a solution."""

import numpy as np
from numpy.typing import ArrayLike

from arrivals.measurement_models import ArraySnapshot, SensorArray
from arrivals.trackers.svalse.components import ComponentPrior
from arrivals.trackers.svalse.newton.elbo import (
    KL_CONSTANT,
    MU,
    N_FACTS,
    ODDS,
    PRIOR_KAPPA,
    PRIOR_MU,
    Evaluation,
    S,
    evaluate,
)
from arrivals.trackers.svalse.newton.expected_response import ExpectedResponse
from arrivals.trackers.svalse.svalse import SVALSE
from arrivals.typing import Complex, Float

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
    facts = np.zeros((1, N_FACTS, K))
    facts[0, MU] = model.manifold().from_doa(doa) + 0.03 * rng.standard_normal(K)
    facts[0, S] = rng.uniform(5e-4, 3e-3, K)
    facts[0, PRIOR_MU] = facts[0, MU] + 0.1
    facts[0, PRIOR_KAPPA] = np.where(np.arange(K) % 2, 120.0, 0.0)
    facts[0, KL_CONSTANT] = np.log(2 * np.pi * np.i0(facts[0, PRIOR_KAPPA]))
    facts[0, ODDS] = np.where(np.arange(K) % 2, np.log(3.0), -2.2)
    return with_facts(ExpectedResponse(model.manifold()), unit(y)[None, None, :, None], facts)


def with_facts(
    response: ExpectedResponse, y: Complex, facts: Float, nu: float = 0.01, tau: float = 0.2
) -> Evaluation:
    K = np.array([facts.shape[2]])
    return evaluate(response, y, facts, K, np.array([[nu]]), np.array([[tau]]), np.zeros(1))
