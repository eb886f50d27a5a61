"""plan.json: the plan as one document with stable keys. Plan -> dict -> text; docs/formats/plan.md explains every key.

Positions and elevations are in the scene frame (local + offset), metres. Two runs with the same input and seed give the
same bytes once the keys `DROPPABLE_KEYS` are taken out.
"""

from __future__ import annotations

import json
import os
import platform
from collections.abc import Sequence
from dataclasses import replace
from importlib import metadata
from pathlib import Path
from typing import Any

import numpy as np

from planner_core.coordinates.frame import site_frame
from planner_core.documents import is_deeper, read_as, to_document
from planner_core.errors import PlanFolderError
from planner_core.model import (
    Doors,
    Element,
    Floor,
    Glass,
    Loss,
    NetworkGap,
    Optics,
    Plan,
    Scene,
    SceneSource,
    Scope,
    SiteFrame,
    Station,
    UnseenElement,
    UpAxis,
    VisibilityMode,
)
from planner_core.model.options import options_of
from planner_core.model.planning import PlanParameters, fields_of
from planner_core.model.registration import Link, Place, RegistrationNetwork
from planner_core.plan_folder.plan_model.document import SCHEMA, PlanDocument
from planner_core.plan_folder.plan_model.given import PlannedParameters, PlannedRequirements, ResultSection
from planner_core.plan_folder.plan_model.results import (
    CoverageFigures,
    FieldTimeSection,
    GapSection,
    LossSection,
    NetworkSection,
)
from planner_core.plan_folder.results_json import rounded, route_document, unreachable_document, why_document
from planner_core.requirements.goals import obstacles_of, required_of
from planner_core.scene.file_formats import is_scene_file
from planner_core.scene.load import LoadOptions

DROPPABLE_KEYS = ("device", "source", "timings_s", "versions")
"""What may differ between two runs of the same plan."""

_MOST_DEEP = 64
"""Lists and mappings inside each other; plans have a dozen."""

#: Open3D is `open3d-cpu` on x86-64 Linux.
_PACKAGES = ("tlsplan", "ifcopenshell", "numba", "numpy", "open3d", "open3d-cpu", "pyopencl", "scipy", "usd-core")


def plan_document(plan: Plan, folder: Path | None = None) -> dict[str, Any]:
    """The contents of plan.json, as plain dicts and lists; numbers that are not finite are None.

    folder : the plan folder that it is for, from which `source` gives the path to the scene file.
    """
    return {
        "schema": SCHEMA,
        "scene": _scene(plan.survey.scene),
        "source": _source(plan.survey.scene, folder),
        "scanner": to_document(plan.settings.scanner),
        "requirements": _requirements(plan),
        "method": plan.settings.method.name,
        "method_options": options_of(plan.settings.method),
        "seed": plan.settings.seed,
        "settings": _settings(plan),
        "site": to_document(plan.settings.site),
        "floors": [_floor(floor, plan) for floor in plan.survey.floors],
        "stations": _stations(plan),
        "scope": _scope(plan),
        "coverage": _coverage(plan),
        "coverage_curve": [rounded(value, 9) for value in plan.coverage_curve],
        "optimality": _optimality(plan),
        "registration": _registration(plan),
        "route": route_document(plan),
        "field_time": None if plan.field_time is None else FieldTimeSection.of(plan.field_time),
        "sealed": unreachable_document(plan),
        "unseen": [_unseen(part, plan.survey.scene) for part in plan.unseen],
        "why": None if plan.why is None else why_document(plan.why, plan.survey.scene),
        "judge": None if plan.independent_check is None else to_document(plan.independent_check),
        "warnings": list(plan.warnings),
        "device": plan.engine,
        "versions": _versions(),
        "timings_s": {stage: rounded(plan.timings_s[stage], 3) for stage in sorted(plan.timings_s)},
    }


def site_frame_of(plan: Plan) -> SiteFrame:
    """Site coordinates by the plan's scene file: what formats of others are written in, unless given otherwise."""
    return site_frame(
        {
            "scene": {"georeference": _georeference(plan.survey.scene)},
            "floors": [_floor(floor, plan) for floor in plan.survey.floors],
            "stations": [_station(station, plan.survey.scene) for station in plan.stations],
        }
    )


def plan_text(plan: Plan, folder: Path | None = None) -> str:
    """Return the document as the text of the file: UTF-8, two spaces, keys in the order of `plan_document`."""
    return json.dumps(plan_document(plan, folder), indent=2, ensure_ascii=False, allow_nan=False) + "\n"


def read_plan(path: Path) -> PlanDocument:
    """Read a plan.json, given the file or its plan folder.

    Raises
    ------
    PlanFolderError
        There is none, it is no JSON, of a schema that this version does not know, or a value is not as it is written.
    """
    file = path / "plan.json" if path.is_dir() else path
    if is_scene_file(file):
        raise PlanFolderError(
            f"{file}: is a scene file, expected a plan folder; name that of its plan, `tlsplan plan` makes one"
        )
    try:
        text = file.read_text(encoding="utf-8")
    except FileNotFoundError:
        raise PlanFolderError(f"{file}: no such file, expected a plan; make one with `tlsplan plan`") from None
    except (OSError, UnicodeDecodeError) as error:
        raise PlanFolderError(f"{file}: can't be read ({error}), expected a plan.json; check the path") from error
    try:
        document = json.loads(text)
        is_too_deep = is_deeper(document, _MOST_DEEP)
    except ValueError as error:
        remedy = "plan again" if file.name == "plan.json" else "name the plan folder"
        raise PlanFolderError(f"{file}: is not JSON ({error}), expected a plan.json; {remedy}") from error
    except RecursionError:
        is_too_deep = True
    if is_too_deep:
        raise PlanFolderError(
            f"{file}: has more than {_MOST_DEEP} lists and mappings inside each other, expected a plan.json; plan again"
        )
    found = document.get("schema") if isinstance(document, dict) else None
    if found != SCHEMA:
        raise PlanFolderError(
            f"{file}: schema is {found!r}, expected {SCHEMA!r}; plan again, or use the version of tlsplan that wrote it"
        )
    return read_as(PlanDocument, document, f"{file.absolute()}: ", remedy="plan again", error=PlanFolderError)


def read_plan_json(path: Path) -> dict[str, Any]:
    """Read the document as `plan_document` writes it, with what plans of older versions lack; raises as `read_plan`."""
    return read_plan(path).model_dump(mode="json", by_alias=True)


def _source(scene: Scene, folder: Path | None) -> dict[str, Any] | None:
    """The ways from the plan folder to the scene files; None for scenes from memory, and across Windows' drives."""
    files = [source.path for source in scene.sources]
    if folder is None or not all(path.is_file() for path in files):
        return None
    try:
        # Folders as they really are, since `..` leads out of where a link points to; files keep their names.
        ways = [os.path.relpath(path.parent.resolve() / path.name, folder.resolve()) for path in files]
    except ValueError:
        return None
    # Halves of surrogate pairs, which stand for bytes that are no UTF-8, are all that a document can't hold.
    first, *others = (Path(way).as_posix().encode("utf-8", "backslashreplace").decode() for way in ways)
    return {"path": first, "other_paths": others}


def _scene(scene: Scene) -> dict[str, Any]:
    report = scene.report
    return {
        **_file(scene.source),
        "glass": scene.source.glass,
        "doors": scene.source.doors,
        **_options_section(scene.source),
        "other_files": [{**_file(source), **_options_section(source)} for source in scene.further_sources],
        "n_doors_open": report.n_doors_open,
        "offset": [rounded(value) for value in scene.offset_m],
        "georeference": _georeference(scene),
        "n_elements": len(scene.elements),
        "n_triangles": scene.n_triangles,
        "glass_area_m2": rounded(report.glass_area_m2),
        "mirror_area_m2": rounded(report.mirror_area_m2),
        "n_triangles_passing": _n_of(scene, Optics.PASSES),
        "n_triangles_stopping": _n_of(scene, Optics.STOPS),
        "repairs": {
            "faces_read": report.n_faces_read,
            "non_finite": report.n_non_finite,
            "degenerate": report.n_degenerate,
            "duplicate": report.n_duplicate,
            "bad_index": report.n_bad_index,
            "stray": report.n_stray,
            "dropped": list(report.dropped),
            "warnings": list(report.warnings),
        },
    }


def _file(source: SceneSource) -> dict[str, Any]:
    return {
        "file": source.path.name,
        "sha256": source.sha256,
        "format": source.format,
        "schema": source.schema,
        "units": source.unit_name,
        "metres_per_unit": source.metres_per_unit,
        "up_axis": source.up_axis,
    }


def _options_section(source: SceneSource) -> dict[str, Any]:
    return {"load_options": to_document(_load_options(source))}


def _load_options(source: SceneSource) -> LoadOptions:
    return LoadOptions(
        metres_per_unit=source.given_metres_per_unit,
        up_axis=None if source.given_up_axis is None else UpAxis(source.given_up_axis),
        skip_bad_faces=source.skip_bad_faces,
        glass=Glass(source.glass),
        doors=Doors(source.doors),
        doors_open=source.doors_open,
        doors_shut=source.doors_shut,
        leave_out=source.leave_out,
    )


def _georeference(scene: Scene) -> dict[str, Any] | None:
    """The scene file's georeference, with all digits: coordinates are made of it."""
    return None if scene.georeference is None else to_document(scene.georeference)


def _n_of(scene: Scene, optics: Optics) -> int:
    return 0 if scene.optics_of_triangle is None else int((scene.optics_of_triangle == optics).sum())


def _requirements(plan: Plan) -> dict[str, Any]:
    written = to_document(PlannedRequirements(**vars(plan.settings.requirements)))
    return {**written, "results": [ResultSection.of(result) for result in plan.requirements]}


def _settings(plan: Plan) -> dict[str, Any]:
    used = {
        **fields_of(PlanParameters, plan.settings),
        "scan_mode": VisibilityMode(plan.survey.scan_mode),
        "n_candidates": plan.n_candidates,
        "n_patches": plan.survey.patches.n_patches,
    }
    return to_document(PlannedParameters(**used))


def _registration(plan: Plan) -> dict[str, Any]:
    required, found = plan.settings.requirements, plan.registration
    links = {
        "threshold": required.overlap,
        "min_strength": required.min_strength,
        "min_probability": required.min_probability,
        "pre_alignment": str(plan.settings.pre_alignment),
        "doors_change": required.doors_change,
        "connected": plan.connected,
        "links": [to_document(link_in_scene(link, plan.survey.scene)) for link in plan.links],
    }
    if found is None:
        return links
    return {
        **links,
        "networks": [NetworkSection.of(_network_in_scene(network, plan.survey.scene)) for network in found.networks],
        "floor_joins": [[link.a, link.b] for link in found.floor_joins],
        "gaps": [GapSection.of(_in_scene(gap, plan.survey.scene)) for gap in found.gaps],
        "doors_needed": list(found.doors_needed),
        "joins": [to_document(join) for join in found.joins],
    }


def _in_scene(gap: NetworkGap, scene: Scene) -> NetworkGap:
    return replace(gap, targets_m=_places_in_scene(gap.targets_m, scene))


def _network_in_scene(network: RegistrationNetwork, scene: Scene) -> RegistrationNetwork:
    weakest = network.bottleneck
    return replace(network, bottleneck=None if weakest is None else link_in_scene(weakest, scene))


def link_in_scene(link: Link, scene: Scene) -> Link:
    """Return a link with its targets where they are in the scene."""
    return replace(link, targets_m=_places_in_scene(link.targets_m, scene))


def _places_in_scene(places_m: Sequence[Place], scene: Scene) -> tuple[Place, ...]:
    dx, dy, dz = scene.offset_m.tolist()
    return tuple((round(x + dx, 6), round(y + dy, 6), round(z + dz, 6)) for x, y, z in places_m)


def _floor(floor: Floor, plan: Plan) -> dict[str, Any]:
    offset_m = plan.survey.scene.offset_m
    return {
        "id": floor.id,
        "name": floor.name,
        "elevation_m": rounded(floor.elevation_m + offset_m[2]),
        "ground_area_m2": rounded(floor.ground_area_m2),
        "bounds": [[rounded(value) for value in corner] for corner in floor.bounds_m + offset_m[:2]],
        "origin": floor.origin,
        "n_stations": sum(station.floor == floor.id for station in plan.stations),
    }


def _station(station: Station, scene: Scene) -> dict[str, Any]:
    return {
        "id": station.id,
        "floor": station.floor,
        "order": station.order,
        "position": [rounded(value) for value in station.position_m + scene.offset_m],
        "instrument_height_m": rounded(station.instrument_height_m),
        "fixed": station.fixed,
        "covered_area_m2": rounded(station.covered_area_m2),
        "own_area_m2": rounded(station.own_area_m2),
    }


def _stations(plan: Plan) -> list[dict[str, Any]]:
    """Stations with what the plan would lose without each; null where that was not worked out."""
    rows = [_station(station, plan.survey.scene) for station in plan.stations]
    if not plan.losses:
        return [{**row, "lost_area_m2": None, "losses": None} for row in rows]
    return [{**row, **_losses(losses, plan)} for row, losses in zip(rows, plan.losses, strict=True)]


def _losses(losses: tuple[Loss, ...], plan: Plan) -> dict[str, Any]:
    # What several requirements would lose counts once.
    lost = np.unique(np.concatenate([loss.patch for loss in losses]))
    return {
        "lost_area_m2": rounded(float(plan.survey.patches.area_m2[lost].sum())),
        "losses": [LossSection.of(loss) for loss in losses if loss.patch.size],
    }


def _scope(plan: Plan) -> dict[str, Any]:
    """Areas in and out of scope, and of parts of which nothing is required."""
    survey, area_m2 = plan.survey, plan.survey.patches.area_m2
    inside = required_of(survey, plan.settings.requirements)
    obstacles = obstacles_of(survey, plan.settings.requirements)
    outside = ~np.any([inside, *obstacles.values()], axis=0)
    return {
        "kind": Scope.ALL if survey.scope is None else survey.scope.kind,
        "in_scope_area_m2": rounded(float(area_m2[inside].sum())),
        "out_of_scope_area_m2": rounded(float(area_m2[outside].sum())),
        "obstacles": [
            {"name": name, "area_m2": rounded(float(area_m2[patches].sum()))} for name, patches in obstacles.items()
        ],
        "left_out": [
            {"name": name, "area_m2": rounded(area)}
            for name, area in zip(survey.scene.source.leave_out, survey.scene.report.left_out_m2, strict=False)
        ],
    }


def _coverage(plan: Plan) -> dict[str, Any]:
    floors = zip(plan.survey.floors, plan.coverage_by_floor, strict=True)
    return {
        "max_patch_area_m2": rounded(plan.survey.patches.max_area_m2, 9),
        **CoverageFigures.of(plan.coverage),
        "floors": [{"floor": floor.id, **CoverageFigures.of(coverage)} for floor, coverage in floors],
    }


_OBJECTIVES = {"fewest": "fewest stations", "coverage": "most coverage", "time": "least field time"}


def _optimality(plan: Plan) -> dict[str, Any]:
    """Bound 0 is trivial: null. A list that misses the requirement has no gap: it solves another problem."""
    n_stations = len(plan.stations)
    bound = plan.lower_bound if plan.lower_bound > 0 else None
    comparable = bound is not None and n_stations > 0 and _meets_requirement(plan)
    return {
        "objective": _OBJECTIVES[plan.settings.objective],
        "stations": n_stations,
        "lower_bound": bound,
        "gap": rounded((n_stations - plan.lower_bound) / n_stations, 9) if comparable else None,
        "proven": comparable and bound == n_stations,
        "why_stopped": plan.why_stopped,
        "n_candidates_bounded": plan.n_candidates if plan.n_bounded is None else plan.n_bounded,
        "greedy_stations": plan.n_greedy,
        "value": None if plan.objective_value is None else rounded(plan.objective_value, 9),
        "bound": None if plan.objective_bound is None else rounded(plan.objective_bound, 9),
    }


def _meets_requirement(plan: Plan) -> bool:
    """Whether all requirements of surfaces are met."""
    return all(result.met for result in plan.requirements)


def _unseen(part: UnseenElement, scene: Scene) -> dict[str, Any]:
    element: Element = scene.elements[part.element]
    return {
        "element": part.element,
        "name": scene.label(part.element),
        "kind": element.kind,
        "source_id": element.source_id,
        "floor": part.floor,
        "unseen_area_m2": rounded(part.unseen_area_m2),
        "achievable_area_m2": rounded(part.achievable_area_m2),
    }


def _versions() -> dict[str, str]:
    versions = {"python": platform.python_version()}
    for package in _PACKAGES:
        try:
            versions[package] = metadata.version(package)
        except metadata.PackageNotFoundError:
            continue
    return versions
