"""Patch mode against the beams themselves: do they see the same patches, and what does either cost.

    python tests/benchmarks/bench_patch_mode.py [--write docs/benchmarks/patch-mode.md] [--quick]

Stations are candidates of the planner's own grid, spread evenly over all floors. Beams are a dome from -60 to 90
degrees. Every patch that one mode sees and the other does not is put down to one cause, the first that holds:

- two surfaces in one place: the line to a visible sample ends on another triangle within rounding of it, or a beam that
  was to see the patch was counted for such a triangle. Both are right.
- spacing: fewer than 5 beams are to be expected on the patch, or it is narrower than 1.5 rows: chance decides.
- sliver: less than a twentieth of the patch is seen, by the count of its beams or its samples.
- limit: part of the patch lies beyond a limit of range or elevation.
- other: what is left.

CPU time of the process, so of all its threads, in turns; medians. Not a test: nothing here can fail.
"""

from __future__ import annotations

import argparse
import os
import platform
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

import scenes_synthetic
from planner_core.coverage.survey import make_survey
from planner_core.device import open_device
from planner_core.engine.opencl import OpenCLEngine
from planner_core.engine.patch_mode import AUTO_PATCHES_BEAMS, PatchMode
from planner_core.engine.patch_samples import places_of, sample_pattern, view_of
from planner_core.model import BeamTemplate, Patches, PlanSettings, Scene
from planner_core.positions.admissibility import Tripods
from planner_core.positions.candidates import find_candidates
from planner_core.scanner.load_scanner import load_scanner
from planner_core.scene.load import load_scene

REPOSITORY = Path(__file__).resolve().parents[2]
IFC_FOLDER = REPOSITORY.parent / "shared" / "data" / "ifc"
CAUSES = ("two surfaces in one place", "spacing", "sliver", "limit", "other")
AGREEMENT_STEPS_DEG = (0.2, 0.05, 0.02)
#: Steps, and how often each station is scanned in one call: large templates are tiled once for up to 64 positions.
COST_STEPS_DEG = {0.4: 2, 0.2: 2, 0.1: 2, 0.05: 1, 0.02: 0.25}


@dataclass
class Site:
    name: str
    scene: Scene
    patches: Patches
    engine: OpenCLEngine
    stations: np.ndarray


@dataclass
class Agreement:
    """Areas in m^2, sums over stations. only_*: by cause."""

    site: str
    step_deg: float
    n_stations: int
    total: float
    either: float
    only_beams: np.ndarray
    only_patches: np.ndarray

    @property
    def apart(self) -> float:
        return float(self.only_beams.sum() + self.only_patches.sum())


def dome(step_deg: float) -> BeamTemplate:
    return BeamTemplate(
        azimuth_rad=np.arange(round(360 / step_deg)) * (2 * np.pi / round(360 / step_deg)),
        elevation_rad=np.deg2rad(np.linspace(90, -60, round(150 / step_deg) + 1)),
        range_min_m=0.5,
        range_max_m=50.0,
    )


def site_of(name: str, scene: Scene, n_stations: int) -> Site:
    settings = PlanSettings(scanner=load_scanner("hdl-64e"), grid_step_m=1.0, instrument_heights_m=(1.7,))
    survey = make_survey(scene, settings)
    engine = OpenCLEngine(scene, survey.patches, open_device())
    found = find_candidates(Tripods(survey, settings, engine)).position_m
    at = np.unique(np.linspace(0, len(found) - 1, n_stations).astype(int))
    return Site(name, scene, survey.patches, engine, found[at])


def sites(n_stations: int) -> list[Site]:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "house.ifc"
        scenes_synthetic.write(scenes_synthetic.build("house"), path)
        out = [site_of("house", load_scene(path), n_stations)]
    return out + [site_of(path.stem, load_scene(path), n_stations) for path in sorted(IFC_FOLDER.glob("*.ifc"))]


# --------------------------------------------------------------------------------------------- agreement
def compare(site: Site, step_deg: float, stations: np.ndarray, say: Callable[[str], None]) -> Agreement:
    template = dome(step_deg)
    mode = PatchMode(site.engine, site.scene, site.patches)
    area = site.patches.area_m2
    out = Agreement(
        site.name, step_deg, len(stations), len(stations) * float(area.sum()), 0.0, np.zeros(5), np.zeros(5)
    )
    for number, station in enumerate(stations):
        at = station[None].astype(np.float32).astype(np.float64)
        returns = site.engine.patch_returns(template, at)
        views = mode.see(template, at)
        only_beams = np.setdiff1d(returns.patch, views.patch)
        only_patches = np.setdiff1d(views.patch, returns.patch)
        out.either += float(area[np.union1d(returns.patch, views.patch)].sum())
        count = np.zeros(site.patches.n_patches)
        count[returns.patch] = returns.n_returns
        share = np.zeros(site.patches.n_patches)
        share[views.patch] = views.share
        for patch, by_cause in ((only_beams, out.only_beams), (only_patches, out.only_patches)):
            by_cause += causes(site, template, at[0], patch.astype(np.int32), count, share, area)
        say(f"{site.name} {step_deg} deg station {number + 1}/{len(stations)}")
    return out


def causes(
    site: Site,
    template: BeamTemplate,
    station: np.ndarray,
    patch: np.ndarray,
    count: np.ndarray,
    share: np.ndarray,
    area: np.ndarray,
) -> np.ndarray:
    """Area of the patches by cause."""
    view = view_of(template)
    places = places_of(site.scene, site.patches, patch)
    corners = places.corners_m - station
    middle = corners.mean(axis=1)
    range_m = np.linalg.norm(middle, axis=1)
    across = np.maximum(np.hypot(middle[:, 0], middle[:, 1]), 1e-9)
    facing = np.abs((middle * places.normal).sum(axis=1)) / range_m
    expected = places.area_m2 * facing / (range_m * across * view.azimuth_step_rad * view.elevation_step_rad)
    # Extent of the patch across the beams, in beams: along its own narrowest direction as the station sees it.
    along = middle / range_m[:, None]
    flat = corners - (corners * along[:, None]).sum(axis=2, keepdims=True) * along[:, None]
    longest = np.linalg.norm(flat - np.roll(flat, 1, axis=1), axis=2).max(axis=1)
    narrow = 2 * places.area_m2 * facing / np.maximum(longest, 1e-12) / range_m
    tightest = np.minimum(view.elevation_step_rad, view.azimuth_step_rad * across / range_m)
    spacing = (expected < 5) | (narrow < 1.5 * np.maximum(tightest, view.elevation_step_rad))
    seen_share = np.where(count[patch] > 0, count[patch] / np.maximum(expected, 1e-9), share[patch])
    elevation = np.arcsin(corners[..., 2] / np.linalg.norm(corners, axis=2))
    distance = np.linalg.norm(corners, axis=2)
    limit = (elevation.min(axis=1) < view.low_rad) | (distance.max(axis=1) > view.range_max_m)
    limit |= distance.min(axis=1) < view.range_min_m
    reasons = [shares_its_place(site, station, corners, patch), spacing, seen_share < 0.05, limit]
    first = np.select(reasons, [0, 1, 2, 3], default=4) if patch.size else np.zeros(0, dtype=int)
    return np.bincount(first, weights=area[patch], minlength=5)


def shares_its_place(site: Site, station: np.ndarray, corners: np.ndarray, patch: np.ndarray) -> np.ndarray:
    """Whether a line to one of the patch's samples meets another triangle within 0.1 mm of the sample first."""
    weights = sample_pattern()[:, :2]
    samples = corners[:, :1] + np.einsum("sk,nki->nsi", weights, corners[:, 1:] - corners[:, :1])
    constraint = np.linalg.norm(samples, axis=2)
    flat = samples.reshape(-1, 3)
    hits = site.engine.cast_rays(np.broadcast_to(station, flat.shape), flat, range_max_m=np.inf)
    near = np.abs(hits.range_m.reshape(constraint.shape) - constraint) < 1e-4 + 2e-5 * constraint
    own = hits.triangle.reshape(constraint.shape) == site.patches.triangle_of_patch[patch][:, None]
    return (near & ~own).any(axis=1)


# ------------------------------------------------------------------------------------------------- cost
@dataclass
class Cost:
    site: str
    step_deg: float
    n_beams: int
    beams_ms: float
    patches_ms: float


def cpu_ms(work: Callable[[], object]) -> float:
    start = time.process_time()
    work()
    return 1e3 * (time.process_time() - start)


def cost(site: Site, step_deg: float, stations: np.ndarray, rounds: int) -> Cost:
    template = dome(step_deg)
    mode = PatchMode(site.engine, site.scene, site.patches)
    mode.visible_patches(template, stations[:1])
    site.engine.visible_patches(template, stations[:1])
    beams, patches = [], []
    for _ in range(rounds):
        patches.append(cpu_ms(lambda: mode.visible_patches(template, stations)) / len(stations))
        beams.append(cpu_ms(lambda: site.engine.visible_patches(template, stations)) / len(stations))
    rows, columns = template.shape
    return Cost(site.name, step_deg, rows * columns, float(np.median(beams)), float(np.median(patches)))


# ---------------------------------------------------------------------------------------------- writing
def as_markdown(agreements: list[Agreement], costs: list[Cost], remarks: list[str]) -> str:
    lines = [
        "# Patch mode against beams",
        "Written by `tests/benchmarks/bench_patch_mode.py`, which says what is measured and how causes are told. "
        "The method: [patch mode](../method/patch-mode.md).",
        "",
        f"{open_device().label}, {os.cpu_count()} cores, {platform.machine()}, Python {platform.python_version()}. "
        "GPUs: [gpu.md](gpu.md).",
        "",
        *(f"- {remark}" for remark in remarks),
        "",
        "## Agreement",
        'Share of patch area on which both modes agree about "seen": of all patches, and of those that either sees.',
        "",
        "| scene | step | stations | of all area | of seen area | but for two surfaces in one place |",
        "|---|---|---|---|---|---|",
    ]
    for row in agreements:
        twice = row.only_beams[0] + row.only_patches[0]
        lines.append(
            f"| {row.site} | {row.step_deg:g}° | {row.n_stations} | {100 * (1 - row.apart / row.total):.2f} % | "
            f"{100 * (1 - row.apart / row.either):.2f} % | {100 * (1 - (row.apart - twice) / row.either):.2f} % |"
        )
    lines += [
        "",
        "The rest by cause, as a share of the area that either mode sees:",
        "",
        "| scene | step | seen by | " + " | ".join(CAUSES) + " |",
        "|---|---|---|" + "---|" * len(CAUSES),
    ]
    for row in agreements:
        for who, areas in (("beams alone", row.only_beams), ("patches alone", row.only_patches)):
            shares = " | ".join(f"{100 * value / row.either:.2f} %" for value in areas)
            lines.append(f"| {row.site} | {row.step_deg:g}° | {who} | {shares} |")
    lines += [
        "",
        "## Cost",
        f"CPU time a station, `visible_patches` of either mode, of calls with many stations. `auto` takes patches from "
        f"{AUTO_PATCHES_BEAMS:,} beams a scan on.",
        "",
        "| scene | step | beams | beams ms | patches ms | ratio |",
        "|---|---|---|---|---|---|",
    ]
    lines += [
        f"| {c.site} | {c.step_deg:g}° | {c.n_beams:,} | {c.beams_ms:.0f} | {c.patches_ms:.0f} | "
        f"{c.beams_ms / c.patches_ms:.1f} |"
        for c in costs
    ]
    return "\n".join([*lines, ""])


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--write", type=Path, help="also write the tables to this Markdown file")
    parser.add_argument("--quick", action="store_true", help="three stations, coarse steps")
    options = parser.parse_args()
    n_stations = 3 if options.quick else 24
    agreements, costs, remarks = [], [], []

    def say(line: str) -> None:
        print(line, file=sys.stderr)

    for site in sites(n_stations):
        remarks.append(f"{site.name}: {site.scene.n_triangles} triangles, {site.patches.n_patches} patches")
        say(remarks[-1])
        # The finest step is some seconds of beams a station: fewer stations do.
        for step in AGREEMENT_STEPS_DEG[:2] if options.quick else AGREEMENT_STEPS_DEG:
            stations = site.stations if step > 0.03 else site.stations[::6]
            agreements.append(compare(site, step, stations, say))
        for step, times in list(COST_STEPS_DEG.items())[: 2 if options.quick else None]:
            stations = np.repeat(site.stations, int(times), axis=0) if times >= 1 else site.stations[:: int(1 / times)]
            costs.append(cost(site, step, stations, rounds=1 if step < 0.03 else 3))
            say(f"{costs[-1]}")
    text = as_markdown(agreements, costs, remarks)
    print(text)
    if options.write is not None:
        options.write.parent.mkdir(parents=True, exist_ok=True)
        options.write.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
