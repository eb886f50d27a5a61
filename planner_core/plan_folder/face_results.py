"""What the plan is worth for every triangle: seen share, number of stations, shortest range.

Plan -> FaceResults -> the stage's results layer, opinions over the building's meshes.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from planner_core.model import BoolArray, Float32Array, FloatArray, Int32Array, Plan
from planner_core.plan_folder.palette import FACE_COLOURS_SRGB, face_colour_index
from planner_core.plan_folder.sdf_authoring import (
    TYPES,
    Layer,
    float_array,
    int_array,
    over,
    put_colours,
    put_primvar,
    set_stage_metadata,
)
from planner_core.plan_folder.usd_names import MeshPlace


@dataclass(frozen=True)
class FaceResults:
    """Results a triangle of the scene, all (T,).

    coverage : float32, seen share of the face's achievable area in [0, 1]; -1 where nothing of it is achievable.
    times_seen : int32, most stations that see one patch of the face.
    best_range_m : float32, shortest range at which a station sees the face; -1 where none does.
    required : bool, False where nothing of the face need be covered; None: all of the building is to be.
    """

    coverage: Float32Array
    times_seen: Int32Array
    best_range_m: Float32Array
    required: BoolArray | None = None


def face_results(plan: Plan, best_range_m: FloatArray) -> FaceResults:
    """Sum the plan's patches up into faces.

    Parameters
    ----------
    plan
        Uses `times_seen`, `achievable` and the survey's patches, as far as they count.
    best_range_m
        (P,) float64, shortest range of each patch over all stations, inf where no station sees it.
    """
    first = plan.survey.patches.first_patch[:-1]
    area_m2 = plan.survey.patches.area_m2
    achievable_m2 = np.add.reduceat(plan.achievable * area_m2, first)
    seen_m2 = np.add.reduceat((plan.achievable & (plan.times_seen > 0)) * area_m2, first)
    nearest_m = np.minimum.reduceat(best_range_m, first)
    coverage = np.where(achievable_m2 > 0, seen_m2 / np.where(achievable_m2 > 0, achievable_m2, 1.0), -1.0)
    return FaceResults(
        coverage=coverage.astype(np.float32),
        times_seen=np.maximum.reduceat(plan.times_seen, first).astype(np.int32),
        best_range_m=np.where(np.isfinite(nearest_m), nearest_m, -1.0).astype(np.float32),
        required=required_faces(plan),
    )


def required_faces(plan: Plan) -> BoolArray | None:
    """(T,) bool, something of the face is to be covered; None: all of the building is."""
    if plan.required is None:
        return None
    return np.logical_or.reduceat(plan.required, plan.survey.patches.first_patch[:-1])


def author_results(layer: Layer, results: FaceResults, places: tuple[MeshPlace, ...]) -> None:
    """Write coverage, number of stations, best range and the coverage colour of every face of every mesh."""
    set_stage_metadata(layer, "Plan")
    colour = face_colour_index(results.coverage, results.required)
    for place in places:
        mesh = over(layer, place.path)
        faces = place.triangles
        put_primvar(mesh, "tlsplan:coverage", TYPES.FloatArray, float_array(results.coverage[faces]), "uniform")
        put_primvar(mesh, "tlsplan:timesSeen", TYPES.IntArray, int_array(results.times_seen[faces]), "uniform")
        put_primvar(mesh, "tlsplan:bestRange", TYPES.FloatArray, float_array(results.best_range_m[faces]), "uniform")
        # Only the colours in use: a mesh's palette is then small, and a face's colour stays an index into it.
        used, index = np.unique(colour[faces], return_inverse=True)
        put_colours(mesh, FACE_COLOURS_SRGB[used], "uniform", index.ravel())
