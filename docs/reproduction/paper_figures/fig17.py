"""Fig. 17, fixed against variable height among walls with holes: F1, F2 and the ten best positions of two scanners."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

import scenes_synthetic
from planner_core.model import BoolArray, FloatArray, Int64Array, Scene, Survey
from planner_core.paper.point_distribution import Distribution, PointDistribution
from planner_core.paper.search.improve import best_apart
from planner_core.scene.patches import patch_triangles
from scenes_synthetic.model import Level, PiercedBox, assemble

from .charts import COLOURS, chart, draw_nothing, draw_walls, label
from .fig05 import rank_correlation
from .figure import Bench, Outcome, Picture, Verdict, at_native_columns, by_share
from .levels import Level as OpenLevel
from .levels import open_level

N_BEST = 10
#: Least distance of chosen positions; the paper gives none.
APART_M = 0.5
#: A position is next to a hole if either mouth of it is within this in plan, whatever its height.
NEXT_WITHIN_M = 1.0
#: What "all" of the chosen positions means in `verdict`.
ALL_NEXT = 0.9
#: The fixed height is the middle of the paper's range of variable ones.
FIXED_M = 1.5
_HEIGHTS_M = tuple(float(z) for z in np.round(np.arange(1.0, 2.05, 0.1), 1))
_SCANNERS = {"hdl-64e": "HDL-64E", "pandar64": "Pandar64"}
#: Of all positions, every so many-th is scanned for what it sees, to know what is usual.
_EVERY = 10
#: Random sets that the fixed height is compared with.
_N_SETS = 200


@dataclass(frozen=True)
class WallHole:
    """A hole of the inner walls. out : (2,) unit, from the middle of the court; the rest in metres.

    inner_m, outer_m : from the middle of the court to both mouths; z_m : height of its middle; high_m : its own height.
    """

    out: FloatArray
    inner_m: float
    outer_m: float
    z_m: float
    high_m: float


def holes_of_scene() -> tuple[WallHole, ...]:
    """Take the holes from the designer's boxes. They lie on the axes of the plan, its origin in the court's middle."""
    found = []
    for part in scenes_synthetic.build("hole-walls").parts:
        for hole in part.pierced_box.holes if part.pierced_box else ():
            low, high = np.array(hole.low_m), np.array(hole.high_m)
            middle = (low + high) / 2
            axis = int(np.argmax(np.abs(middle[:2])))
            out = np.sign(middle[axis]) * np.eye(2)[axis]
            ends = sorted((abs(low[axis]), abs(high[axis])))
            found.append(WallHole(out, float(ends[0]), float(ends[1]), float(middle[2]), float(high[2] - low[2])))
    return tuple(found)


@dataclass(frozen=True)
class Choice:
    """The best positions of one scanner at fixed or at variable height, and all that they were chosen of.

    pool, index : into the positions, all and chosen. next, through : shares of the chosen that lie next to a hole, and
    that see through one. best_f1, best_f2 : of the pool. median_f1, usual_f1 : median of the chosen, of the pool.
    """

    pool: Int64Array
    index: Int64Array
    next: float
    through: float
    best_f1: int
    best_f2: float
    median_f1: float
    usual_f1: float


@dataclass(frozen=True)
class Tried:
    """All positions of one scanner: local frame, metres; what is usual among them, and both choices."""

    level: OpenLevel
    position_m: FloatArray
    n_patches: Int64Array
    f2_m2: FloatArray
    nothing_m2: float
    """F2 of a station that sees nothing."""
    next_by_plain: float
    """Share that lies next to a hole, of those chosen at fixed height by F2 of plain distances."""
    usual_next: float
    usual_through: float
    rank: float
    better_of_as_many: float
    """Share of random sets of as many positions as there are at the fixed height, but at any, with a better best F2."""
    fixed: Choice
    variable: Choice
    next_if_filled: tuple[float, float]
    """Shares that lie next to where the holes were, of those chosen with the holes filled in: fixed, variable."""


def run(bench: Bench) -> Outcome:
    """Measure the uniform sample with both scanners and choose greedily by F2, from one height and from all."""
    tried: dict[str, Tried] = {}
    for done, scanner in enumerate(_SCANNERS):
        bench.tell(done, len(_SCANNERS) + 1, scanner)
        tried[scanner] = _try(bench, scanner)
    bench.tell(len(_SCANNERS), len(_SCANNERS) + 1, "draw")
    pictures = _draw(bench, tried)
    bench.tell(len(_SCANNERS) + 1, len(_SCANNERS) + 1)
    numbers = {scanner: _numbers(one) for scanner, one in tried.items()}
    numbers["columns"] = {name: one for of in tried.values() for name, one in of.level.columns.items()}
    return Outcome(found=_say(tried), agrees=verdict(numbers), pictures=pictures, numbers=numbers)


#: Holes draw the choice where filling them in takes this share of it elsewhere.
DRAWN = 0.2


def verdict(numbers: Mapping[str, Any]) -> Verdict:
    """Whether numbers by scanner bear the paper out, by F2 of squared distances; see `agreement`."""
    return at_native_columns(numbers, lambda: agreement([numbers[scanner] for scanner in _SCANNERS]))


def agreement(scanners: list[Mapping[str, Any]]) -> Verdict:
    """Whether choices at fixed and at variable height bear the paper out with every scanner.

    As many positions of variable height mostly give a better F2 (all of them do so by being more); all chosen positions
    lie next to holes; fewer do where the holes are filled in; and they reach more patches than is usual.
    """
    pairs = [(one, name) for one in scanners for name in ("fixed", "variable")]
    return by_share(
        (
            all(one["better_of_as_many"] > 0.5 for one in scanners),
            all(one[name]["next_to_hole"] >= ALL_NEXT for one, name in pairs),
            all(one["next_if_filled"][name] < one[name]["next_to_hole"] - DRAWN for one, name in pairs),
            all(one[name]["median_f1_of_chosen"] > one[name]["median_f1_of_all"] for one, name in pairs),
        )
    )


def next_to_hole(position_m: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Distance in plan (N,) of positions (N, 3) to the nearest mouth of a hole, and their height above its middle."""
    holes = holes_of_scene()
    place_m = np.array([face_m * hole.out for hole in holes for face_m in (hole.inner_m, hole.outer_m)])
    z_m = np.repeat([hole.z_m for hole in holes], 2)
    distance_m = np.linalg.norm(position_m[:, None, :2] - place_m[None], axis=2)
    return distance_m.min(axis=1), position_m[:, 2] - z_m[distance_m.argmin(axis=1)]


def without_holes() -> Scene:
    """Make the same scene with the holes of its walls filled in."""
    scene = scenes_synthetic.build("hole-walls")
    parts = []
    for part in scene.parts:
        if part.pierced_box is not None:
            whole = PiercedBox(part.pierced_box.low_m, part.pierced_box.high_m)
            part = replace(part, solid=whole.solid(), pierced_box=whole)
        parts.append(part)
    levels = [Level(name, elevation_m) for name, elevation_m in scene.truth.storeys]
    extents_m = scene.truth.extents_m.tolist()
    return assemble("walls without holes", levels=levels, rooms=scene.rooms, parts=parts, extents_m=extents_m).scene


def _open(bench: Bench, scene: str | Scene, scanner: str) -> OpenLevel:
    return open_level(
        bench,
        scene,
        scanner=scanner,
        grid_step_m=bench.at(0.4, 0.1),
        heights_m=_HEIGHTS_M,
    )


def _next_if_filled(bench: Bench, scanner: str) -> tuple[float, float]:
    level = _open(bench, without_holes(), scanner)
    position_m, worth, fixed, _ = _judge(bench, level)
    shares = []
    for pool in (fixed, np.arange(len(position_m))):
        best = _best(position_m, worth.n_patches, worth.f2_m2, pool)
        shares.append(float((next_to_hole(position_m[best])[0] <= NEXT_WITHIN_M).mean()))
    return shares[0], shares[1]


def _judge(bench: Bench, level: OpenLevel) -> tuple[FloatArray, Distribution, Int64Array, float]:
    """Positions (N, 3), their F1 and F2, which of them are at the fixed height, and F2 of one that sees nothing."""
    candidates = level.candidates()
    judge = PointDistribution(level.survey.scene, level.survey.patches, level.engine)
    worth = judge.of(level.survey.template, candidates.position_m, progress=bench.progress)
    fixed = np.flatnonzero(np.isclose(candidates.instrument_height_m, FIXED_M))
    return candidates.position_m, worth, fixed, judge.reference_total_m2


def _best(position_m: FloatArray, f1: Int64Array, f2_m2: FloatArray, pool: Int64Array) -> Int64Array:
    return pool[best_apart(position_m[pool], f1[pool], f2_m2[pool], n=N_BEST, least_distance_m=APART_M)]


def _try(bench: Bench, scanner: str) -> Tried:
    level = _open(bench, "hole-walls", scanner)
    position_m, worth, fixed, nothing_m2 = _judge(bench, level)
    # Plain distances take some times longer: of the fixed height alone.
    plain = PointDistribution(level.survey.scene, level.survey.patches, level.engine, distance="euclidean").of(
        level.survey.template, position_m[fixed], progress=bench.progress
    )
    by_plain = fixed[_best(position_m[fixed], plain.n_patches, plain.f2_m2, np.arange(fixed.size))]
    return Tried(
        level=level,
        position_m=position_m,
        n_patches=worth.n_patches,
        f2_m2=worth.f2_m2,
        nothing_m2=nothing_m2,
        next_by_plain=float((next_to_hole(position_m[by_plain])[0] <= NEXT_WITHIN_M).mean()),
        usual_next=float((next_to_hole(position_m)[0] <= NEXT_WITHIN_M).mean()),
        usual_through=float(sees_through(level, position_m[::_EVERY]).mean()),
        rank=rank_correlation(worth.n_patches.astype(np.float64), worth.f2_m2),
        better_of_as_many=_better_of_as_many(bench, worth.f2_m2, fixed),
        fixed=_choose(level, position_m, worth.n_patches, worth.f2_m2, fixed),
        variable=_choose(level, position_m, worth.n_patches, worth.f2_m2, np.arange(len(position_m))),
        next_if_filled=_next_if_filled(bench, scanner),
    )


def _better_of_as_many(bench: Bench, f2_m2: FloatArray, fixed: Int64Array) -> float:
    rng = np.random.default_rng(bench.seed)
    sets = [rng.choice(f2_m2.size, size=fixed.size, replace=False) for _ in range(_N_SETS)]
    return float(np.mean([f2_m2[one].min() < f2_m2[fixed].min() for one in sets]))


def _choose(level: OpenLevel, position_m: FloatArray, f1: Int64Array, f2_m2: FloatArray, pool: Int64Array) -> Choice:
    best = _best(position_m, f1, f2_m2, pool)
    return Choice(
        pool=pool,
        index=best,
        next=float((next_to_hole(position_m[best])[0] <= NEXT_WITHIN_M).mean()),
        through=float(sees_through(level, position_m[best]).mean()),
        best_f1=int(f1[pool].max()),
        best_f2=float(f2_m2[pool].min()),
        median_f1=float(np.median(f1[best])),
        usual_f1=float(np.median(f1[pool])),
    )


def sees_through(level: OpenLevel, position_m: FloatArray) -> BoolArray:
    """(N,) bool: positions that see a patch on the other side of the inner walls."""
    visibility = level.engine.visible_patches(level.survey.template, position_m)
    court, ring = _sides_of_patches(level.survey)
    in_court = np.abs(position_m[:, :2]).max(axis=1) < holes_of_scene()[0].inner_m
    beyond = (ring if inside else court for inside in in_court)
    return np.array([bool(other[visibility.row(row)].any()) for row, other in enumerate(beyond)])


def _sides_of_patches(survey: Survey) -> tuple[BoolArray, BoolArray]:
    """(P,) bool each: patches of the court, and of the ring round it; those inside the holes are of neither."""
    middle_m = patch_triangles(survey.scene, survey.patches).mean(axis=1)
    out_m = np.abs(middle_m[:, :2]).max(axis=1)
    hole = holes_of_scene()[0]
    return np.asarray(out_m <= hole.inner_m + 1e-6), np.asarray(out_m >= hole.outer_m - 1e-6)


def _say(tried: dict[str, Tried]) -> str:
    n_positions = len(next(iter(tried.values())).position_m)
    drawn = all(min(one.next_if_filled) < min(one.fixed.next, one.variable.next) - 0.2 for one in tried.values())
    return (
        f"of {n_positions} positions, fixed means those at {FIXED_M:g} m and variable all; ten of either are chosen by "
        f"F2, {APART_M:g} m apart. Next to a hole is within {NEXT_WITHIN_M:g} m of a mouth of it in plan, as every "
        f"position in the court is. {' '.join(_say_of(scanner, one) for scanner, one in tried.items())} So "
        f"{'it is' if drawn else 'it is not'} the holes that draw them."
    )


def _say_of(scanner: str, one: Tried) -> str:
    fixed, variable, filled = one.fixed, one.variable, one.next_if_filled
    return (
        f"{_SCANNERS[scanner]}: the best F2 is {fixed.best_f2:.1f} m2 fixed and {variable.best_f2:.1f} m2 variable "
        f"({100 * one.better_of_as_many:.0f} % of random sets of only as many positions at any height are better than "
        f"fixed), the best F1 {fixed.best_f1} and {variable.best_f1} patches. Of the chosen, {100 * fixed.next:.0f} % "
        f"and {100 * variable.next:.0f} % lie next to a hole, of all positions "
        f"{100 * one.usual_next:.0f} %, and of those chosen with the holes filled in {100 * filled[0]:.0f} % and "
        f"{100 * filled[1]:.0f} %; {100 * fixed.through:.0f} % and {100 * variable.through:.0f} % see through a hole, "
        f"of all {100 * one.usual_through:.0f} %. The chosen reach {fixed.median_f1:.0f} and {variable.median_f1:.0f} "
        f"patches in the median, all positions {variable.usual_f1:.0f}; "
        f"{100 * float((one.f2_m2 > one.nothing_m2).mean()):.0f} % of all positions score worse than a station that "
        f"sees nothing. By plain distances instead of squared ones {100 * one.next_by_plain:.0f} % of those "
        f"chosen at fixed height lie next to a hole. F1 and F2 have a rank correlation of "
        f"{one.rank:.2f}."
    )


def _numbers(one: Tried) -> dict[str, Any]:
    numbers: dict[str, Any] = {
        "n_positions": len(one.position_m),
        "usual_next": one.usual_next,
        "usual_through": one.usual_through,
        "rank_correlation": one.rank,
        "better_of_as_many": one.better_of_as_many,
        "sees_nothing_m2": one.nothing_m2,
        "worse_than_nothing": float((one.f2_m2 > one.nothing_m2).mean()),
        "next_by_plain_distance_fixed": one.next_by_plain,
        "next_if_filled": {"fixed": one.next_if_filled[0], "variable": one.next_if_filled[1]},
    }
    for name, choice in (("fixed", one.fixed), ("variable", one.variable)):
        numbers[name] = {
            "next_to_hole": choice.next,
            "sees_through": choice.through,
            "best_f1": choice.best_f1,
            "best_f2_m2": choice.best_f2,
            "median_f1_of_chosen": choice.median_f1,
            "median_f1_of_all": choice.usual_f1,
            "chosen_m": np.round(one.position_m[choice.index], 6).tolist(),
        }
    return numbers


def _draw(bench: Bench, tried: dict[str, Tried]) -> tuple[Picture, ...]:
    shows = (
        "For each scanner: the ten best positions by F2 from above, how far from and above a hole they are, and F1 "
        "against F2"
    )
    with chart(bench, "fig17.png", shows, columns=3, rows=len(tried), size_in=(4.0, 3.6)) as (_, axes, drawn):
        for row, (scanner, one) in enumerate(tried.items()):
            of_map, of_side, of_worth = axes[3 * row : 3 * row + 3]
            _draw_map(of_map, one)
            of_map.set_title(f"{_SCANNERS[scanner]}: best {N_BEST} by F2", fontsize=9, loc="left")
            _draw_heights(of_side, one)
            label(of_side, "Beside the nearest hole", "distance in plan, m", "height above its middle, m")
            _draw_worth(of_worth, one)
            draw_nothing(of_worth, one.nothing_m2)
            label(of_worth, f"F1 and F2, rank correlation {one.rank:.2f}", "F1, patches reached", "F2, m2")
        axes[1].legend(fontsize=7, frameon=False, loc="upper right")
        axes[2].legend(fontsize=7, frameon=False, loc="best", markerscale=3)
    return tuple(drawn)


#: To here the second chart shows distances from a hole.
_FAR_M = 3.5
#: How choices are drawn: fixed height first, so that variable lies on top.
_MARKS = {
    "fixed": {"marker": "s", "color": COLOURS[1], "s": 42},
    "variable": {"marker": "o", "color": COLOURS[0], "s": 26},
}


def _draw_chosen(axes: Any, one: Tried, across: FloatArray, up: FloatArray, *, named: bool = False) -> None:
    for name, choice in (("fixed", one.fixed), ("variable", one.variable)):
        x, y = across[choice.index], up[choice.index]
        title = f"chosen, {name} height" if named else None
        axes.scatter(x, y, edgecolors="white", linewidths=0.6, zorder=4, label=title, **_MARKS[name])


def _draw_map(axes: Any, one: Tried) -> None:
    draw_walls(axes, one.level.walls_m())
    axes.plot(*np.unique(one.position_m[:, :2], axis=0).T, ".", color="#cccccc", markersize=1.5, zorder=0)
    for hole in holes_of_scene():
        ends = np.stack([hole.inner_m * hole.out, hole.outer_m * hole.out])
        axes.plot(*ends.T, color=COLOURS[2], linewidth=5, solid_capstyle="butt")
        beside = ends.mean(axis=0) + 0.6 * np.abs(hole.out[::-1])
        axes.text(
            *beside, f"{hole.z_m:g} m", fontsize=6, ha="center", va="center", rotation=90.0 if hole.out[0] else 0.0
        )
    _draw_chosen(axes, one, one.position_m[:, 0], one.position_m[:, 1])


def _draw_heights(axes: Any, one: Tried) -> None:
    distance_m, above_m = next_to_hole(one.position_m)
    axes.plot(distance_m, above_m, ".", color="#cccccc", markersize=1, zorder=0)
    hole = holes_of_scene()[0]
    away_m = np.array([0.0, _FAR_M])
    # Straight in front, the line of sight past the near edge on one side meets the far edge on the other.
    reach_m = hole.high_m * (away_m / (hole.outer_m - hole.inner_m) + 0.5)
    axes.fill_between(away_m, -reach_m, reach_m, color=COLOURS[2], alpha=0.25, linewidth=0, label="sees through")
    axes.axvline(NEXT_WITHIN_M, color="#888888", linewidth=0.6)
    axes.set_xlim(0, _FAR_M)
    axes.set_ylim(-1.4, 2.0)
    _draw_chosen(axes, one, distance_m, above_m, named=True)


def _draw_worth(axes: Any, one: Tried) -> None:
    for choice, colour, name in (
        (one.variable, "#9ecae1", "all, variable height"),
        (one.fixed, "#fdae6b", f"all, fixed height of {FIXED_M:g} m"),
    ):
        axes.plot(one.n_patches[choice.pool], one.f2_m2[choice.pool], ".", color=colour, markersize=2, label=name)
    _draw_chosen(axes, one, one.n_patches.astype(np.float64), one.f2_m2)
