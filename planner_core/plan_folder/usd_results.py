"""The stage's results layer: what the plan is worth on every face, as opinions over the building's meshes."""

from __future__ import annotations

import numpy as np

from planner_core.plan_folder.face_results import FaceResults
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
