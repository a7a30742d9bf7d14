"""Motion of the delay between neighbouring sensors."""

from dataclasses import dataclass, field

from arrivals.motion_models.linear import ConstantVelocity, RandomWalk


@dataclass(frozen=True)
class DelayWalk(RandomWalk):
    """An inter-sensor delay that drifts by white noise: state [Δ].

    Parameters
    ----------
    q : float
        Variance gained per unit of time; 0 for a source at rest.

    Notes
    -----
    Units: delays in samples; `q` in samples² per snapshot.

    Examples
    --------
    >>> DelayWalk(q=1e-4).Q()
    array([[0.0001]])
    """

    q: float = 0.0
    n_dims: int = field(default=1, init=False)

    @property
    def state_names(self) -> tuple[str, ...]:
        """The name delay."""
        return ("delay",)


@dataclass(frozen=True)
class DelayDrift(ConstantVelocity):
    """An inter-sensor delay that grows at a slowly changing rate: state [Δ, Δ'].

    Parameters
    ----------
    q : float
        Variance that the rate gains per unit of time.

    Notes
    -----
    Units: delays in samples, rates in samples per snapshot. `q` of 1e-9 to 1e-8 suits a source
    that crosses the array's field of view in some hundreds of snapshots.

    Examples
    --------
    >>> DelayDrift(q=6.0).Q()
    array([[2., 3.],
           [3., 6.]])
    """

    q: float = 1e-9
    n_dims: int = field(default=1, init=False)

    @property
    def state_names(self) -> tuple[str, ...]:
        """delay, delay_rate."""
        return "delay", "delay_rate"
