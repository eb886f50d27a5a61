"""The USD stage of a plan folder, as two views of one model: layers for USD viewers, one flat file for the browser.

Plan, FaceResults -> plan.usda, review.usda, stage/*, viewer/stage.usdc; docs/formats/stage.md is the contract. Both
views are written by the same functions; the flat one needs no composition because all of them write into one layer.
"""

from __future__ import annotations

from pathlib import Path

from planner_core.errors import PlanFolderError
from planner_core.model import Plan, SiteFrame
from planner_core.plan_folder.carry_over import HEATMAPS_FILE, STAGE_FILES
from planner_core.plan_folder.face_results import FaceResults, author_results
from planner_core.plan_folder.plan_json import site_frame_of
from planner_core.plan_folder.sdf_authoring import Layer, Sdf, Tf, new_layer, put_site, set_stage_metadata
from planner_core.plan_folder.usd_building import author_building
from planner_core.plan_folder.usd_heatmaps import heatmaps_layer
from planner_core.plan_folder.usd_names import mesh_places
from planner_core.plan_folder.usd_stations import author_stations

DOCUMENTATION = (
    "A plan of scanner stations. Local frame in metres, z up: scene = local + tlsplan:offset of /Plan. The variants "
    "heatmap of /Plan choose what colours show; clouds are payloads."
)
REVIEW_COMMENT = "What reviewers changed. This layer is the strongest of plan.usda; the plan itself stays untouched."


def write_stage(plan: Plan, results: FaceResults, folder: Path) -> None:
    """Write `STAGE_FILES` below `folder`; the clouds are `usd_clouds`, one a station.

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
