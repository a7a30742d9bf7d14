"""Claims of our own on SVALSE's scenes, and checks of these programs against rebuilt ones."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import partial

import numpy as np

from arrivals.scenarios.reproduce.claims import Claim
from arrivals.scenarios.reproduce.decisions import Decision
from arrivals.scenarios.reproduce.svalse.calibration_scenes import CONSERVATIVE
from arrivals.scenarios.reproduce.svalse.decisions import Results, lower, paper_form, values
from arrivals.scenarios.reproduce.svalse.forms import activation_label
from arrivals.scenarios.reproduce.svalse.published_values import ACTIVATION, REBUILT

ORDER = (
    ("svalse", "ssbl", "SVALSE has a lower GOSPA than SSBL"),
    ("svalse", "peaks_gnn", "SVALSE has a lower GOSPA than tracked peaks of the beamformer"),
)


def as_rebuilt(method: str, mean: float, std: float, results: Results) -> Decision | None:
    """Decide that the mean GOSPA is within two deviations, over runs, of the rebuilt form's."""
    here = results.get(("gospa", method, ""))
    if here is None:
        return None
    numbers = f"GOSPA {here.mean():.2f}, rebuilt {mean:.2f} ± {std:.2f} degrees"
    return Decision(bool(abs(here.mean() - mean) <= 2 * std), numbers)


def states_deviations(method: str, results: Results) -> Decision | None:
    """Decide that the 68 and 95 % intervals cover what they should."""
    stated = [results.get((m, method, "")) for m in ("nees", "coverage68", "coverage95")]
    given = [float(np.nanmean(one)) for one in stated if one is not None]
    if len(given) < len(stated):
        return None
    nees, c68, c95 = given
    numbers = f"they cover {c68:.0%} and {c95:.0%}; errors "
    numbers += f"{np.sqrt(nees):.1f} times as large as stated, in rms"
    return Decision(CONSERVATIVE.holds(c68, c95), numbers)


def lowest_gospa(cases: Sequence[str], results: Results) -> Decision | None:
    """Decide that SVALSE has a lower GOSPA than the best of the other three, over the cases."""
    others = {
        method: float(mean.mean())
        for method in ("sbl", "ssbl", "valse")
        if (mean := values(results, "gospa", method, cases)) is not None
    }
    best = min(others, key=lambda method: others[method])
    return lower("gospa", "svalse", best, *cases)[1](results)


def _claims() -> Iterator[Claim]:
    for number in (4, 5, 6):
        study = f"svalse-fig{number}"
        for first, second, text in ORDER:
            decide = lower("gospa", first, second)[1]
            yield Claim(study, "", text, by_ours=decide, source="ours")
        for method, name in (("svalse", "SVALSE"), ("valse", "VALSE")):
            text = f"the 68 and 95 % intervals that {name} states cover {CONSERVATIVE}"
            decide = partial(states_deviations, method)
            added = method == "svalse"  # the other states deviations without memory, as before
            yield Claim(study, "", text, by_ours=decide, source="ours" if added else "check")
        improved = lower("gospa", "svalse", paper_form("svalse"))[1]
        text = "SVALSE by our defaults has a lower GOSPA than in the paper's form"
        yield Claim(study, "", text, by_ours=improved, source="ours")
        for method, rebuilt in REBUILT[f"svalse_fig{number}"].items():
            label = paper_form(method)
            text = f"{label} is within two deviations of its rebuilt form"
            decide = partial(as_rebuilt, label, rebuilt.gospa, rebuilt.std)
            yield Claim(study, "", text, by_ours=decide, source="check")
    for pair, known in ACTIVATION.items():
        label = activation_label(*pair)
        decide = partial(as_rebuilt, label, known.gospa, known.std)
        text = f"{label} is within two deviations of its rebuilt form"
        yield Claim("svalse-fig7", "", text, by_ours=decide, source="check")
    for number in (8, 9):
        for lowest, highest in ((0, 20), (25, 40)):
            text = f"from {lowest} to {highest} dB SVALSE has the lowest GOSPA of the four methods"
            decide = partial(lowest_gospa, [f"{snr}" for snr in range(lowest, highest + 5, 5)])
            yield Claim(f"svalse-fig{number}", "", text, by_ours=decide, source="ours")


CLAIMS = tuple(_claims())
