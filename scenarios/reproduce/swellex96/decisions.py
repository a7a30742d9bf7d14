"""Functions that decide the claims on the SWellEx-96 tow, from scores and facts of the field."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from types import MappingProxyType
from typing import NamedTuple

from arrivals.scenarios.experiments.statistics import standard_error
from arrivals.scenarios.reproduce.claims import Claim
from arrivals.scenarios.reproduce.decisions import Both, Decision, difference
from arrivals.scenarios.reproduce.svalse.decisions import by_both, compared, title
from arrivals.scenarios.reproduce.swellex96.field import FieldFacts
from arrivals.scenarios.reproduce.swellex96.strays import StrayFacts
from arrivals.typing import Float

SCORES = ("gospa", "distance", "missed", "false", "rmse", "found", "paths", "near")
WITH_RANGE = "svalse with range"  # label of SVALSE with a curvature for each path
MANY = 0.8  # share of steps that counts as "dominates"


class SeaResults(NamedTuple):
    """What the claims on the tow are decided by.

    Attributes
    ----------
    scores : mapping of str to ndarray, shape (n_draws, 8)
        `SCORES` of each method in steps 1 to 100, which have many close paths; 63 elements.
    field : FieldFacts
    blocks : mapping of str to ndarray, shape (n_draws, 4)
        GOSPA of each method in steps 1-100, 101-200, 201-250 and 251-350; 63 elements.
    strays : StrayFacts, optional
        Directions far from every path in steps 251 to 350.
    """

    scores: Mapping[str, Float]
    field: FieldFacts
    blocks: Mapping[str, Float] = MappingProxyType({})
    strays: StrayFacts | None = None


def lower(metric: str, first: str, second: str) -> Both:
    """Decide that a score of one method is below that of another in steps 1 to 100."""
    return by_both(_lower, first, second, metric=metric)


def _lower(first: str, second: str, results: SeaResults, *, metric: str) -> Decision | None:
    if not {first, second} <= set(results.scores):
        return None
    column = SCORES.index(metric)
    return compared((first, second), results.scores[first][:, column],
                    results.scores[second][:, column], "degrees")  # fmt: skip


def none_beyond_critical(results: SeaResults) -> Decision:
    """Decide that less than 1 % of the power comes from beyond the critical angle."""
    share, far = results.field.beyond_critical, results.field.beyond_far
    numbers = f"{share:.1%} of the power is from beyond it, median of steps 1 to 350, 1 % allowed"
    return Decision(share < 0.01, f"{numbers}; {far:.1%} in steps 1 to 200")


def angles_grow(results: SeaResults) -> Decision:
    """Decide that the angles grow in most steps."""
    share = results.field.growing
    return Decision(share > MANY, f"they do in {share:.0%} of the steps up to the closest one")


def bottom_dominates(results: SeaResults) -> Decision:
    """Decide that the path B is the strongest in most steps, at about -15 degrees."""
    share, (near, far) = results.field.bottom, results.field.bottom_span
    holds = share > MANY and far < -15 < near
    return Decision(
        holds, f"the strongest in {share:.0%} of the steps, at {near:.0f}° to {far:.0f}°"
    )


def direct_is_weaker(results: SeaResults) -> Decision:
    """Decide that the direct path is weaker, by rays and by modes."""
    rays, modes = results.field.weaker_rays, results.field.weaker_modes
    numbers = (
        f"weaker by {rays:.0f} dB (rays) and {modes:.0f} dB (beam power of the modes), medians"
    )
    return Decision(min(rays, modes) > 0, numbers)


def two_dominate(results: SeaResults) -> Decision:
    """Decide that BS and BSB are the strongest in most steps."""
    share = results.field.late_bounces
    return Decision(share > MANY, f"one of them is the strongest in {share:.0%} of the steps")


def at_their_angles(results: SeaResults) -> Decision:
    """Decide that BS and BSB pass 15 and -17 degrees in those steps."""
    spans, step = results.field.late_spans, results.field.nearest_step
    numbers = "BSR {:.0f}° to {:.0f}°, BSBR {:.0f}° to {:.0f}°".format(*spans)
    return Decision(220 <= step <= 250, f"{numbers}; nearest to 15° and -17° at step {step}")


def many_bounces_dominate(results: SeaResults) -> Decision:
    """Decide that paths of four bounces and more are the strongest in most steps."""
    share, names = results.field.many_bounces, results.field.succession
    numbers = f"in {share:.0%} of the steps; most often in each quarter of them: {', '.join(names)}"
    return Decision(share > MANY, numbers)


def pairs_are_close(results: SeaResults) -> Decision:
    """Decide that pairs of paths are at most about 1 degree apart."""
    median, most, largest = results.field.pair_gap
    numbers = f"median {median:.2f}°, 95 % within {most:.2f}°, at most {largest:.1f}°"
    return Decision(most < 1.5, numbers)


def models_agree(results: SeaResults) -> Decision:
    """Decide that the beam powers of rays and modes are correlated."""
    field = results.field
    numbers = (
        f"correlation of the beam powers {field.correlation:.2f}, median of the steps; level of "
        f"the rays over the modes {field.level:+.1f} dB, std {field.level_std:.1f} dB"
    )
    return Decision(field.correlation > 0.8 and abs(field.level) < 3, numbers)


def peaks_are_paths(results: SeaResults) -> Decision:
    """Decide that the highest beam peaks are at strong paths."""
    above, low, most = results.field.peak_to_path
    numbers = f"median distance of the highest peak to a path: {above:.1f}° from above, {low:.1f}° "
    return Decision(max(above, low) < 1, f"{numbers}from below; 90 % within {most:.1f}°")


def never_above(first: str, second: str, results: SeaResults) -> Decision | None:
    """Decide that the GOSPA of one method is not above that of another in any block."""
    if not {first, second} <= set(results.blocks):
        return None
    d = results.blocks[first] - results.blocks[second]
    blocks = [difference(column).removeprefix("paired difference ") for column in d.T]
    above = any(column.mean() > 2 * standard_error(column) for column in d.T)
    holds = None if len(d) < 2 else not above
    return Decision(holds, f"paired differences {', '.join(blocks)} degrees")


def late_below(first: str, second: str, results: SeaResults) -> Decision | None:
    """Decide that the GOSPA of one method is below that of another in steps 251 to 350."""
    if not {first, second} <= set(results.blocks):
        return None
    low, high = (results.blocks[name][:, -1] for name in (first, second))
    return compared((first, second), low, high, "degrees")


def mudstone_reflects(results: SeaResults) -> Decision | None:
    """Decide that a third of the beam peaks far from every path are due to the mudstone."""
    if results.strays is None:
        return None
    peaks, without, _ = results.strays
    numbers = f"{peaks:.2f} peaks a step, {without:.2f} over a sea floor of sediment alone"
    return Decision(without < 2 / 3 * peaks, numbers)


def strays_are_peaks(method: str, results: SeaResults) -> Decision | None:
    """Decide that most directions of a method far from every path are at beam peaks."""
    if results.strays is None:
        return None
    numbers = ", ".join(
        f"{title(name)}: {share:.0%} of {n:.2f} directions a step"
        for name, (n, share) in results.strays.estimates.items()
    )
    return Decision(results.strays.estimates[method][1] > 0.5, numbers)


def of_field(decide: Callable[[SeaResults], Decision], results: SeaResults) -> Decision:
    """Decide by the simulated field, and say so: no form of a method takes part."""
    decision = decide(results)
    return decision._replace(numbers=f"simulated field: {decision.numbers}")


FIELD: tuple[tuple[str, Callable[[SeaResults], Decision]], ...] = (
    ("multipath ends at the critical angle of 21.6 degrees", none_beyond_critical),
    ("the absolute angles increase as the source comes closer", angles_grow),
    ("modes and rays match visually well", models_agree),
    ("the beam has significant peaks at the paths", peaks_are_paths),
    ("BR (our B), at about -15 degrees, is dominant: steps 250 to 350", bottom_dominates),
    ("DP (our D), at 12 degrees, is weaker than BR: steps 250 to 350", direct_is_weaker),
    ("a path and that with a bounce above the source are about 1 degree or less apart",
     pairs_are_close),
    ("BSR and BSBR (our BS and BSB) dominate: steps 220 to 250", two_dominate),
    ("BSR and BSBR arrive from 15 and -17 degrees: steps 220 to 250", at_their_angles),
    ("paths of four bounces and more, as BSBSR and BSBSBR, dominate in turn: steps 1 to 200",
     many_bounces_dominate),
)  # fmt: skip
CLAIMS: tuple[Claim, ...] = (
    *(
        Claim("swellex96", "", text, by_ours=lower("gospa", first, second)[1], source="ours")
        for first, second, text in (
            ("svalse", "cbf", "SVALSE has a lower GOSPA than the beamformer, steps 1 to 100"),
            ("svalse", "peaks_gnn",
             "SVALSE has a lower GOSPA than tracked peaks of the beamformer"),
            ("svalse", "ssbl", "SVALSE has a lower GOSPA than SSBL"),
            ("valse", "cbf", "VALSE has a lower GOSPA than the beamformer"),
        )
    ),
    *(
        Claim("swellex96", "", text, by_ours=decide, source="ours")
        for text, decide in (
            ("SVALSE with range has a lower GOSPA than SVALSE near the closest approach: steps 251 "
             "to 350", partial(late_below, WITH_RANGE, "svalse")),
            ("SVALSE with range has no higher GOSPA than SVALSE in steps 1-100, 101-200, 201-250 "
             "and 251-350", partial(never_above, WITH_RANGE, "svalse")),
            ("most directions of SVALSE with range that are farther than 3 degrees from every "
             "path are within 1.5 degrees of a beam peak without noise: steps 251 to 350",
             partial(strays_are_peaks, WITH_RANGE)),
            ("a third or more of these beam peaks are due to the mudstone below the sediment, "
             "while the rays are reflected at the sea floor", mudstone_reflects),
        )
    ),
)  # fmt: skip
