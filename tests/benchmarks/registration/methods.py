"""Registration as people do it: two programs that refine a start, and one that needs none.

`Prepared` clouds, a start (4, 4) from the source's frame to the target's -> the pose (4, 4) that a method finds.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import kiss_matcher
import numpy as np
import small_gicp
from scipy.spatial import cKDTree

from planner_core.engine.open3d import import_open3d
from planner_core.model import FloatArray
from tests.benchmarks.registration.clouds import Cloud

VOXELS_M = (0.16, 0.08, 0.04)
REACHES_M = {"tracked": (0.1, 0.08, 0.05), "manual": (0.5, 0.25, 0.1), "found": (0.3, 0.15, 0.08)}
"""Greatest distance of matched points at each voxel, by how far off a start may be: 0.15 m and 3 degrees are 0.4 m at
5 m. Found: by features."""
_MOST_POINTS = (2000, 4000, 8000)
"""Of a source at each voxel, drawn at random; of these a pair takes those that have a neighbour."""
_MOST_MATCHED = 4000
_NORMALS_AGREE = 0.7
_ROUNDS = (15, 10, 10)
_LEAST_PAIRS = 12
_SETTLED = 1e-5
"""Change of a pose, in radians and metres, below which a scale is done."""
GLOBAL_VOXEL_M = 0.12

o3d = import_open3d()
o3d.utility.set_verbosity_level(o3d.utility.VerbosityLevel.Error)


@dataclass(frozen=True)
class Prepared:
    """A cloud at every voxel, for both methods."""

    cloud: Cloud
    levels: tuple[tuple[Any, cKDTree, Any], ...]
    """All points and their tree, and those that are matched as a source."""
    gicp: tuple[tuple[small_gicp.PointCloud, small_gicp.KdTree], ...]
    coarse: FloatArray


def prepare(cloud: Cloud, random: np.random.Generator, *, for_all: bool = True) -> Prepared:
    """Thin a cloud, and find its normals, turned to the scanner.

    for_all : for each method; else for `point_to_plane` alone, in a third of the memory.
    """
    whole = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(cloud.points_m))
    levels, gicp = [], []
    for voxel_m, most in zip(VOXELS_M, _MOST_POINTS, strict=True):
        points = whole.voxel_down_sample(voxel_m)
        points.estimate_normals(o3d.geometry.KDTreeSearchParamHybrid(radius=3 * voxel_m, max_nn=20))
        points.orient_normals_towards_camera_location(np.zeros(3))
        n = len(points.points)
        few = points.select_by_index(random.choice(n, min(n, most), replace=False))
        levels.append((points, cKDTree(np.asarray(points.points)), few))
        if for_all:
            gicp.append(small_gicp.preprocess_points(np.asarray(points.points), voxel_m / 100, 20, 1))
    coarse = np.asarray(whole.voxel_down_sample(GLOBAL_VOXEL_M / 2).points)
    if not for_all:
        cloud = Cloud(cloud.points_m[:0], cloud.pose)
    return Prepared(cloud, tuple(levels), tuple(gicp), coarse)


def _near(few: Any, tree: cKDTree, pose: FloatArray, reach_m: float) -> list[int]:
    """Points of a source that a target's may come to match: others cost time, and are dropped at last."""
    at_m = np.asarray(few.points) @ pose[:3, :3].T + pose[:3, 3]
    away_m, _ = tree.query(at_m, distance_upper_bound=2.0 * reach_m)
    near = np.flatnonzero(np.isfinite(away_m))
    return list(near[:_MOST_MATCHED])


def point_to_plane(target: Prepared, source: Prepared, start: FloatArray, kind: str) -> FloatArray:
    """Multi-scale point-to-plane ICP of Open3D with Tukey's kernel; pairs whose normals disagree are dropped."""
    pose = start.copy()
    levels = zip(target.levels, source.levels, REACHES_M[kind], _ROUNDS, strict=True)
    for (points, tree, _), (_, _, few), reach_m, rounds in levels:
        estimate = o3d.pipelines.registration.TransformationEstimationPointToPlane(
            o3d.pipelines.registration.TukeyLoss(k=reach_m / 2)
        )
        few = few.select_by_index(_near(few, tree, pose, reach_m))
        of_target, of_source = np.asarray(points.normals), np.asarray(few.normals)
        for _ in range(rounds):
            here = o3d.geometry.PointCloud(few).transform(pose)
            away_m, nearest = tree.query(np.asarray(here.points), distance_upper_bound=reach_m)
            near = np.flatnonzero(np.isfinite(away_m))
            turned = of_source[near] @ pose[:3, :3].T
            agree = np.einsum("ij,ij->i", turned, of_target[nearest[near]]) > _NORMALS_AGREE
            if agree.sum() < _LEAST_PAIRS:
                return pose
            pairs = np.column_stack([near, nearest[near]])[agree].astype(np.int32)
            step = estimate.compute_transformation(here, points, o3d.utility.Vector2iVector(pairs))
            if not np.isfinite(step).all():
                return pose
            pose = step @ pose
            if np.abs(step - np.eye(4)).max() < _SETTLED:
                break
    return pose


def generalised(target: Prepared, source: Prepared, start: FloatArray, kind: str) -> FloatArray:
    """Multi-scale generalised ICP of small_gicp."""
    pose = start.copy()
    levels = zip(target.levels, target.gicp, source.levels, REACHES_M[kind], _ROUNDS, strict=True)
    for (_, of_points, _), (points, tree), (_, _, few), reach_m, rounds in levels:
        near = np.asarray(few.points)[_near(few, of_points, pose, reach_m)]
        if len(near) < _LEAST_PAIRS:
            return pose
        matched, _ = small_gicp.preprocess_points(near, VOXELS_M[-1] / 100, 10, 1)
        found = small_gicp.align(
            points,
            matched,
            tree,
            pose,
            registration_type="GICP",
            max_correspondence_distance=reach_m,
            num_threads=1,
            max_iterations=rounds,
            rotation_epsilon=1e-4,
            translation_epsilon=1e-4,
        )
        pose = np.asarray(found.T_target_source)
    return pose


def without_start(target: Prepared, source: Prepared, *, level: bool) -> FloatArray:
    """KISS-Matcher: features, a graph of consistent pairs, graduated non-convexity; `level`: turned about z alone."""
    config = kiss_matcher.KISSMatcherConfig(voxel_size=GLOBAL_VOXEL_M, use_quatro=level)
    found = kiss_matcher.KISSMatcher(config).estimate(
        source.coarse.astype(np.float32), target.coarse.astype(np.float32)
    )
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = np.asarray(found.rotation), np.asarray(found.translation)
    return pose


METHODS = {"open3d": point_to_plane, "gicp": generalised}
"""By their names in the table."""
