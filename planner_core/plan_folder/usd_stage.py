"""The USD stage of a plan folder, as two views of one model: layers for USD viewers, one flat file for the browser.

Plan, FaceResults -> plan.usda, review.usda, stage/*, viewer/stage.usdc; docs/formats/stage.md is the contract. Both
views are written by the same functions; the flat one needs no composition because all of them write into one layer.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from planner_core.errors import PlanFolderError
from planner_core.model import BeamTemplate, BoolArray, Float32Array, FloatArray, Int32Array, Plan, SiteFrame
from planner_core.plan_folder.carry_over import HEATMAPS_FILE, STAGE_FILES
from planner_core.plan_folder.face_results import FaceResults, author_results, required_faces
from planner_core.plan_folder.palette import (
    NOT_ACHIEVABLE,
    NOT_REQUIRED,
    PATCH_COLOURS_SRGB,
    UNSEEN,
    linear_from_srgb,
    patch_colour_index,
    range_colour_index,
    range_ramp_srgb,
)
from planner_core.plan_folder.plan_json import site_frame_of
from planner_core.plan_folder.sdf_authoring import (
    TYPES,
    Layer,
    Sdf,
    Tf,
    define,
    float_array,
    int_array,
    new_layer,
    over,
    put,
    put_colours,
    put_extent,
    put_primvar,
    put_site,
    put_transform,
    set_stage_metadata,
    vec3f_array,
)
from planner_core.plan_folder.usd_building import VARIANTS, author_building
from planner_core.plan_folder.usd_names import MeshPlace, mesh_places
from planner_core.plan_folder.usd_stations import author_stations
from planner_core.plan_folder.viewer_layers import NONE, layers_of
from planner_core.scanner.template import directions

# ---------------------------------------------------------------------------------------------------------- usd clouds
# The stage's cloud layers: each station's scan, thinned, as UsdGeomPoints relative to the sensor.

MAX_POINTS = 16_000
"""A usdview-class viewer draws some hundred stations of these at once."""

POINT_WIDTH_M = 0.015


def cloud_layer(range_m: Float32Array, template: BeamTemplate) -> Layer:
    """One scan's layer: default prim /Cloud. range_m : (R, C) float32, NaN on a miss."""
    layer = new_layer()
    with Sdf.ChangeBlock():
        set_stage_metadata(layer, "Cloud")
        prim = define(layer, "/Cloud", "Points")
        kept = thinned(template.shape) & np.isfinite(range_m)
        points_m = directions(template)[kept] * range_m[kept, None]
        put_transform(prim)
        # Guide: drawn on request, so that the coverage on the walls behind is seen first.
        put(prim, "purpose", TYPES.Token, "guide", uniform=True)
        put(prim, "points", TYPES.Point3fArray, vec3f_array(points_m))
        put(prim, "widths", TYPES.FloatArray, float_array(np.array([POINT_WIDTH_M]))).SetInfo(
            "interpolation", "constant"
        )
        put_extent(prim, points_m if points_m.size else np.zeros((1, 3)), margin_m=POINT_WIDTH_M / 2)
        put_colours(prim, range_ramp_srgb(), "vertex", range_colour_index(range_m[kept], template.range_max_m))
    return layer


def thinned(shape: tuple[int, int]) -> BoolArray:
    """(R, C) bool: a regular choice of at most `MAX_POINTS` beams, staggered by row so that no stripes show."""
    n_rows, n_columns = shape
    step = max(1, -(-n_rows * n_columns // MAX_POINTS))
    kept: BoolArray
    if step > n_columns:
        kept = np.arange(n_rows * n_columns).reshape(shape) % step == 0
        return kept
    step = max(1, -(-n_columns // max(1, MAX_POINTS // n_rows)))
    shift = (np.arange(n_rows) * 7) % step
    kept = (np.arange(n_columns)[None, :] % step) == shift[:, None]
    return kept


# -------------------------------------------------------------------------------------------------------- usd heatmaps
# The stage's heat maps: a colour a face for each figure, which the variants of `usd_building` choose from.
# Plan, and the layers by patch that its folder holds already -> stage/heatmaps.usdc.

_N_STEPS = 16
#: A figure's colours end where so much of its faces is below; the others have the last one.
_SHOWN_SHARE = 0.95


@dataclass(frozen=True, eq=False)
class HeatMap:
    """index : (T,) int32, colour of each face, into `colours` (K, 3), sRGB. high : where the ramp ends, NaN: none."""

    variant: str
    index: Int32Array
    colours: FloatArray
    unit: str = ""
    high: float = math.nan


def heat_maps(plan: Plan, folder: Path) -> tuple[HeatMap, ...]:
    """Make the maps of a plan from the layers in its folder's `viewer/`; of a figure a face has its patches' mean."""
    first = plan.survey.patches.first_patch[:-1]
    achievable = np.logical_or.reduceat(plan.achievable, first)
    required = required_faces(plan)
    times = np.maximum.reduceat(plan.times_seen, first).astype(np.int32)
    maps = [HeatMap("times_seen", patch_colour_index(times, achievable, required), PATCH_COLOURS_SRGB)]
    for layer in layers_of(plan.settings.scanner):
        if layer.id in VARIANTS:
            steps = np.fromfile(folder / "viewer" / layer.file, dtype="<u2")
            mean = _mean(np.where(steps == NONE, np.nan, steps * layer.step), first)
            high = 90.0 if layer.unit == "deg" else _round_end(mean)
            maps.append(
                HeatMap(layer.id, _ramp_index(mean, high, achievable, required), _ramp_colours(), layer.unit, high)
            )
    return tuple(maps)


def _mean(values: FloatArray, first: np.ndarray) -> FloatArray:
    """(T,) mean of each face's patches that have a figure; NaN where none has."""
    known = np.isfinite(values)
    n = np.add.reduceat(known.astype(np.int64), first)
    total = np.add.reduceat(np.where(known, values, 0.0), first)
    return np.where(n > 0, total / np.maximum(n, 1), np.nan)


def _round_end(values: FloatArray) -> float:
    """The end of a ramp: 1, 2 or 5 times a power of ten that `_SHOWN_SHARE` of the values don't exceed."""
    known = values[np.isfinite(values)]
    most = float(np.quantile(known, _SHOWN_SHARE)) if known.size else 1.0
    power = 10.0 ** math.floor(math.log10(max(most, 1e-6)))
    return next(end for end in (power, 2.0 * power, 5.0 * power, 10.0 * power) if end >= most * (1 - 1e-9))


def _ramp_colours() -> FloatArray:
    ramp = range_ramp_srgb()
    return np.vstack([NOT_ACHIEVABLE, UNSEEN, ramp[np.linspace(0, len(ramp) - 1, _N_STEPS).astype(int)], NOT_REQUIRED])


def _ramp_index(values: FloatArray, high: float, achievable: BoolArray, required: BoolArray | None) -> Int32Array:
    known = np.isfinite(values)
    step = np.clip(np.where(known, values, 0.0) / high * _N_STEPS, 0, _N_STEPS - 1).astype(np.int32)
    index = np.where(known, step + 2, np.where(achievable, 1, 0))
    if required is not None:
        index[~required] = _N_STEPS + 2
    return index.astype(np.int32)


def heatmaps_layer(plan: Plan, folder: Path) -> Layer:
    """Return the layer; folder : of the plan, which has `viewer/layers` already."""
    layer, maps = new_layer(), heat_maps(plan, folder)
    with Sdf.ChangeBlock():
        set_stage_metadata(layer, "Plan")
        root = over(layer, "/Plan")
        for each in maps:
            if math.isfinite(each.high):
                put(root, f"tlsplan:{VARIANTS[each.variant]}High", TYPES.Double, each.high)
                put(root, f"tlsplan:{VARIANTS[each.variant]}Unit", TYPES.String, each.unit)
        _author_maps(layer, maps, mesh_places(plan.survey.scene))
    return layer


def _author_maps(layer: Layer, maps: tuple[HeatMap, ...], places: tuple[MeshPlace, ...]) -> None:
    colours = {each.variant: vec3f_array(linear_from_srgb(each.colours)) for each in maps}  # one of each in the file
    for place in places:
        mesh = over(layer, place.path)
        for each in maps:
            name = VARIANTS[each.variant]
            put_primvar(mesh, name, TYPES.Color3fArray, colours[each.variant], "uniform")
            put(mesh, f"primvars:{name}:indices", TYPES.IntArray, int_array(each.index[place.triangles]))


# ----------------------------------------------------------------------------------------------------------- usd stage
DOCUMENTATION = (
    "A plan of scanner stations. Local frame in metres, z up: scene = local + tlsplan:offset of /Plan. The variants "
    "heatmap of /Plan choose what colours show; clouds are payloads."
)
REVIEW_COMMENT = "What reviewers changed. This layer is the strongest of plan.usda; the plan itself stays untouched."


def write_stage(plan: Plan, results: FaceResults, folder: Path) -> None:
    """Write `STAGE_FILES` below `folder`; the clouds are layers of their own, one a station.

    Raises
    ------
    PlanFolderError
        A file can't be written.
    """
    places = mesh_places(plan.survey.scene)
    building, stations, coverage, flat, review, root = (new_layer() for _ in range(6))
    with Sdf.ChangeBlock():
        author_building(building, plan.survey, places, flat=False)
        author_stations(stations, plan, flat=False)
        author_results(coverage, results, places)
        author_building(flat, plan.survey, places, flat=True)
        author_stations(flat, plan, flat=True)
        author_results(flat, results, places)
        _author_review(review)
        _author_root(root, site_frame_of(plan))
    layers = (root, review, coverage, stations, building, flat)
    for name, layer in zip(STAGE_FILES, layers, strict=True):
        write_layer(layer, folder / name)


def write_heatmaps(plan: Plan, folder: Path) -> None:
    """Write `HEATMAPS_FILE` below `folder`, once its `viewer/layers` is there, and put it under plan.usda's sublayers.

    Raises as `write_stage`.
    """
    write_layer(heatmaps_layer(plan, folder), folder / HEATMAPS_FILE)
    root = new_layer()
    _author_root(root, site_frame_of(plan), with_heatmaps=True)
    write_layer(root, folder / "plan.usda")


def write_layer(layer: Layer, path: Path) -> None:
    """Write a layer as usda or usdc, by the file's suffix; raises PlanFolderError where that fails."""
    path.parent.mkdir(parents=True, exist_ok=True)
    problem = ""
    try:
        written = layer.Export(str(path))
    except Tf.ErrorException as error:
        written, problem = False, str(error).strip().splitlines()[-1].strip()
    if not written:
        raise PlanFolderError(f"{path}: USD could not write the layer; check the free space and permissions {problem}")


def empty_review() -> str:
    """The text of review.usda before anybody reviewed."""
    layer = new_layer()
    _author_review(layer)
    return str(layer.ExportToString())


def _author_review(layer: Layer) -> None:
    set_stage_metadata(layer, "Plan")
    layer.comment = REVIEW_COMMENT


def _author_root(layer: Layer, frame: SiteFrame, *, with_heatmaps: bool = False) -> None:
    set_stage_metadata(layer, "Plan")
    layer.documentation = DOCUMENTATION
    put_site(layer, frame)
    layer.subLayerPaths[:] = [
        "./review.usda",
        *([f"./{HEATMAPS_FILE}"] if with_heatmaps else []),
        "./stage/results.usdc",
        "./stage/stations.usda",
        "./stage/building.usdc",
    ]
