"""Figs 1 and 3: sketch of a network, and the graph of the model, from the models themselves."""

from __future__ import annotations

from dataclasses import fields
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from arrivals.measurement_models import LogNormalRSS, neper_to_db
from arrivals.plots.colours import PALETTE
from arrivals.plots.labels import legend_below
from arrivals.scenarios.simulations.signal_strength import RSSTrial
from arrivals.trackers.rss.inference.joint_posterior import JointPosterior, Prior

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

LABEL = {"facecolor": "white", "edgecolor": "none", "alpha": 0.9, "pad": 1.0}
KNOWN, LATENT, OBSERVED = "known", "latent", "observed"
SYMBOLS = {
    "mu": "μ₀", "w": "v₀", "theta": "θ₀", "P": "Σ₀", "sensors": "ζ", "log_noise": "σₙ",
    "alpha": "α", "sigma": "N",
}  # fmt: skip


class Node(NamedTuple):
    """A node of the graph: symbol, kind, place, and the nodes it depends on."""

    symbol: str
    kind: str
    place: tuple[float, float]
    parents: tuple[str, ...] = ()


def model_graph() -> dict[str, Node]:
    """Return the nodes of the model: those of `Prior` and of `LogNormalRSS` that are known.

    Examples
    --------
    >>> [name for name, node in model_graph().items() if node.kind != KNOWN]
    ['u_j', 'theta_j', 'xi_i']
    """
    mu, w, theta, P = Prior._fields
    parameters = {field.name for field in fields(LogNormalRSS)}
    of_sensors = [name for name in ("sensors", "log_noise", "alpha", "sigma") if name in parameters]
    nodes = {
        name: Node(SYMBOLS[name], KNOWN, (x, 2.6))
        for name, x in zip((mu, w, theta, P), (0.0, 1.0, 2.4, 3.4), strict=True)
    }
    nodes |= {name: Node(SYMBOLS[name], KNOWN, (4.6, 1.35 - 0.75 * n))
              for n, name in enumerate(of_sensors)}  # fmt: skip
    nodes["u_j"] = Node("σⱼ", LATENT, (0.5, 1.6), (mu, w))
    nodes["theta_j"] = Node("θⱼ", LATENT, (2.9, 1.6), (theta, P))
    nodes["xi_i"] = Node("ξᵢ", OBSERVED, (1.7, -0.2), ("u_j", "theta_j", *of_sensors))
    return nodes


def draw_graph(trial: RSSTrial) -> Figure:
    """Draw the network of a trial with one triangle, and the graph of its model."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(12.0, 5.4), layout="constrained")
    network, graph = figure.subplots(1, 2, width_ratios=[1, 1.1])
    _draw_network(network, trial)
    _draw_nodes(graph, len(trial.truth[0]), len(trial.measurement.sensors))
    return figure


def _draw_network(ax: Axes, trial: RSSTrial) -> None:
    model, truth = trial.measurement, trial.truth[0]
    level = neper_to_db(trial.measurements[0])
    x, y = model.sensors.T
    shown = ax.scatter(x, y, s=28, c=level, cmap="viridis", label="sensor")
    ax.figure.colorbar(shown, ax=ax, label="reading ξ, dB")
    ax.plot(*truth.T, "*", color=PALETTE[1], markersize=15, label="source")
    source = truth[0]
    distance = np.hypot(*(model.sensors - source).T)
    i = int(np.argsort(distance)[len(distance) // 4])
    sensor = model.sensors[i]
    ax.annotate("", sensor, source, arrowprops={"arrowstyle": "<->", "color": "0.2"})
    along = (sensor - source) / distance[i]
    beside = 9.0 * np.array([-along[1], along[0]])  # m, off the arrow
    centre = 0.5 * (sensor + source)
    place = max((centre + beside, centre - beside),
                key=lambda at: np.hypot(*(model.sensors - at).T).min())  # fmt: skip
    ax.text(place[0], place[1], f"R = {distance[i]:.0f} m", fontsize=9, zorder=5,
            ha="center", va="center", bbox=LABEL)  # fmt: skip
    for radius in (distance[i] / 3, 2 * distance[i] / 3, distance[i]):
        phi = np.linspace(0, 2 * np.pi, 200)
        ax.plot(source[0] + radius * np.cos(phi), source[1] + radius * np.sin(phi), "--",
                color="0.7", linewidth=0.8, zorder=0)  # fmt: skip
    v = source + np.array([22.0, -12.0])
    ax.annotate("", v, source, arrowprops={"arrowstyle": "->", "color": PALETTE[1], "lw": 1.6})
    ax.text(v[0] + 1.5, v[1] + 1.5, "v", fontsize=11, color=PALETTE[1])
    ax.set(xlabel="x, m", ylabel="y, m", title="Fig. 1: sources, wavefronts and sensors")
    ax.set_aspect("equal")
    legend_below(ax, 2)


def _draw_nodes(ax: Axes, n_sources: int, n_sensors: int) -> None:
    from matplotlib.patches import FancyBboxPatch

    nodes = model_graph()
    for node in nodes.values():
        for parent in node.parents:
            ax.annotate("", node.place, nodes[parent].place, zorder=1, arrowprops={
                "arrowstyle": "-|>", "color": "0.35", "shrinkA": 20 if nodes[parent].kind != KNOWN
                else 4, "shrinkB": 22})  # fmt: skip
    for node in nodes.values():
        x, y = node.place
        if node.kind == KNOWN:
            ax.plot(x, y, "o", color="k", markersize=5)
            ax.text(x + 0.1, y + 0.1, node.symbol, fontsize=11)
        else:
            fill = "0.8" if node.kind == OBSERVED else "white"
            ax.plot(x, y, "o", markersize=34, markerfacecolor=fill, markeredgecolor="k", zorder=2)
            ax.text(x, y, node.symbol, ha="center", va="center", fontsize=9, zorder=3)
    for (x, y, width, height), style, label in (
        ((-0.4, 1.05, 4.1, 1.1), "-", f"j = 1 .. K = {n_sources}"),
        ((1.05, -0.75, 1.3, 1.1), "--", f"i = 1 .. M = {n_sensors}"),
    ):
        ax.add_patch(FancyBboxPatch((x, y), width, height, boxstyle="round,pad=0.05", fill=False,
                                    linestyle=style))  # fmt: skip
        ax.text(x, y - 0.22, label, fontsize=9)
    ax.text(-0.6, -1.15, "σⱼ log-normal, θⱼ Gaussian; ξᵢ ~ N(log σ of sensor i, 1/4N)", fontsize=9)
    ax.set(xlim=(-0.7, 5.2), ylim=(-1.2, 3.1), title="Fig. 3: graph of the model")
    ax.set_axis_off()


def separable(problem: JointPosterior, u_step: float, theta_step: float) -> bool:
    """Return True if the posterior of one source's power and position factorises at the prior.

    Examples
    --------
    >>> from arrivals.scenarios import create
    >>> from arrivals.scenarios.reproduce.rss.trials import draws
    >>> separable(draws(create("rss_table1_k3"), 1, 0).problem, 0.1, 1.0)
    False
    """
    u, theta = problem.prior.mu, problem.prior.theta
    du, dtheta = np.zeros_like(u), np.zeros_like(theta)
    du[..., 0], dtheta[..., 0, 0] = u_step, theta_step
    L = problem.log_posterior
    mixed = L(u + du, theta + dtheta) - L(u + du, theta) - L(u, theta + dtheta) + L(u, theta)
    return bool(np.abs(mixed).max() < 1e-9)
