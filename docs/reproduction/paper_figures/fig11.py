"""Fig. 11, the best 30 positions of the basement by F2: where they lie, and what they see -> maps and shares."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

import scenes_synthetic
from planner_core.model import BoolArray, FloatArray, Int64Array, Patches, Scene, Survey, Visibility
from planner_core.paper.point_distribution import PointDistribution
from planner_core.paper.search.improve import best_apart
from planner_core.scene.patches import patch_triangles
from scenes_synthetic.basement import ENCLOSED
from scenes_synthetic.model import Room

from .charts import COLOURS, chart, draw_walls, label
from .figure import Bench, Outcome, Picture, Verdict, at_native_columns, by_share
from .levels import Level, open_level

N_BEST = 30
#: Least distances of chosen positions that are tried; the paper gives none.
_APART_M = (0.0, 0.5, 1.0, 1.5, 2.0, 3.0)
#: The one that is drawn and judged: nearer ones are the same spot at another height, or the next voxel.
APART_M = 1.0
#: Geometry is dense by the triangles whose middle lies within this.
DENSE_WITHIN_M = 2.0
#: Shares that `agreement` takes for "most".
MOST_DENSE, MOST_SEEN = 0.7, 0.5
#: Length over width beyond which a patch is slender.
SLENDER = 10.0
_N_RANDOM = 50


@dataclass(frozen=True)
class Choice:
    """Some positions: indices, the share that lies in dense geometry, and the share of achievable area they see."""

    index: Int64Array
    dense: float
    seen: float


@dataclass(frozen=True)
class Measured:
    """What a run finds. by_f2 (of squared distances), by_plain (of plain ones), by_f1 : by least distance. The
    rest are shares, and numbers by room.

    slender : share of patches that are more than `SLENDER` times as long as wide; slender_kind : the class of element
    that most of those are of which chosen positions reach, by reference; slender_chosen, slender_usual : their share in
    the references of all patches that a position reaches, mean of the chosen and median of all.
    """

    by_f2: dict[float, Choice]
    by_plain: dict[float, Choice]
    by_f1: dict[float, Choice]
    by_chance: float
    by_cover: float
    chosen_in: dict[str, int]
    admissible_in: dict[str, int]
    slender: float
    slender_kind: str
    slender_chosen: float
    slender_usual: float
    empty_by_plain: float
    """Share of the enclosed rooms without a position chosen by F2 of plain distances."""

    @property
    def empty(self) -> list[str]:
        """Enclosed rooms that could have a chosen position and have none."""
        return [name for name in self.enclosed if not self.chosen_in[name]]

    @property
    def enclosed(self) -> list[str]:
        """Enclosed rooms with admissible positions."""
        return [name for name in ENCLOSED if self.admissible_in[name]]


def run(bench: Bench) -> Outcome:
    """Choose by F2, and by F1 to compare, at several least distances; compare with chance and with cover itself."""
    level = open_level(bench, "basement", grid_step_m=bench.at(0.75, 0.5))
    position_m = level.candidates().position_m
    near = triangles_near(level.survey.scene, position_m)
    rooms = scenes_synthetic.build("basement", seed=bench.seed).rooms
    found = _measure(bench, level, position_m, near, rooms)
    bench.tell(2, 3, "draw")
    pictures = (*_draw_maps(bench, level, position_m, near, found, rooms), *_draw_shares(bench, found))
    bench.tell(3, 3)
    numbers = _numbers(level, position_m, found)
    return Outcome(found=_say(len(position_m), found), agrees=verdict(numbers), pictures=pictures, numbers=numbers)


def verdict(numbers: Mapping[str, Any]) -> Verdict:
    """`agreement` of a run at native columns, by F2 of squared distances."""
    return at_native_columns(numbers, lambda: agreement(**numbers["judged"]["squared"]))


def _numbers(level: Level, position_m: FloatArray, found: Measured) -> dict[str, Any]:
    best, plain = found.by_f2[APART_M], found.by_plain[APART_M]
    return {
        "n_positions": len(position_m),
        "columns": level.columns,
        "judged": {
            "squared": {"dense": best.dense, "seen": best.seen, "empty": len(found.empty) / len(found.enclosed)},
            "euclidean": {"dense": plain.dense, "seen": plain.seen, "empty": found.empty_by_plain},
        },
        "least_distance_m": list(_APART_M),
        "dense_by_f2": [choice.dense for choice in found.by_f2.values()],
        "dense_by_f1": [choice.dense for choice in found.by_f1.values()],
        "seen_by_f2": [choice.seen for choice in found.by_f2.values()],
        "seen_by_f1": [choice.seen for choice in found.by_f1.values()],
        "seen_by_chance": found.by_chance,
        "seen_by_greedy_cover": found.by_cover,
        "chosen_by_room": found.chosen_in,
        "positions_by_room": found.admissible_in,
        "slender_patches": found.slender,
        "slender_share_of_reference": {"chosen": found.slender_chosen, "median": found.slender_usual},
    }


def _measure(bench: Bench, level: Level, position_m: FloatArray, near: Int64Array, rooms: Sequence[Room]) -> Measured:
    survey = level.survey
    bench.tell(0, 3, f"F2 of {len(position_m)} positions")
    judge = PointDistribution(survey.scene, survey.patches, level.engine)
    worth = judge.of(survey.template, position_m, progress=bench.progress)
    plain = PointDistribution(survey.scene, survey.patches, level.engine, distance="euclidean").of(
        survey.template, position_m, progress=bench.progress
    )
    bench.tell(1, 3, "coverage")
    visibility = level.engine.visible_patches(survey.template, position_m)
    see = Sight(visibility, survey.patches.area_m2)
    by_f2, by_plain, by_f1 = (
        {apart: _choose(position_m, worth.n_patches, f2, apart, near, see) for apart in _APART_M}
        for f2 in (worth.f2_m2, plain.f2_m2, -worth.n_patches.astype(float))
    )
    chosen = by_f2[APART_M].index
    slender = is_slender(survey.scene, survey.patches)
    share = see.by_position(judge.reference_m2 * slender) / see.by_position(judge.reference_m2)
    enclosed = [room for room in rooms if room.name in ENCLOSED and inside(room, position_m).any()]
    left_out = [not inside(room, position_m[by_plain[APART_M].index]).any() for room in enclosed]
    return Measured(
        by_f2=by_f2,
        by_plain=by_plain,
        empty_by_plain=float(np.mean(left_out)),
        by_f1=by_f1,
        by_chance=see.chance(bench.seed),
        by_cover=see.share(see.cover_greedily()),
        chosen_in={room.name: int(inside(room, position_m[chosen]).sum()) for room in rooms},
        admissible_in={room.name: int(inside(room, position_m).sum()) for room in rooms},
        slender=float(slender.mean()),
        slender_kind=_kind_of_most(survey, judge.reference_m2 * slender * see.times(chosen)),
        slender_chosen=float(share[chosen].mean()),
        slender_usual=float(np.median(share)),
    )


def is_slender(scene: Scene, patches: Patches) -> BoolArray:
    """(P,) bool: patches whose longest edge is more than `SLENDER` times their height over it."""
    corners_m = patch_triangles(scene, patches)
    edges_m = corners_m - np.roll(corners_m, 1, axis=1)
    longest_m2 = (edges_m**2).sum(axis=2).max(axis=1)
    return np.asarray(longest_m2 > SLENDER * 2.0 * patches.area_m2)


def _kind_of_most(survey: Survey, weight: FloatArray) -> str:
    """Class of the elements with the largest sum of a weight (P,) of patches."""
    element = survey.scene.element_of_triangle[survey.patches.triangle_of_patch]
    by_kind: defaultdict[str, float] = defaultdict(float)
    for one, value in zip(survey.scene.elements, np.bincount(element, weight).tolist(), strict=False):
        by_kind[one.kind] += value
    return max(by_kind, key=by_kind.__getitem__)


def agreement(*, dense: float, seen: float, empty: float) -> Verdict:
    """Whether shares bear the paper out.

    dense : of chosen positions with more triangles near than the median admissible one (half of them by chance);
    seen : of achievable area; empty : of the enclosed rooms without a chosen position, of those that could have one.
    """
    return by_share((dense >= MOST_DENSE, seen >= MOST_SEEN, empty > 0.5))


def triangles_near(scene: Scene, position_m: FloatArray) -> Int64Array:
    """(N,) triangles whose middle lies within `DENSE_WITHIN_M` of each position, whatever stands between."""
    from scipy.spatial import cKDTree

    middles = cKDTree(scene.vertices_m[scene.triangles].mean(axis=1))
    return np.asarray(middles.query_ball_point(position_m, DENSE_WITHIN_M, return_length=True), dtype=np.int64)


def inside(room: Room, position_m: FloatArray) -> BoolArray:
    """(N,) bool: which positions lie in a room with a rectangular outline."""
    corners = np.array(room.outline_m)
    return np.asarray(((position_m[:, :2] >= corners.min(axis=0)) & (position_m[:, :2] <= corners.max(axis=0))).all(1))


class Sight:
    """Area that sets of positions see together, as a share of what all see."""

    def __init__(self, visibility: Visibility, area_m2: FloatArray) -> None:
        self._visibility, self._area_m2 = visibility, area_m2
        self._all_m2 = self._area_of(range(visibility.n_positions))

    def _area_of(self, index: Sequence[int] | range) -> float:
        seen = np.zeros(self._area_m2.size, dtype=bool)
        for position in index:
            seen[self._visibility.row(position)] = True
        return float(self._area_m2[seen].sum())

    def share(self, index: Sequence[int] | range) -> float:
        """What some positions see together."""
        return self._area_of(index) / self._all_m2

    def by_position(self, weight: FloatArray) -> FloatArray:
        """(N,) sum over the patches that each position sees of a weight (P,)."""
        sums = np.concatenate([[0.0], np.cumsum(weight[self._visibility.patch])])
        return np.asarray(sums[self._visibility.starts[1:]] - sums[self._visibility.starts[:-1]])

    def times(self, index: Int64Array) -> Int64Array:
        """(P,) how many of some positions see each patch."""
        rows = np.concatenate([self._visibility.row(int(position)) for position in index])
        return np.asarray(np.bincount(rows, minlength=self._visibility.n_patches), dtype=np.int64)

    def chance(self, seed: int) -> float:
        """Mean share of random sets."""
        rng = np.random.default_rng(seed)
        n = self._visibility.n_positions
        sets = [rng.choice(n, size=min(N_BEST, n), replace=False).tolist() for _ in range(_N_RANDOM)]
        return float(np.mean([self.share(index) for index in sets]))

    def cover_greedily(self) -> list[int]:
        """Positions that each add the most area to those before."""
        left_m2, chosen = self._area_m2.copy(), []
        for _ in range(N_BEST):
            chosen.append(int(np.argmax(self.by_position(left_m2))))
            left_m2[self._visibility.row(chosen[-1])] = 0.0
        return chosen


def _choose(
    position_m: FloatArray, f1: Int64Array, f2: FloatArray, apart_m: float, near: Int64Array, see: Sight
) -> Choice:
    index = best_apart(position_m, f1, f2, n=N_BEST, least_distance_m=apart_m)
    return Choice(index, float((near[index] > np.median(near)).mean()), see.share(index.tolist()))


def _say(n_positions: int, found: Measured) -> str:
    f2, f1, far = found.by_f2[APART_M], found.by_f1[APART_M], found.by_f2[_APART_M[-1]]
    plain = found.by_plain[APART_M]
    where = ", ".join(f"{number} in the {name}" for name, number in found.chosen_in.items() if number)
    by_length = ", so it goes less by how many patches are near than by long ones"
    rule = by_length if found.slender_chosen > found.slender_usual else ""
    return (
        f"of {n_positions} admissible positions, the {len(f2.index)} of least F2 that are {APART_M:g} m apart lie "
        f"{where}. {100 * f2.dense:.0f} % of them have more triangles within {DENSE_WITHIN_M:g} m than the median "
        f"position, where chance gives 50 %; of those chosen by F1 instead, {100 * f1.dense:.0f} %. Those by F2 see "
        f"{100 * f2.seen:.0f} % of the achievable area (by F1 {100 * f1.seen:.0f} %, at random "
        f"{100 * found.by_chance:.0f} %, greedily by area {100 * found.by_cover:.0f} %), and {100 * far.seen:.0f} % if "
        f"{_APART_M[-1]:g} m apart. No position is chosen in {len(found.empty)} of {len(found.enclosed)} enclosed "
        f"rooms: {', '.join(found.empty)}. With plain distances instead of squared ones, "
        f"{100 * plain.dense:.0f} % are in dense geometry, they see {100 * plain.seen:.0f} %, and "
        f"{100 * found.empty_by_plain:.0f} % of the enclosed rooms stay empty. "
        f"F2 sums squared distances{rule}: the {100 * found.slender:.0f} % of patches "
        f"that are more than {SLENDER:g} times as long as wide make up {100 * found.slender_chosen:.0f} % of the "
        f"references that a chosen position reaches (mostly {found.slender_kind}), against "
        f"{100 * found.slender_usual:.0f} % in the median."
    )


def _draw_maps(
    bench: Bench,
    level: Level,
    position_m: FloatArray,
    near: Int64Array,
    found: Measured,
    rooms: Sequence[Room],
) -> tuple[Picture, ...]:
    shows = f"The best {N_BEST} positions by F2 (left) and by F1, over the triangles near every admissible position"
    from matplotlib.colors import LogNorm

    plan_m, column = np.unique(position_m[:, :2], axis=0, return_inverse=True)
    most = np.zeros(len(plan_m))
    np.maximum.at(most, column.ravel(), near)
    walls = level.walls_m()
    with chart(bench, "fig11.png", shows, columns=2, size_in=(4.7, 4.5)) as (sheet, axes, drawn):
        for one, name, choices in zip(axes, ("F2", "F1"), (found.by_f2, found.by_f1), strict=True):
            choice = choices[APART_M]
            draw_walls(one, walls)
            dots = one.scatter(
                *plan_m.T,
                c=most,
                s=9,
                cmap="Greys",
                norm=LogNorm(np.quantile(most, 0.01) / 3, most.max()),
                linewidths=0,
            )
            one.scatter(
                *position_m[choice.index, :2].T, s=34, color=COLOURS[1], edgecolors="white", linewidths=0.6, zorder=3
            )
            _name_rooms(one, [room for room in rooms if room.name in ENCLOSED])
            one.set_title(f"best {len(choice.index)} by {name}, {APART_M:g} m apart", fontsize=9, loc="left")
        bar = sheet.colorbar(dots, ax=axes, shrink=0.6, pad=0.01)
        bar.set_label(f"triangles within {DENSE_WITHIN_M:g} m", fontsize=8)
        bar.ax.tick_params(labelsize=7)
    return tuple(drawn)


def _name_rooms(axes: Any, rooms: Sequence[Room]) -> None:
    for room in rooms:
        low, high = np.array(room.outline_m).min(axis=0), np.array(room.outline_m).max(axis=0)
        axes.text(
            high[0] - 0.15,
            (low[1] + high[1]) / 2,
            room.name.replace(" room", ""),
            fontsize=7,
            ha="right",
            va="center",
            bbox={"facecolor": "white", "edgecolor": "none", "pad": 1.0, "alpha": 0.8},
            zorder=2.5,
        )


def _draw_shares(bench: Bench, found: Measured) -> tuple[Picture, ...]:
    shows = "Shares of the chosen positions in dense geometry, and of the area they see, by their least distance"
    with chart(bench, "fig11-by-distance.png", shows, columns=2, size_in=(4.0, 3.0)) as (_, axes, drawn):
        for choices, name, colour, mark in (
            (found.by_f2, "by F2", COLOURS[0], "o"),
            (found.by_f1, "by F1", COLOURS[1], "s"),
        ):
            axes[0].plot(list(choices), [one.dense for one in choices.values()], mark + "-", color=colour, label=name)
            axes[1].plot(list(choices), [one.seen for one in choices.values()], mark + "-", color=colour, label=name)
        axes[0].axhline(0.5, color="#888888", linewidth=0.8, linestyle=":", label="by chance")
        axes[1].axhline(found.by_chance, color="#888888", linewidth=0.8, linestyle=":", label="at random")
        axes[1].axhline(found.by_cover, color=COLOURS[2], linewidth=0.8, linestyle="--", label="greedily by area")
        for one, title in zip(axes, ("In dense geometry", "Achievable area seen"), strict=True):
            one.set_ylim(0, 1)
            one.legend(fontsize=7, frameon=False)
            label(one, title, "least distance of chosen positions, m", "share")
    return tuple(drawn)
