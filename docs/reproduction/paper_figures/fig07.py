"""Fig. 7, Halton against pseudo-random points on the triangles of a mesh: a chair and a wall -> how even both are."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from planner_core.engine.open_engine import open_engine
from planner_core.engine.scan_engine import ScanEngine
from planner_core.model import FloatArray, Scene
from planner_core.paper.reference_distance import SampleKind, sample_triangle
from planner_core.plan_folder.section_view import Camera, camera_at
from planner_core.scene.build import scene_from_arrays
from planner_core.scene.patches import make_patches
from scenes_synthetic.furnishing_seats import school_chair
from scenes_synthetic.solids import pierced_box

from .charts import COLOURS, chart, label
from .figure import Bench, Outcome, Picture

#: Points a square metre: so many that the seat's triangles get some hundred each, as few as can be distinguished on
#: paper.
POINTS_PER_M2 = 6000.0
#: Triangles with fewer points have no evenness worth measuring.
LEAST_POINTS = 30
#: Points a cell should get when they are counted by cells.
_POINTS_A_CELL = 8
_KINDS = {SampleKind.HALTON: "Halton", SampleKind.RANDOM: "pseudo-random"}
_TOWARDS_CHAIR_RAD = {"azimuth_rad": np.radians(60.0), "elevation_rad": np.radians(40.0)}


@dataclass(frozen=True)
class Evenness:
    """Of points on one triangle, or its mean over triangles.

    neighbour : mean distance to the nearest other point over that of random points in the plane, 0.5 / sqrt(density).
    variation : standard deviation of those distances over their mean. dispersion : variance over mean of the numbers of
    points in cells of equal area; of random points, all three are near 1, 0.52 and 1.
    """

    neighbour: float
    variation: float
    dispersion: float


def run(bench: Bench) -> Outcome:
    """Sample both objects by Halton once and by random numbers over seeds, and compare what comes out."""
    n_seeds = bench.at(20, 200)
    objects = {"chair": school_chair(), "wall": _wall()}
    numbers: dict[str, Any] = {"n_seeds": n_seeds, "points_per_m2": POINTS_PER_M2}
    found: dict[str, tuple[Evenness, list[Evenness]]] = {}
    for done, (name, solid) in enumerate(objects.items()):
        bench.tell(done, len(objects) + 1, name)
        corners_m = solid.vertices_m[solid.triangles]
        seeds = [bench.seed + k for k in range(n_seeds)]
        found[name] = (
            evenness_of_mesh(corners_m, SampleKind.HALTON, seed=0),
            [evenness_of_mesh(corners_m, SampleKind.RANDOM, seed=seed) for seed in seeds],
        )
        halton, random = found[name]
        numbers[name] = {"halton": vars(halton), "random": [vars(one) for one in random]}
    bench.tell(len(objects), len(objects) + 1, "draw")
    chair = objects["chair"].vertices_m[objects["chair"].triangles]
    pictures = (*_draw_chair(bench, chair), *_draw_evenness(bench, found))
    bench.tell(len(objects) + 1, len(objects) + 1)
    return Outcome(found=_say(found), agrees=agreement(found), pictures=pictures, numbers=numbers)


def agreement(found: dict[str, tuple[Evenness, list[Evenness]]]) -> Literal["yes", "partly", "no"]:
    """Whether Halton's points are more even: than the best seed, by distance and by cells, on every object.

    `partly`: by one of both measures. found : by object, Halton's and those of the random seeds.
    """
    apart = all(halton.neighbour > max(one.neighbour for one in random) for halton, random in found.values())
    cells = all(halton.dispersion < min(one.dispersion for one in random) for halton, random in found.values())
    return "yes" if apart and cells else "partly" if apart or cells else "no"


def evenness_of_mesh(corners_m: FloatArray, kind: SampleKind, *, seed: int) -> Evenness:
    """Mean evenness, weighted by points, of the triangles (T, 3, 3) that are large enough to have one."""
    parts, weights = [], []
    for index, n in enumerate(_numbers_of_points(corners_m)):
        if n >= LEAST_POINTS:
            points = sample_triangle(corners_m[index], n, kind, seed=_seed_of(seed, index))
            shares = np.linalg.lstsq((corners_m[index, 1:] - corners_m[index, 0]).T, (points - corners_m[index, 0]).T)[
                0
            ].T
            parts.append(evenness(points, shares, area_m2=_areas_m2(corners_m[index : index + 1])[0]))
            weights.append(n)
    mean = np.average([[one.neighbour, one.variation, one.dispersion] for one in parts], axis=0, weights=weights)
    return Evenness(*(float(value) for value in mean))


def evenness(points_m: FloatArray, shares: FloatArray, *, area_m2: float) -> Evenness:
    """Of points (n, 3) on a triangle; shares : (n, 2), their weights of its second and third corner."""
    from scipy.spatial import cKDTree

    nearest_m = cKDTree(points_m).query(points_m, k=2)[0][:, 1]
    counts = counts_by_cell(shares)
    return Evenness(
        neighbour=float(nearest_m.mean() / (0.5 * np.sqrt(area_m2 / len(points_m)))),
        variation=float(nearest_m.std() / nearest_m.mean()),
        dispersion=float(counts.var() / counts.mean()),
    )


def counts_by_cell(shares: FloatArray) -> FloatArray:
    """Numbers of points in each of s^2 congruent triangles, some 8 a cell on average."""
    side = max(1, int(np.sqrt(len(shares) / _POINTS_A_CELL)))
    # A little smaller, so that points on the triangle's rim lie in its cells.
    scaled = np.clip(shares.T, 0.0, None) * (side * (1.0 - 1e-9))
    column, row = np.floor(scaled).astype(int)
    upper = (scaled - np.stack([column, row])).sum(axis=0) > 1.0
    cell = (row * side + column) * 2 + upper
    exists = [
        (r * side + c) * 2 + u for r in range(side) for c in range(side - r) for u in range(1 + (c < side - 1 - r))
    ]
    return np.bincount(cell, minlength=2 * side * side)[exists].astype(np.float64)


def _numbers_of_points(corners_m: FloatArray) -> list[int]:
    return [int(n) for n in np.ceil(_areas_m2(corners_m) * POINTS_PER_M2)]


def _areas_m2(corners_m: FloatArray) -> FloatArray:
    normal = np.cross(corners_m[:, 1] - corners_m[:, 0], corners_m[:, 2] - corners_m[:, 0])
    return np.asarray(np.linalg.norm(normal, axis=1) / 2)


def _seed_of(seed: int, triangle: int) -> int:
    return int(np.random.SeedSequence((seed, triangle)).generate_state(1)[0])


def _wall() -> Any:
    return pierced_box((0.0, 0.0, 0.0), (2.4, 0.2, 2.5), [((0.7, 0.0, 0.9), (1.7, 0.2, 2.0))])


def _say(found: dict[str, tuple[Evenness, list[Evenness]]]) -> str:
    parts = []
    for name, (halton, random) in found.items():
        mean = {key: np.mean([getattr(one, key) for one in random]) for key in vars(halton)}
        parts.append(
            f"on the {name}'s triangles the mean distance to the nearest point is {halton.neighbour:.2f} of what "
            f"random points in the plane would have ({mean['neighbour']:.2f} of pseudo-random points), it varies by "
            f"{100 * halton.variation:.0f} % ({100 * mean['variation']:.0f} %), and the numbers of points in cells of "
            f"equal area have {halton.dispersion:.2f} of the variance of chance ({mean['dispersion']:.2f})"
        )
    n_seeds = len(next(iter(found.values()))[1])
    return (
        "; ".join(parts)
        + f". These are means over triangles of at least {LEAST_POINTS} points ({POINTS_PER_M2:g} a m2) and over "
        f"{n_seeds} seeds. Every triangle gets the same beginning of the sequence, so triangles of one shape and size "
        "show one pattern."
    )


def _draw_chair(bench: Bench, corners_m: FloatArray) -> tuple[Picture, ...]:
    scene = scene_from_arrays(corners_m.reshape(-1, 3), np.arange(corners_m.size // 3).reshape(-1, 3))
    engine = open_engine(scene, make_patches(scene, max_area_m2=1.0))
    bench.warn(engine.warnings)
    camera = camera_at(**_TOWARDS_CHAIR_RAD)
    shows = "A chair's triangles, sampled by the Halton sequence (left) and by pseudo-random numbers (right)"
    with chart(bench, "fig07.png", shows, columns=2, size_in=(3.6, 5.4)) as (_, axes, drawn):
        for one, (kind, name) in zip(axes, _KINDS.items(), strict=True):
            points = np.concatenate(
                [
                    sample_triangle(corners, n, kind, seed=_seed_of(bench.seed, index))
                    for index, (corners, n) in enumerate(zip(corners_m, _numbers_of_points(corners_m), strict=True))
                ]
            )
            _shade(one, scene, engine, camera)
            seen = camera.project(points[_is_seen(engine, camera, points)])
            one.plot(*seen.T, ".", color=COLOURS[0], markersize=2.8, markeredgewidth=0)
            one.set_aspect("equal")
            one.set_axis_off()
            one.set_title(name, fontsize=10)
    return tuple(drawn)


def _shade(axes: Any, scene: Scene, engine: ScanEngine, camera: Camera, *, pixel_m: float = 0.0015) -> None:
    """Draw the surface in light grey with its triangles' edges, one beam a pixel."""
    plane = camera.project(scene.vertices_m)
    (u_low, v_low), (u_high, v_high) = plane.min(axis=0) - 0.02, plane.max(axis=0) + 0.02
    u, v = np.meshgrid(np.arange(u_low, u_high, pixel_m), np.arange(v_low, v_high, pixel_m))
    origins = u.reshape(-1, 1) * camera.right + v.reshape(-1, 1) * camera.up - 5.0 * camera.forward
    hits = engine.cast_rays(origins, np.broadcast_to(camera.forward, origins.shape), range_max_m=10.0)
    corners = scene.vertices_m[scene.triangles]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    facing = np.abs(normal @ camera.forward) / np.linalg.norm(normal, axis=1)
    grey = np.where(hits.triangle >= 0, 0.72 + 0.24 * facing[hits.triangle], 1.0).reshape(u.shape)
    triangle = hits.triangle.reshape(u.shape)
    edge = np.zeros(u.shape, dtype=bool)
    edge[:, 1:] |= triangle[:, 1:] != triangle[:, :-1]
    edge[1:] |= triangle[1:] != triangle[:-1]
    axes.imshow(
        np.where(edge, 0.5, grey), cmap="gray", vmin=0, vmax=1, origin="lower", extent=(u_low, u_high, v_low, v_high)
    )


def _is_seen(engine: ScanEngine, camera: Camera, points_m: FloatArray) -> Any:
    """(N,) bool: points that nothing stands before."""
    starts = points_m - 1e-4 * camera.forward
    back = np.broadcast_to(-camera.forward, starts.shape)
    return engine.cast_rays(starts, back, range_max_m=10.0).triangle < 0


def _draw_evenness(bench: Bench, found: dict[str, tuple[Evenness, list[Evenness]]]) -> tuple[Picture, ...]:
    shows = "Evenness of the points: by the nearest neighbour, its variation, and by cells of equal area"
    titles = {
        "neighbour": ("Distance to the nearest point", "mean, 1: random in the plane"),
        "variation": ("Its variation", "standard deviation over mean"),
        "dispersion": ("Points by cell", "variance over mean, 1: chance"),
    }
    with chart(bench, "fig07-evenness.png", shows, columns=3, size_in=(2.8, 2.8)) as (_, axes, drawn):
        for one, (key, (title, name)) in zip(axes, titles.items(), strict=True):
            for place, (halton, random) in enumerate(found.values()):
                values = [getattr(sample, key) for sample in random]
                one.plot(np.full(len(values), place + 0.12), values, "_", color=COLOURS[1], markersize=10)
                one.plot(place - 0.12, getattr(halton, key), "o", color=COLOURS[0], markersize=6)
            one.set_xticks(range(len(found)), list(found), fontsize=8)
            one.set_xlim(-0.5, len(found) - 0.5)
            one.set_ylim(0, one.get_ylim()[1] * 1.1)
            label(one, title, "", name)
        axes[0].plot([], [], "o", color=COLOURS[0], label="Halton")
        axes[0].plot([], [], "_", color=COLOURS[1], markersize=10, label="pseudo-random, a seed each")
        axes[0].legend(fontsize=7, frameon=False, loc="lower left")
    return tuple(drawn)
