"""Coverage and overlap in words: one rule, so that a share reads the same wherever it stands.

The viewer has it in figures.ts and shortfalls.ts.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

from planner_core.model import NOT_AS_REQUIRED, LinkLimits, Scope

MOST_PROBABLE = 0.999
LARGE_SHARE = 1 / 3
"""Of the surface in scope: where more than this is left out, coverage of the rest is no measure of the building."""
MISSED_SHARE = 0.1
"""Of the surface that counts: where more than this is seen, but not as required, the coverage is not of all that is."""


def reached_percent(share: float, required: float) -> str:
    """Return a share in percent with one decimal; `just below 30` where it would read as 30 and is less."""
    words, least = f"{100 * share:.1f}", f"{100 * required:g}"
    return f"just below {least}" if share < required - 1e-9 and float(words) >= float(least) else words


def probability_percent(probability: float, required: float) -> str:
    """Return a probability in percent as `reached_percent` does; never more than 99.9: nothing is certain."""
    return reached_percent(min(probability, MOST_PROBABLE), required)


def reached_share(share: float, required: float, decimals: int) -> float:
    """Return a share with so many decimals, for files; with as many more as keep it below what is required and is not
    reached.
    """
    while share < required <= round(share, decimals):
        decimals += 1
    return round(float(share), decimals)


def link_limits_words(limits: LinkLimits, noun: str = "overlap", pre_alignment: str = "") -> str:
    """What links need: `at least 99 % probability of registering (tracked) and 30 % overlap`.

    noun : of `planner_core.requirements.wording.overlap_noun`. pre_alignment : where registration starts; empty: not
    named.
    """
    start = f" ({pre_alignment})" if pre_alignment else ""
    needs = [f"{100 * limits.probability:g} % probability of registering{start}"] if limits.probability > 0.0 else []
    needs += [f"{100 * limits.overlap:g} % {noun}"] if limits.overlap > 0.0 or not needs else []
    return f"at least {' and '.join(needs)}"


def not_as_required_m2(area_by_reason_m2: Mapping[str, float], achievable_m2: float) -> float:
    """Surface that valid positions see, and none as required, for beside its coverage; 0 where that is little."""
    missed_m2 = sum(area_by_reason_m2.get(reason, 0.0) for reason in NOT_AS_REQUIRED)
    return missed_m2 if missed_m2 > MISSED_SHARE * achievable_m2 else 0.0


def not_planned(
    *,
    unreachable_m2: Sequence[float],
    scope: str,
    achievable_m2: float,
    total_m2: float,
    area_by_reason_m2: Mapping[str, float],
    area: Callable[[float], str] = "{:.0f} m2".format,
) -> tuple[str, ...]:
    """Lines on what the share of the scannable area does not count, for beside it; none where that is little.

    unreachable_m2 : ground of each room that cannot be entered. achievable_m2, total_m2 : surface that valid positions
    see, and all that counts. With scope `all` the inside of walls is in the total, and no line is made of it.
    area_by_reason_m2 : by `REASONS`; empty where no reasons were computed.
    """
    lines = []
    if unreachable_m2:
        where = "one area" if len(unreachable_m2) == 1 else f"{len(unreachable_m2)} areas"
        lines.append(f"Not planned: {area(sum(unreachable_m2))} of floor that can't be reached on foot, in {where}")
    missed_m2 = not_as_required_m2(area_by_reason_m2, achievable_m2)
    if missed_m2:
        lines.append(
            f"Not scannable as required: {area(missed_m2)} that valid positions see, beside the {area(achievable_m2)} "
            "that count"
        )
    hidden_m2 = total_m2 - achievable_m2 - missed_m2
    if scope != Scope.ALL and hidden_m2 > LARGE_SHARE * total_m2:
        lines.append(f"Not scannable: {area(hidden_m2)} of {area(total_m2)} in scope, from no valid tripod position")
    return tuple(lines)
