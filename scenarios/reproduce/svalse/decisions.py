"""Functions that decide the claims on SVALSE, from values by metric, method, case and run."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any, TypeAlias

import numpy as np

from arrivals.scenarios.experiments.statistics import standard_error
from arrivals.scenarios.experiments.study import Study
from arrivals.scenarios.reproduce.decisions import Both, Decide, Decision, below, negative
from arrivals.scenarios.reproduce.svalse.forms import (
    PAPER_FORM,
    PRINTED_7D,
    STARTS,
    UNMERGED_7D,
    activation_label,
    start_label,
)
from arrivals.scenarios.reproduce.svalse.published_values import ACTIVATION
from arrivals.typing import Float

# By (metric, method, case), one value a run, NaN where it is missing; the case of a study with a
# single one is ""
Results: TypeAlias = Mapping[tuple[str, str, str], Float]
MIN_RUNS = 5  # for a deviation over runs
LOW, HIGH = ("0", "5"), ("30", "35", "40")  # cases of Figs 8 and 9: SNR, dB
OFF_GRID = tuple(f"{snr} off grid" for snr in (HIGH[0], HIGH[-1]))
ALL = tuple(f"{n}: {snr}" for n in (1, 2) for snr in range(0, 45, 5))  # cases of Fig. 10
PANELS = tuple(activation_label(*pair) for pair in ACTIVATION)[:4]
PANEL_GOSPA = {activation_label(*pair): known.paper for pair, known in ACTIVATION.items()}
PANEL_RMSE = {activation_label(*pair): known.paper_rmse for pair, known in ACTIVATION.items()}
DEFAULT = activation_label(0.25, 0.10)
TITLES = {"cbf": "CBF", "sbl": "SBL", "ssbl": "SSBL", "valse": "VALSE", "svalse": "SVALSE",
          "peaks_gnn": "tracked beam peaks"}  # fmt: skip


def of_scenario(number: int, cases: Sequence[str]) -> tuple[str, ...]:
    """Return cases of Figs 8 or 9 by their names in Fig. 10.

    Examples
    --------
    >>> of_scenario(2, LOW)
    ('2: 0', '2: 5')
    """
    return tuple(f"{number}: {case}" for case in cases)


def results_of(study: Study, *more: Study) -> dict[tuple[str, str, str], Float]:
    """Return the results of studies of the same runs.

    Examples
    --------
    >>> from arrivals.scenarios import monte_carlo
    >>> study = monte_carlo("svalse_fig6", ["cbf"], runs=2, metrics=["gospa"])
    >>> list(results_of(study))
    [('gospa', 'cbf', ''), ('cpu_ms', 'cbf', '')]
    """
    results: dict[tuple[str, str, str], Float] = {}
    for one in (study, *more):
        index = {run: n for n, run in enumerate(one.runs)}
        for row in one.rows():
            case = row.case if len(one.cases) > 1 else ""
            key = row.metric, row.method, case
            results.setdefault(key, np.full(len(index), np.nan))[index[row.run]] = row.value
    return results


def values(results: Results, metric: str, method: str, cases: Sequence[str]) -> Float | None:
    """Return the mean over cases of every run; None if a case or the method was left out."""
    found = [results.get((metric, method, case)) for case in cases]
    given = [one for one in found if one is not None]
    return np.mean(given, axis=0) if len(given) == len(found) else None


def paper_form(method: str) -> str:
    """Return the label of the paper's form of VALSE and SVALSE, and that of others unchanged.

    Examples
    --------
    >>> paper_form("svalse"), paper_form("sbl")
    ("svalse paper's form", 'sbl')
    """
    return PAPER_FORM.get(method, method)


def by_both(decide: Callable[..., Decision | None], *methods: str, **options: Any) -> Both:
    """Return a function that decides by the paper's form of the methods, and one by ours."""
    return (
        partial(decide, *map(paper_form, methods), **options),
        partial(decide, *methods, **options),
    )


def lower(metric: str, first: str, second: str, *cases: str, unit: str = "degrees") -> Both:
    """Decide that a metric of one method is below that of another, on average over the cases."""
    return by_both(_lower, first, second, metric=metric, cases=cases or ("",), unit=unit)


def _lower(
    first: str, second: str, results: Results, *, metric: str, cases: Sequence[str], unit: str
) -> Decision | None:
    low, high = (values(results, metric, method, cases) for method in (first, second))
    return None if low is None or high is None else compared((first, second), low, high, unit)


def compared(names: tuple[str, str], low: Float, high: Float, unit: str) -> Decision | None:
    """Decide by paired runs that one figure is below another; name both in the numbers.

    Figures in a unit that starts with a per cent sign are shares. None without a common run.

    Examples
    --------
    >>> compared(("svalse", "ssbl"), np.array([0.1, 0.2]), np.array([0.5, 0.6]), "%").numbers
    'SVALSE: 15; SSBL: 55 %, paired difference -40.00 ± 0.00'
    >>> compared(("svalse", "svalse paper's form"), np.zeros(2), np.ones(2), "degrees").numbers
    "svalse: 0; svalse paper's form: 1 degrees, paired difference -1.00 ± 0.00"
    """
    both = ~np.isnan(low - high)
    if not both.any():
        return None
    scale = 100.0 if unit.startswith("%") else 1.0
    first, second = (title(name) for name in names)
    if first != second:  # else two forms of a method
        names = first, second
    return below(scale * low[both], scale * high[both], unit, names)


def title(method: str) -> str:
    """Return the name of a method for a reader, without the form, which the page adds.

    Examples
    --------
    >>> title("svalse paper's form"), title("valse from 20 dB"), title("p_d 0, p_a 1")
    ('SVALSE', 'VALSE from 20 dB', 'p_d 0, p_a 1')
    """
    name, _, variant = method.partition(" ")
    variant = variant.removesuffix("paper's form").removeprefix("by ours ")
    return f"{TITLES.get(name, name)} {variant}".strip()


def below_limit(metric: str, method: str, limit: float, *cases: str, unit: str = "degrees") -> Both:
    """Decide that a metric of a method is below a limit, on average over the cases."""
    return by_both(_limited, method, metric=metric, limit=limit, cases=cases or ("",), unit=unit)


def above_limit(metric: str, method: str, limit: float, *cases: str, unit: str = "degrees") -> Both:
    """Decide that a metric of a method is above a limit, on average over the cases."""
    return by_both(
        _limited, method, metric=metric, limit=limit, cases=cases or ("",), unit=unit, above=True
    )


def _limited(
    method: str, results: Results, *, metric: str, limit: float, cases: Sequence[str], unit: str,
    above: bool = False,
) -> Decision | None:  # fmt: skip
    here = values(results, metric, method, cases)
    here = None if here is None else here[~np.isnan(here)]
    if here is None or not here.size:
        return None
    mean, error = float(here.mean()), standard_error(here)
    holds = negative(-(mean - limit) if above else mean - limit, error)
    scale = 100.0 if unit.startswith("%") else 1.0
    if unit == "too few or many":
        mean, unit = abs(mean), "sources too few" if mean < 0 else "sources too many"
    return Decision(holds, f"{scale * mean:.3g} ± {scale * error:.2g} {unit}")


def published(metric: str, method: str, value: float) -> Decide:
    """Decide that the paper's run is within two deviations of the runs of its form."""
    return partial(_published, metric, paper_form(method), value)


def _published(metric: str, method: str, value: float, results: Results) -> Decision | None:
    here = results.get((metric, method, ""))
    if here is None or len(here) < MIN_RUNS:
        return None
    mean, std = float(here.mean()), float(here.std(ddof=1))
    away = abs(value - mean) / std if std else float(np.inf)
    numbers = (
        f"here {mean:.2f} degrees, std of runs {std:.2f}: {away:.1f} deviations away, 2 allowed"
    )
    return Decision(abs(value - mean) <= 2 * std, numbers)


def mostly(metric: str, others: Sequence[str], method: str, *cases: str) -> Both:
    """Decide that a metric of a method is above the sum of its others, on average over cases."""
    return by_both(_mostly, method, metric=metric, others=others, cases=cases)


def _mostly(
    method: str, results: Results, *, metric: str, others: Sequence[str], cases: Sequence[str]
) -> Decision | None:
    part = values(results, metric, method, cases)
    rest = [values(results, other, method, cases) for other in others]
    given = [one for one in rest if one is not None]
    if part is None or len(given) < len(rest):
        return None
    others_sum = np.sum(given, axis=0)
    return compared(("other parts", metric), others_sum, part, "degrees")


def starts(metric: str, other: float, unit: str) -> Both:
    """Decide that noise that starts at 20 dB has less of a metric than from another level."""
    by_paper, by_ours = (
        partial(_lower, start_label(STARTS[1], ours), start_label(other, ours),
                metric=f"started, {metric}", cases=("",), unit=unit)
        for ours in (False, True)
    )  # fmt: skip
    return by_paper, by_ours


def always_converges(method: str) -> Both:
    """Decide that all steps of all cases converge within the largest number of iterations."""
    return by_both(_always_converges, method)


def _always_converges(method: str, results: Results) -> Decision | None:
    shares = {case: float(np.nanmean(runs)) for (metric, name, case), runs in results.items()
              if metric == "converged" and name == method}  # fmt: skip
    if not shares:
        return None
    worst = min(shares, key=lambda case: shares[case])
    numbers = f"in {np.mean(list(shares.values())):.1%} of the steps"
    if shares[worst] < 1:
        numbers += f", at worst {shares[worst]:.1%} at {worst} dB"
    return Decision(shares[worst] >= 1, numbers)


def as_printed_7d(results: Results) -> Decision | None:
    """Decide that GOSPA of run 0 with certain births, as printed, is within 10 % of the paper's."""
    labels = PRINTED_7D, PANELS[3], UNMERGED_7D
    here, quadrature, unmerged = (results.get(("gospa", label, "")) for label in labels)
    if here is None or quadrature is None or unmerged is None:
        return None
    value = PANEL_GOSPA[PANELS[3]]
    numbers = f"one run: as printed {here[0]:.2f} degrees, 10 % off allowed; by quadrature "
    numbers += f"{quadrature[0]:.2f}, without merging {unmerged[0]:.2f}"
    return Decision(bool(abs(here[0] - value) <= value / 10), numbers)


def mixture_is_accurate(results: Results) -> Decision | None:
    """Decide on the mixtures' means, within a quarter of a deviation, and widths, within 10 %."""
    shift, width = (results.get((metric, "mixture", "")) for metric in ("shift", "width"))
    if shift is None or width is None:
        return None
    median, most = np.percentile(shift, [50, 90])
    ratio = float(np.median(width))
    numbers = (
        f"{len(shift)} densities: means {median:.2f} deviations off the exact ones (0.25 allowed), "
        f"90 % within {most:.2f}; "
        f"widths {ratio:.2f} of the exact ones (0.9 to 1.1 allowed); medians"
    )
    return Decision(bool(median < 0.25 and abs(ratio - 1) < 0.1), numbers)
