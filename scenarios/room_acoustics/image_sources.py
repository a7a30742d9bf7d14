"""Impulse responses of a rectangular room by the image-source method."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from arrivals.messages import shown
from arrivals.parameters import FrozenModel
from arrivals.scenarios.room_acoustics.diffuse_noise import sphere
from arrivals.typing import Float, Int
from arrivals.validation import count, not_negative, positive, real, shaped

HALF_WIDTH = 20  # samples: half of the windowed sinc of a fractional delay
MAX_ORDER = 200  # 10.7 million images
MAX_BLOCK = 2**22  # samples of pulses that are added together: 32 MB
N_DIRECTIONS = 500  # of a mean over the sphere


@dataclass(frozen=True)
class Shoebox(FrozenModel):
    """Rectangular room from the origin to `size`, with the same absorption on all walls.

    Parameters
    ----------
    size : (float, float, float)
        Edges, m.
    rt60 : float
        Reverberation time, s: three times that of the decay from -5 to -25 dB (T20 of ISO 3382);
        0 for no walls.
    order : int
        Largest number of reflections of a path. A low one shortens the response: paths of n
        reflections have a mean length of n times 4 volume / surface.
    speed : float
        Speed of sound, m/s.

    References
    ----------
    Allen and Berkley, "Image method for efficiently simulating small-room acoustics", JASA 65(4),
    1979; Lehmann and Johansson, "Prediction of energy decay in room impulse responses simulated
    with an image-source model", JASA 124(1), 2008 (mean over directions).

    Examples
    --------
    >>> room = Shoebox((6.0, 5.0, 2.8), rt60=0.25)
    >>> round(room.reflection, 3), Shoebox((6.0, 5.0, 2.8)).reflection
    (0.764, 0.0)
    """

    size: Sequence[float]
    rt60: float = 0.0
    order: int = 10
    speed: float = 343.0

    def __post_init__(self) -> None:
        size = tuple(positive("size", edge) for edge in shaped("size", self.size, 3).tolist())
        object.__setattr__(self, "size", size)
        not_negative("rt60", self.rt60)
        count("order", self.order, minimum=0, maximum=MAX_ORDER)
        positive("speed", self.speed)

    @property
    def reflection(self) -> float:
        """Reflection coefficient of the pressure at a wall.

        In the direction u a path has n = |u_x| / L_x + |u_y| / L_y + |u_z| / L_z reflections a
        metre; so the images of a time t = d / c have the mean energy E r^(2 n c t), over u.
        Walls of equal absorption in a room that is not a cube decay more slowly than by Eyring's
        formula, which assumes one n.
        """
        if self.rt60 == 0:
            return 0.0
        n = np.abs(sphere(N_DIRECTIONS)) @ (1 / np.asarray(self.size))
        s = np.linspace(0, 60, 600) / n.mean() / 4.34  # nepers a reflection times metres
        # Schroeder's integral: ∫ exp(-s n) ds
        level = 10 * np.log10((np.exp(-s[:, None] * n) / n).mean(axis=1) / np.mean(1 / n))
        start, end = np.interp([5.0, 25.0], -level, s)
        # rt60 = 3 (t_25 - t_5),  s = -2 ln(r) c t
        return float(np.exp(-3 * (end - start) / (2 * self.speed * self.rt60)))

    def images(self, source: ArrayLike) -> tuple[Float, Int]:
        """Return the image sources of at most `order` reflections, nearest orders first.

        Parameters
        ----------
        source : array_like, shape (3,)
            Position, m, in the room.

        Returns
        -------
        positions : ndarray, shape (n_images, 3)
            Positions, m; the first is the source.
        reflections : ndarray of int, shape (n_images,)
            Numbers of reflections.

        Raises
        ------
        ValueError
            If the source lies outside the room.

        Examples
        --------
        >>> positions, reflections = Shoebox((4.0, 5.0, 3.0), 0.3, order=1).images([1.0, 1.0, 1.0])
        >>> len(positions), reflections, positions[np.argmax(positions[:, 0])]
        (7, array([0, 1, 1, 1, 1, 1, 1]), array([7., 1., 1.]))
        """
        source, size = self.inside("source", source), np.asarray(self.size)
        order = self.order if self.rt60 else 0
        each = np.arange(-order, order + 1)
        k = np.stack(np.meshgrid(each, each, each, indexing="ij"), axis=-1).reshape(-1, 3)
        reflections = np.abs(k).sum(axis=1)
        nearest = np.argsort(reflections, kind="stable")[: np.sum(reflections <= order)]
        k, reflections = k[nearest], reflections[nearest]
        # image k on an axis: k L + s for even k, k L + (L - s) for odd k
        return np.where(k % 2 == 0, k * size + source, (k + 1) * size - source), reflections

    def inside(self, name: str, positions: ArrayLike) -> Float:
        """Return positions (..., 3), m, or raise a ValueError if one lies outside the room."""
        p = real(name, positions)
        if p.shape[-1:] != (3,) or not ((p >= 0) & (p <= np.asarray(self.size))).all():
            room = " x ".join(f"{edge:g}" for edge in self.size)
            raise ValueError(
                f"{name} must lie in the room of {room} m, (..., 3); got {shown(positions)}"
            )
        return p

    def response(self, source: ArrayLike, sensors: ArrayLike, rate: float) -> Float:
        """Return the impulse responses from a source to sensors.

        A path of length d and n reflections has the delay d / c and the gain rⁿ / d: 1 at 1 m.

        Parameters
        ----------
        source : array_like, shape (3,)
            Position, m.
        sensors : array_like, shape (n_sensors, 3)
            Positions, m.
        rate : float
            Samples per second, Hz.

        Returns
        -------
        ndarray, shape (n_samples, n_sensors)
            Responses from time 0 on.

        Raises
        ------
        ValueError
            If a position lies outside the room.

        Examples
        --------
        >>> h = Shoebox((6.0, 5.0, 2.8)).response([1, 2, 1.5], [[4.43, 2, 1.5]], rate=16000.0)
        >>> h.shape, int(np.argmax(h)), round(float(h.max()), 4)  # 160 samples, 1 / 3.43 m
        ((181, 1), 160, 0.2915)
        """
        positions, reflections = self.images(source)
        sensors = self.inside("sensors", np.atleast_2d(np.asarray(sensors)))
        d = np.linalg.norm(sensors - positions[:, None], axis=-1)
        gain = self.reflection ** reflections[:, None] / np.maximum(d, 1e-3)
        return delay_and_add(d * (positive("rate", rate) / self.speed), gain)


def delay_and_add(delay: ArrayLike, gain: ArrayLike) -> Float:
    """Return the sum of delayed unit pulses as band-limited samples, by a Hann-windowed sinc.

    Parameters
    ----------
    delay : array_like, shape (n_pulses, n_channels)
        Delays, samples, not negative; the part of a pulse before time 0 is cut off.
    gain : array_like, shape (n_pulses, n_channels)
        Amplitudes.

    Returns
    -------
    ndarray, shape (n_samples, n_channels)
        Samples from time 0 to 20 samples after the last pulse.

    Examples
    --------
    >>> delay_and_add([[2.0], [3.0]], [[1.0], [-0.5]])[:5, 0].round(6) + 0.0
    array([ 0. ,  0. ,  1. , -0.5,  0. ])
    """
    delay, gain = np.asarray(delay, dtype=np.float64), np.asarray(gain, dtype=np.float64)
    n_pulses, n_channels = delay.shape
    taps = np.arange(2 * HALF_WIDTH + 1)
    n_samples = int(np.round(delay.max())) + HALF_WIDTH + 1
    total = np.zeros(n_samples * n_channels)
    n_block = max(1, MAX_BLOCK // (len(taps) * n_channels))
    for i in range(0, n_pulses, n_block):
        d, g = delay[i : i + n_block], gain[i : i + n_block]
        t = taps - HALF_WIDTH + (np.round(d) - d)[..., None]  # from the pulse, in (-21, 21)
        pulse = g[..., None] * np.sinc(t) * np.cos(np.pi * t / (2 * HALF_WIDTH + 2)) ** 2
        index = (np.round(d).astype(np.int64) - HALF_WIDTH)[..., None] + taps
        flat, kept = index * n_channels + np.arange(n_channels)[:, None], index >= 0
        total += np.bincount(flat[kept], pulse[kept], minlength=len(total))
    return np.asarray(total.reshape(n_samples, n_channels))


def convolve_moving(signal: Float, responses: Sequence[Float]) -> Float:
    """Return a signal at the sensors from a source that passes places at equal intervals.

    Between two places the signal is cross-faded from the one response to the other.

    Parameters
    ----------
    signal : ndarray, shape (n_samples,)
        Signal of the source.
    responses : sequence of ndarray, each of shape (n_taps, n_sensors)
        Responses from each place, the first at the start and the last at the end of the signal;
        one alone for a static source.

    Returns
    -------
    ndarray, shape (n_samples, n_sensors)
        Received signals.

    Examples
    --------
    >>> now, late = np.array([[1.0], [0.0]]), np.array([[0.0], [1.0]])
    >>> convolve_moving(np.ones(4), [now]).round(9)[:, 0]
    array([1., 1., 1., 1.])
    >>> convolve_moving(np.ones(3), [now, late]).round(9)[:, 0] + 0.0  # fading by 1, 1/2, 0
    array([1. , 0.5, 0.5])
    """
    from scipy.signal import oaconvolve

    n = len(signal)
    received = np.zeros((n, responses[0].shape[1]))
    at = np.linspace(0, n - 1, len(responses))
    for k, response in enumerate(responses):
        ends = at[max(k - 1, 0)], at[min(k + 1, len(at) - 1)]
        first, last = (0, n) if len(at) == 1 else (int(np.ceil(ends[0])), int(ends[1]) + 1)
        weight = np.interp(np.arange(first, last), at, np.arange(len(at)) == k)
        part = oaconvolve((signal[first:last] * weight)[:, None], response, axes=0)[: n - first]
        received[first : first + len(part)] += part
    return received
