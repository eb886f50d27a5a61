"""Clouds as a scanner delivers them, for registration: what stands near a beam's edge, and what no two scans share.

Scene, sensor origins (local frame, metres) -> `Cloud`s, each in its station's frame, at a heading drawn at random.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from planner_core.engine.scan_engine import ScanEngine
from planner_core.model import FloatArray, Int64Array, Optics, Scene

STEP_RAD = np.deg2rad(0.25)
"""Between beams: 4.4 cm at 10 m, about the finest voxel that clouds are registered with."""
ELEVATIONS_RAD = (np.deg2rad(-60.0), np.deg2rad(90.0))
RANGES_M = (0.5, 60.0)
NOISE_M = 0.001
"""One sigma of a range, head on; larger with the root of the signal lost by incidence."""
ANGLE_NOISE_RAD = np.deg2rad(18.0 / 3600.0)
BEAM_DIAMETER_M, BEAM_DIVERGENCE_RAD = 0.006, 0.0005
MIXED_WITHIN_M = 1.5
"""Two surfaces that a beam meets less than this apart give one return between them; farther apart, the nearer one."""
# Systematic errors, one sigma, drawn once a scan.
OFFSET_M, SCALE, TILT_RAD, GRAZING_M = 0.0005, 20e-6, np.deg2rad(10.0 / 3600.0), 0.0007
BEND_M, BEND_OVER_M = 0.002, 2.3
"""Walls are bent by as much, over a length of that, and all scans of a scene see the same."""


@dataclass(frozen=True)
class Cloud:
    """points_m : (N, 3) in the station's frame. pose : (4, 4) from there to the scene's local frame, the truth."""

    points_m: FloatArray
    pose: FloatArray


def scan(engine: ScanEngine, scene: Scene, origin_m: FloatArray, random: np.random.Generator) -> Cloud:
    """Scan from a station with all errors."""
    heading = random.uniform(0.0, 2.0 * np.pi)
    beams = _beams(random)
    pose = np.eye(4)
    pose[:3, :3] = _about((0.0, 0.0, 1.0), heading)
    pose[:3, 3] = origin_m
    out = beams @ pose[:3, :3].T
    range_m, triangle = _first_returns(engine, scene, origin_m, out)
    # What the edge of the beam meets: a ray beside its middle, evenly spread over its section.
    radius = np.sqrt(random.random(out.shape[0])) * (BEAM_DIAMETER_M / 2 + range_m * BEAM_DIVERGENCE_RAD / 2)
    beside, _ = _first_returns(engine, scene, origin_m, _deflected(out, radius / range_m, random))
    weight = random.random(out.shape[0])
    mixed = np.abs(beside - range_m) < MIXED_WITHIN_M
    nearer = np.fmin(beside, range_m)
    measured = np.where(mixed, weight * range_m + (1.0 - weight) * beside, nearer)
    cosine = np.abs(np.einsum("ij,ij->i", _normals(scene, triangle), out))
    world = origin_m + measured[:, None] * out
    bend = BEND_M * np.sin(world / BEND_OVER_M + np.arange(3)).sum(axis=1)
    measured = measured + bend / np.maximum(cosine, 0.2)
    sigma = NOISE_M / np.sqrt(np.maximum(cosine, 0.05))
    grazing = np.minimum(1.0 / np.maximum(cosine, 0.05) - 1.0, 5.0)
    measured = (
        measured * (1.0 + SCALE * random.standard_normal())
        + OFFSET_M * random.standard_normal()
        + GRAZING_M * random.standard_normal() * grazing
        + sigma * random.standard_normal(measured.size)
    )
    kept = np.isfinite(measured) & (measured >= RANGES_M[0]) & (measured <= RANGES_M[1])
    found = _deflected(beams[kept], np.abs(ANGLE_NOISE_RAD * random.standard_normal(int(kept.sum()))), random)
    tilt = _about((1.0, 0.0, 0.0), TILT_RAD * random.standard_normal())
    tilt = tilt @ _about((0.0, 1.0, 0.0), TILT_RAD * random.standard_normal())
    return Cloud((measured[kept, None] * found) @ tilt.T, pose)


def _beams(random: np.random.Generator) -> FloatArray:
    """(N, 3) unit directions in rings of equal spacing, each ring begun at an angle of its own."""
    rings = []
    low, high = ELEVATIONS_RAD
    for elevation in np.arange(low + STEP_RAD * random.random(), high, STEP_RAD):
        n = max(int(2.0 * np.pi * np.cos(elevation) / STEP_RAD), 1)
        azimuth = 2.0 * np.pi * (np.arange(n) + random.random()) / n
        level = np.cos(elevation)
        rings.append(np.column_stack([level * np.cos(azimuth), level * np.sin(azimuth), np.full(n, np.sin(elevation))]))
    return np.concatenate(rings)


def _first_returns(
    engine: ScanEngine, scene: Scene, origin_m: FloatArray, out: FloatArray
) -> tuple[FloatArray, Int64Array]:
    """Ranges (N,), NaN where nothing returns, and triangles (N,) that are met."""
    usable = np.isfinite(out).all(axis=1)
    rays = np.where(usable[:, None], out, [0.0, 0.0, 1.0])
    hits = engine.cast_rays(
        np.broadcast_to(origin_m, rays.shape).copy(), rays, range_max_m=RANGES_M[1], through_glass=True
    )
    range_m = np.where(usable, hits.range_m.astype(np.float64), np.nan)
    if scene.optics_of_triangle is not None:
        range_m[(hits.triangle >= 0) & (scene.optics_of_triangle[hits.triangle] == Optics.STOPS)] = np.nan
    return range_m, np.maximum(hits.triangle, 0).astype(np.int64)


def _normals(scene: Scene, triangle: Int64Array) -> FloatArray:
    """(N, 3) of triangles (N,)."""
    met, place = np.unique(triangle, return_inverse=True)
    corners = scene.vertices_m[scene.triangles[met]].astype(np.float64)
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-12)
    return np.asarray(normal[place])


def _deflected(out: FloatArray, angle_rad: FloatArray, random: np.random.Generator) -> FloatArray:
    """Directions turned by small angles, each towards a side drawn at random."""
    side = random.standard_normal(out.shape)
    side -= np.einsum("ij,ij->i", side, out)[:, None] * out
    side *= (np.tan(angle_rad) / np.maximum(_lengths(side), 1e-12))[:, None]
    turned = out + side
    return turned / _lengths(turned)[:, None]


def _lengths(vectors: FloatArray) -> FloatArray:
    return np.sqrt(np.einsum("ij,ij->i", vectors, vectors))


def _about(axis: tuple[float, float, float], angle_rad: float) -> FloatArray:
    """(3, 3) rotation about a unit axis, by Rodrigues."""
    x, y, z = axis
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.asarray(np.eye(3) + np.sin(angle_rad) * cross + (1.0 - np.cos(angle_rad)) * cross @ cross)


def moved(shift_m: float, turn_deg: float, random: np.random.Generator) -> FloatArray:
    """(4, 4) a start that is off: evenly drawn within a ball, and turned by at most so much.

    A compensator holds the tilts of the instrument, but not of a start that is placed by hand: a tenth of the turn.
    """
    out = np.eye(4)
    direction = random.standard_normal(3)
    out[:3, 3] = shift_m * random.random() ** (1 / 3) * direction / np.linalg.norm(direction)
    turn_rad = np.deg2rad(turn_deg) * random.uniform(-1.0, 1.0, 3)
    turns = [_about(axis, angle) for axis, angle in zip(np.eye(3), turn_rad * (0.1, 0.1, 1.0), strict=True)]
    out[:3, :3] = turns[0] @ turns[1] @ turns[2]
    return out
