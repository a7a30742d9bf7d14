"""Forms of VALSE and SVALSE: ours, the paper's with exact integration, and as printed.

Ours take joint Newton steps, count phases from the middle of the array, and have a walk in
direction that may stand still. The paper's form has coordinate ascent to a tolerance of 1e-6, the
first sensor as phase reference, and a walk in the electrical angle; the densities of the angles are
integrated by quadrature. As printed, they are mixtures of von Mises densities, (38)-(48), which
takes several times as long.
"""

from __future__ import annotations

from typing import Any

from arrivals.motion_models import BernoulliVonMises
from arrivals.scenarios.experiments.methods import Method, methods
from arrivals.trackers import CoordinateSolver, NewtonSolver

FAST = ("cbf", "peaks_gnn", "sbl", "ssbl", "valse", "svalse")
PAPER_FORM = {"valse": "valse paper's form", "svalse": "svalse paper's form"}
AS_PRINTED = {"valse": "valse as printed", "svalse": "svalse as printed"}
PRINTED_7D = "p_d 0.25, p_a 1 as printed, run 0"
UNMERGED_7D = "p_d 0.25, p_a 1 without merging, run 0"
NAN = float("nan")
FORMS = (
    "Paper's form: coordinate ascent to a tolerance of 1e-6, the first sensor as phase reference, "
    "a walk in the electrical angle; angles by quadrature, at most 1000 iterations (2000). As "
    "printed: the same by mixtures (38)-(48), at most 5000 iterations (VALSE 2000), and a "
    "probability of 0.5 in the first step. Ours: joint Newton steps, a phase reference in the "
    "middle, and a walk of 1.5 degrees in direction that may stand still."
)
FORMS_SEEN = (
    "Paper's form and as printed: the forms of VALSE and SVALSE are described under Fig. 4."
)
STARTS = (3.0, 20.0, 40.0)  # SNR from which the noise of VALSE starts, dB: high, the paper's, low


def quadrature(max_iterations: int) -> dict[str, Any]:
    """Return the parameters of the paper's form, with angles by quadrature."""
    solver = CoordinateSolver(tolerance=1e-6, max_iterations=max_iterations)
    return {"solver": solver, "reference": "first"}


def svalse_paper_form(label: str, max_iterations: int = 1000, **probabilities: float) -> Method:
    """Return SVALSE in the paper's form, with these probabilities of birth and death.

    Examples
    --------
    >>> svalse_paper_form("no deaths", p_deactivate=0.0).params["motion"].walk.kappa
    148.0
    """
    motion = BernoulliVonMises(**probabilities)
    return Method("svalse", quadrature(max_iterations) | {"motion": motion}, label)


def valse_paper_form() -> Method:
    """Return VALSE in the paper's form."""
    return Method("valse", quadrature(2000), PAPER_FORM["valse"])


def start_label(snr_db: float, ours: bool) -> str:
    """Return the label of VALSE whose noise starts at this SNR, in the paper's form or ours.

    Examples
    --------
    >>> start_label(20, ours=False)
    'valse from 20 dB'
    """
    return f"valse {'by ours ' if ours else ''}from {snr_db:g} dB"


def started_at(snr_db: float, ours: bool) -> Method:
    """Return VALSE whose noise starts at this SNR, in the paper's form or ours."""
    params = {"solver": NewtonSolver()} if ours else quadrature(2000)
    solver = params["solver"].replace(snr_db=snr_db)
    return Method("valse", params | {"solver": solver}, start_label(snr_db, ours))


def svalse_as_printed(label: str = AS_PRINTED["svalse"], **probabilities: float) -> Method:
    """Return SVALSE as printed, with these probabilities of birth and death.

    Examples
    --------
    >>> svalse_as_printed().params["solver"].first_existence
    0.5
    """
    params = {"solver": CoordinateSolver.paper(first_existence=0.5), "reference": "first"}
    return Method("svalse", params | {"motion": BernoulliVonMises(**probabilities)}, label)


def unmerged_7d() -> Method:
    """Return the paper's form of Fig. 7(d) without merging, which the paper does not mention."""
    method = svalse_paper_form(UNMERGED_7D, p_activate=1.0)
    solver = method.params["solver"].replace(merge=0.0)
    return Method("svalse", {**method.params, "solver": solver}, UNMERGED_7D)


def valse_as_printed() -> Method:
    """Return VALSE as printed: every step is a first one (section VI.B).

    Examples
    --------
    >>> valse_as_printed().params["solver"].first_existence
    0.5
    """
    solver = CoordinateSolver.paper(first_existence=0.5).replace(max_iterations=2000)
    return Method("valse", {"solver": solver, "reference": "first"}, AS_PRINTED["valse"])


def activation_label(death: float, birth: float) -> str:
    """Return the label of SVALSE with these probabilities.

    Examples
    --------
    >>> activation_label(0.25, 1.0)
    'p_d 0.25, p_a 1'
    """
    return f"p_d {death:g}, p_a {birth:g}"


def table_methods(quick: bool) -> list[Method]:
    """Return the methods of the tables; the paper's forms take ten times as long.

    Examples
    --------
    >>> [method.label for method in table_methods(quick=False)][-2:]
    ["valse paper's form", "svalse paper's form"]
    """
    return methods(FAST if quick else (*FAST, *paper_forms()))


def paper_forms() -> list[Method]:
    """Return VALSE and SVALSE in the paper's form.

    Examples
    --------
    >>> [method.label for method in paper_forms()]
    ["valse paper's form", "svalse paper's form"]
    """
    return [valse_paper_form(), svalse_paper_form(PAPER_FORM["svalse"])]


def batch_of(runs: int) -> int:
    """Return the number of runs in a batch: eight batches or more for a few processes.

    Examples
    --------
    >>> batch_of(2), batch_of(20), batch_of(1000)
    (1, 2, 16)
    """
    return min(max(1, runs // 8), 16)
