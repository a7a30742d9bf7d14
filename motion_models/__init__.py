"""Motion models: change of a state from one measurement to the next."""

from arrivals.motion_models.autoregressive.estimation import select_order, yule_walker
from arrivals.motion_models.autoregressive.sources import AutoregressiveSources
from arrivals.motion_models.base import LinearMotionModel, MotionModel
from arrivals.motion_models.bernoulli_von_mises import BernoulliVonMises
from arrivals.motion_models.combined import CombinedMotion
from arrivals.motion_models.coordinated_turn import CoordinatedTurn
from arrivals.motion_models.delay import DelayDrift, DelayWalk
from arrivals.motion_models.direction_amplitude import DirectionAmplitudeWalk
from arrivals.motion_models.function import FunctionMotion
from arrivals.motion_models.linear import ConstantVelocity, LinearMotion, RandomWalk
from arrivals.motion_models.move_stop import MoveStopWalk
from arrivals.motion_models.von_mises import VonMisesWalk, wrap
from arrivals.motion_models.von_mises_fisher import VonMisesFisherWalk

__all__ = [
    "MotionModel",
    "LinearMotionModel",
    # positions
    "RandomWalk",
    "ConstantVelocity",
    "CoordinatedTurn",
    # directions
    "VonMisesWalk",
    "VonMisesFisherWalk",
    "BernoulliVonMises",
    "MoveStopWalk",
    "DirectionAmplitudeWalk",
    "wrap",
    # delays between sensors
    "DelayWalk",
    "DelayDrift",
    # signals
    "AutoregressiveSources",
    "select_order",
    "yule_walker",
    # models from parts
    "LinearMotion",
    "FunctionMotion",
    "CombinedMotion",
]
