"""How states move."""

from arrivals.motion_models.ar_estimation import (
    autocovariance,
    partial_autocorrelation,
    select_order,
    yule_walker,
)
from arrivals.motion_models.autoregressive import AutoregressiveSources
from arrivals.motion_models.base import LinearMotionModel, MotionModel
from arrivals.motion_models.bernoulli_von_mises import BernoulliVonMises
from arrivals.motion_models.bessel import (
    bessel_ratio,
    bessel_ratios,
    inverse_bessel_ratio,
    log_bessel_ratio,
    log_i0,
)
from arrivals.motion_models.combined import CombinedMotion
from arrivals.motion_models.coordinated_turn import CoordinatedTurn
from arrivals.motion_models.delay import DelayDrift, DelayWalk
from arrivals.motion_models.direction_amplitude import DirectionAmplitudeWalk
from arrivals.motion_models.function import FunctionMotion
from arrivals.motion_models.linear import ConstantVelocity, LinearMotion, RandomWalk
from arrivals.motion_models.von_mises import (
    VonMisesWalk,
    log_density,
    mfold_concentration,
    mfold_modes,
    product,
    wrap,
)

__all__ = [
    "AutoregressiveSources",
    "BernoulliVonMises",
    "ConstantVelocity",
    "CoordinatedTurn",
    "DelayDrift",
    "DelayWalk",
    "DirectionAmplitudeWalk",
    "FunctionMotion",
    "LinearMotion",
    "LinearMotionModel",
    "MotionModel",
    "RandomWalk",
    "CombinedMotion",
    "VonMisesWalk",
    "autocovariance",
    "bessel_ratio",
    "bessel_ratios",
    "inverse_bessel_ratio",
    "log_bessel_ratio",
    "log_density",
    "log_i0",
    "mfold_concentration",
    "mfold_modes",
    "partial_autocorrelation",
    "product",
    "select_order",
    "wrap",
    "yule_walker",
]
