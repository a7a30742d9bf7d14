"""Sound in a rectangular room: image sources, speech-like signals and diffuse noise."""

from arrivals.scenarios.room_acoustics.diffuse_noise import diffuse_noise
from arrivals.scenarios.room_acoustics.image_sources import Shoebox, convolve_moving, delay_and_add
from arrivals.scenarios.room_acoustics.speech_signals import activity, speech_like, utterances

__all__ = [
    "Shoebox",
    "activity",
    "convolve_moving",
    "delay_and_add",
    "diffuse_noise",
    "speech_like",
    "utterances",
]
