"""Instances from scans: synthetic buildings in three dimensions, seen by the planner's scan engine.

What these see is decided by floating-point numbers of an OpenCL device or of the host. tlsplan promises the same bits
for one version; nobody promises them for good, so the files of these instances are kept, and are the truth. This makes
them anew. Areas are rounded to ticks; candidates, patches and links are the planner's.
"""

from __future__ import annotations

import tempfile
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import numpy as np

import scenes_synthetic
from planner_core.coverage.coverage import floor_of_patch
from planner_core.coverage.survey import make_survey, visible_from
from planner_core.device import open_device
from planner_core.engine.opencl import OpenCLEngine
from planner_core.model import BoolArray, LinkLimits, PlanSettings, Requirements
from planner_core.network.candidate_links import candidate_links
from planner_core.network.links import surface_of_patches
from planner_core.positions.admissibility import Tripods
from planner_core.positions.candidates import find_candidates
from planner_core.scanner.load_scanner import load_scanner
from planner_core.scene.load import load_scene

from .instance import TICKS_PER_M2, Instance
from .plans import Survey, Surveyed, assembled

_STRENGTH = 0.01


@dataclass(frozen=True)
class Scan:
    """scene : name of a synthetic one; floors : names of planned ones, all where empty. patch_m2 : largest patch."""

    scene: str
    grid_m: float
    range_m: float
    patch_m2: float = 0.25
    height_m: float = 1.5
    scanner: str = "hdl-64e"
    floors: tuple[str, ...] = ()


def scanned(name: str, scan: Scan, survey: Survey) -> Instance:
    """Scan a building from all its candidates."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / f"{scan.scene}.glb"
        scenes_synthetic.write(scenes_synthetic.build(scan.scene), path)
        scene = load_scene(path)
    settings = PlanSettings(
        scanner=replace(load_scanner(scan.scanner), range_max_m=scan.range_m),
        instrument_heights_m=(scan.height_m,),
        grid_step_m=scan.grid_m,
        max_patch_area_m2=scan.patch_m2,
        requirements=Requirements(floors=scan.floors),
    )
    made = make_survey(scene, settings)
    engine = OpenCLEngine(scene, made.patches, open_device())
    candidates = find_candidates(Tripods(made, settings, engine))
    seen = visible_from(made, engine, candidates.position_m)
    area_m2 = made.patches.area_m2
    n = seen.n_positions
    sees: BoolArray = np.zeros((n, area_m2.size), dtype=bool)
    sees[np.repeat(np.arange(n), np.diff(seen.starts)), seen.patch] = True
    links = None
    if survey.overlap:
        surface = surface_of_patches(made.scene, made.patches, np.asarray(sees.any(axis=0)))
        limits = LinkLimits(overlap=survey.overlap / 100.0, strength=_STRENGTH)
        found = candidate_links(seen, area_m2, surface, candidates.position_m, limits=limits)
        links = np.zeros((n, n), dtype=bool)
        links[np.repeat(np.arange(n), np.diff(found.starts)), found.neighbour] = True
    floor = floor_of_patch(made.patches, made.floor_of_triangle)
    zone = np.full(area_m2.size, -1, dtype=np.int64)
    for number, index in enumerate(made.planned):
        zone[floor == index] = number
    ticks = np.rint(area_m2 * TICKS_PER_M2).astype(np.int64)
    keep = (ticks > 0) & ((zone >= 0) if scan.floors else np.ones(ticks.size, dtype=bool))
    about = {
        "generator": "scan",
        "scene": scan.scene,
        "scanner": scan.scanner,
        "range_cm": round(100 * scan.range_m),
        "grid_cm": round(100 * scan.grid_m),
        "floors": list(scan.floors),
        "survey": {key: value for key, value in asdict(survey).items() if key in ("whole", "zone", "twice", "overlap")},
    }
    surveyed = Surveyed(
        np.rint(candidates.position_m * 100).astype(np.int64),
        sees[:, keep],
        ticks[keep],
        np.ones(int(keep.sum()), dtype=bool),
        zone[keep],
        links,
    )
    return assembled(name, "scan", about, surveyed, survey)
