"""Fig. 14, overlap repair: scattered stations before and after 20, 40 and 60 % of overlap are required of them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.sparse.csgraph import connected_components

from planner_core.model import BoolArray, FloatArray
from planner_core.paper.circle_overlap import shared_fraction
from planner_core.paper.overlap_repair import OverlapRepair, repair_overlap, station_overlaps
from planner_core.paper.point_distribution import PointDistribution
from planner_core.paper.search.improve import best_apart

from .charts import COLOURS, chart, draw_walls
from .figure import Bench, Outcome, Picture, Verdict, at_native_columns, by_share
from .levels import Level, open_level

#: (radius, least distance of the first stations, their number): Table 2's range, then the paper's of 1.5 m and its
#: stress test, 1 m with stations scattered so that two have to be put between neighbours.
_TESTS = ((5.0, 6.0, 8), (1.5, 2.5, 20), (1.0, 6.0 - 1e-3, 8))
_REQUIRED = (0.2, 0.4, 0.6)
#: Before the repair, stations of less overlap than the least required are "little overlapped".
_LITTLE = 0.2


@dataclass(frozen=True)
class _Test:
    """One row of the picture: stations before, and repairs by required overlap."""

    radius_m: float
    first_m: FloatArray
    pool_m: FloatArray
    repairs: tuple[OverlapRepair, ...]

    def all_m(self, column: int) -> FloatArray:
        return np.concatenate([self.first_m, self.pool_m[self.repairs[column].added]])


def run(bench: Bench) -> Outcome:
    """Scatter stations by F2, repair their overlap, and ask the surfaces that the scans really share."""
    level = open_level(bench, "basement", grid_step_m=0.5, heights_m=bench.at((1.3,), ()))
    position_m = level.candidates().position_m
    bench.tell(0, 3, "F2")
    worth = PointDistribution(level.survey.scene, level.survey.patches, level.engine).of(
        level.survey.template, position_m, progress=bench.progress
    )
    tests = []
    for radius_m, apart_m, n in _TESTS:
        first = best_apart(position_m, worth.n_patches, worth.f2_m2, n=n, least_distance_m=apart_m)
        pool_m = np.delete(position_m, first, axis=0)
        repairs = tuple(
            repair_overlap(position_m[first], pool_m, radius_m=radius_m, required=required) for required in _REQUIRED
        )
        tests.append(_Test(radius_m, position_m[first], pool_m, repairs))
    bench.tell(1, 3, "real overlap")
    # By scans of 1 or 1.5 m there is nothing to ask: this scanner then hardly sees the ground below itself.
    true = [_true_overlap(level, tests[0], column) for column in range(3)]
    bench.tell(2, 3, "draw")
    pictures = _draw(bench, level, tests)
    bench.tell(3, 3)
    return _outcome(level, tests, true, pictures)


def _true_overlap(level: Level, test: _Test, column: int) -> dict[str, Any]:
    """Compare circles with the surface that scans really share, after one repair, at its required overlap."""
    position_m = test.all_m(column)
    visibility = level.engine.visible_patches(level.survey.template, position_m)
    seen = np.zeros((len(position_m), level.survey.patches.n_patches), dtype=bool)
    for row in range(len(position_m)):
        seen[row, visibility.row(row)] = True
    first, second = np.triu_indices(len(position_m), 1)
    away_m = position_m[second] - position_m[first]
    hits = level.engine.cast_rays(position_m[first], away_m, range_max_m=float(np.linalg.norm(away_m, axis=1).max()))
    open_view = ~(hits.range_m < np.linalg.norm(away_m, axis=1))
    plan_m = np.linalg.norm(away_m[:, :2], axis=1)
    circles = shared_fraction(plan_m, test.radius_m, test.radius_m)
    return compare_overlap(seen, level.survey.patches.area_m2, circles, open_view, required=_REQUIRED[column])


def compare_overlap(
    seen: BoolArray, area_m2: FloatArray, circles: FloatArray, open_view: BoolArray, *, required: float
) -> dict[str, Any]:
    """Count what circles promise and what scans share, at one threshold.

    seen : (S, P), patches by station. area_m2 : (P,). circles, open_view : (S (S - 1) / 2,), by pair in the order of
    `numpy.triu_indices`: share of one circle in the other, and whether either station sees the other.
    """
    n = len(seen)
    weighted = seen * area_m2
    own = weighted.sum(axis=1)
    both = weighted @ seen.T.astype(np.float64)
    first, second = np.triu_indices(n, 1)
    true = both[first, second] / np.maximum(own[first], own[second])
    times = seen.sum(axis=0)
    by_others = (weighted * (times >= 2)).sum(axis=1) / own
    linked, truly = circles >= required, true >= required
    return {
        "required": required,
        "stations": n,
        "stations_overlapped_by_others": int((by_others >= required).sum()),
        "links_by_circles": int(linked.sum()),
        "links_by_true_overlap": int(truly.sum()),
        "sets_by_circles": _sets(n, first[linked], second[linked]),
        "sets_by_true_overlap": _sets(n, first[truly], second[truly]),
        "circle_links_in_view": int((linked & open_view).sum()),
        "circle_links_in_view_true": int((linked & open_view & truly).sum()),
        "circle_links_through_walls": int((linked & ~open_view).sum()),
        "circle_links_through_walls_true": int((linked & ~open_view & truly).sum()),
    }


def _sets(n: int, first: Any, second: Any) -> int:
    linked = np.zeros((n, n), dtype=bool)
    linked[first, second] = True
    return int(connected_components(linked, directed=False)[0])


def _sets_of(position_m: FloatArray, radius_m: float) -> int:
    near = np.linalg.norm(position_m[:, None, :2] - position_m[None, :, :2], axis=2) < 2 * radius_m
    return int(connected_components(near)[0])


def verdict(numbers: Mapping[str, Any]) -> Verdict:
    """Whether the repair does what the paper shows, and scans share what their circles promise.

    Before it most stations overlap little; it reaches the required overlap of all circles, and joins them, with more
    stations the more is required; and as many stations really share that much of what they see.
    """

    def judged() -> Verdict:
        tests, true = numbers["tests"], numbers["true_overlap"]
        return by_share(
            (
                all(row["share_little_before"] > 0.5 for row in tests),
                all(not any(row["short"]) and all(row["joined"]) for row in tests),
                all(row["added"] == sorted(row["added"]) for row in tests),
                all(row["stations_overlapped_by_others"] == row["stations"] for row in true),
                all(row["sets_by_true_overlap"] <= row["sets_by_circles"] for row in true),
            )
        )

    return at_native_columns(numbers, judged)


def _draw(bench: Bench, level: Level, tests: list[_Test]) -> tuple[Picture, ...]:
    from matplotlib.patches import Circle

    walls = level.walls_m()
    shows = "Stations before (orange) and added by the repair (blue), with their circles"
    with chart(bench, "fig14.png", shows, columns=4, rows=len(tests), size_in=(3.0, 3.2)) as (_, axes, drawn):
        for row, test in enumerate(tests):
            for column in range(4):
                one = axes[4 * row + column]
                draw_walls(one, walls)
                n_first = len(test.first_m)
                stations = test.first_m if column == 0 else test.all_m(column - 1)
                for index, place in enumerate(stations):
                    colour = COLOURS[1] if index < n_first else COLOURS[0]
                    one.add_patch(Circle(place[:2], test.radius_m, facecolor=colour, alpha=0.12, linewidth=0))
                    one.plot(*place[:2], "o", color=colour, markersize=2.5)
                added = len(stations) - n_first
                title = "before" if column == 0 else f"{100 * _REQUIRED[column - 1]:.0f} %: {added} added"
                one.set_title(f"radius {test.radius_m:g} m, {title}", fontsize=8, loc="left")
    return tuple(drawn)


def _outcome(level: Level, tests: list[_Test], true: list[dict[str, Any]], pictures: tuple[Picture, ...]) -> Outcome:
    rows = []
    for test in tests:
        before = station_overlaps(test.first_m, radius_m=test.radius_m)
        rows.append(
            {
                "radius_m": test.radius_m,
                "stations_before": len(test.first_m),
                "sets_before": _sets_of(test.first_m, test.radius_m),
                "share_little_before": float((before < _LITTLE).mean()),
                "added": [len(one.added) for one in test.repairs],
                "stations_after": [len(test.first_m) + len(one.added) for one in test.repairs],
                "joined": [one.is_joined for one in test.repairs],
                "short": [len(one.short) for one in test.repairs],
                "least_overlap": [
                    float(station_overlaps(test.all_m(c), radius_m=test.radius_m).min()) for c in range(3)
                ],
            }
        )
    numbers = {"columns": level.columns, "tests": rows, "true_overlap": true}
    return Outcome(found=_say(rows, true), agrees=verdict(numbers), pictures=pictures, numbers=numbers)


def _say(rows: list[dict[str, Any]], true: list[dict[str, Any]]) -> str:
    kept = all(not any(row["short"]) and all(row["joined"]) for row in rows)
    sentences = "; ".join(
        f"radius {row['radius_m']:g} m: {row['stations_before']} stations in {row['sets_before']} sets, "
        f"{100 * row['share_little_before']:.0f} % of them overlapped by less than {100 * _LITTLE:.0f} %, "
        f"{', '.join(map(str, row['stations_after']))} stations for 20, 40 and 60 %"
        for row in rows
    )
    links = "; ".join(
        f"at {100 * row['required']:.0f} %, of {row['stations']} stations {row['stations_overlapped_by_others']} share "
        f"that much of what they see with others, {row['links_by_circles']} pairs are linked by circles (sets: "
        f"{row['sets_by_circles']}) and {row['links_by_true_overlap']} by true overlap (sets: "
        f"{row['sets_by_true_overlap']}); of the circles' links in free view "
        f"{row['circle_links_in_view_true']} of {row['circle_links_in_view']} are true, of those through walls "
        f"{row['circle_links_through_walls_true']} of {row['circle_links_through_walls']}"
        for row in true
    )
    return (
        f"{sentences}. Afterwards {'every' if kept else 'not every'} circle is covered as required and "
        f"{'all hang' if kept else 'not all hang'} together, where circles that touch do. By the surface that scans "
        f"of the first row really share, pair by pair and at the same threshold: {links}."
    )
