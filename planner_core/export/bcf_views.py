"""Cameras and snapshots of BCF topics: a place in the building -> an eye that sees it, and what it sees as a PNG.

Local frame, metres. Pictures are cast beam by beam into the building of the plan folder: no screen and no graphics
driver has a say in them.
"""

from __future__ import annotations

import io
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from planner_core.engine.open_engine import open_engine
from planner_core.errors import MissingPackageError
from planner_core.export.sheets.building import Building
from planner_core.model import BoolArray, FloatArray, Int32Array, UInt8Array
from planner_core.model.arrays import area_normals
from planner_core.plan_folder import palette
from planner_core.plan_folder.pictures import Eye
from planner_core.scene.patches import patch_of_points

FIELD_OF_VIEW_DEG = 60.0
"""Horizontal, as BCF 2.1 has it; its schema allows 45 to 60 degrees."""
WIDTH, HEIGHT = 640, 480
NO_ELEMENT = -1

_HALF_WIDTH_TAN = math.tan(math.radians(FIELD_OF_VIEW_DEG) / 2)
_HALF_HEIGHT_TAN = _HALF_WIDTH_TAN * HEIGHT / WIDTH
#: Radii from which a ball fills the height of the picture; nearer than the second number nobody knows what he sees.
_DISTANCE, _LEAST_DISTANCE_M = 1 / math.sin(math.atan(_HALF_HEIGHT_TAN)), 1.5
#: In rooms too small for that, the eye comes nearer, before it looks steeply down or up.
_NEARER = (1.0, 0.6, 0.35)
#: Directions from the place to the eye, those that people like best first.
_ELEVATIONS_DEG, _AZIMUTHS_DEG = (20.0, 50.0, -20.0), range(240, 600, 30)
_SAME_PLACE_M = 0.05
_SKY = (0.97, 0.98, 0.99)
_TURN_COS = math.cos(math.radians(20.0))
_EDGE_SHARE = 0.55
_PIN_PIXELS, _RIM_PIXELS = 7.0, 9.5


@dataclass(frozen=True, eq=False)
class ViewTarget:
    """What a topic is about. target_m : (3,) local; radius_m : of the ball around it that is to be seen.

    element : number of the element in question. also : of all whose unseen surface is shown. eye_m : (3,) where it is
    known to be seen from. pinned : the target is marked in pictures. outside : seen from outside, whatever is in the
    way.
    """

    target_m: FloatArray
    radius_m: float
    element: int = NO_ELEMENT
    eye_m: FloatArray | None = None
    pinned: bool = False
    outside: bool = False
    also: tuple[int, ...] = ()


def eye_towards(position_m: FloatArray, target_m: FloatArray) -> Eye:
    """Stand at a point (3,) and look at another one, head up."""
    forward = (target_m - position_m) / np.linalg.norm(target_m - position_m)
    up = np.array([0.0, 0.0, 1.0]) if abs(forward[2]) < 0.999 else np.array([0.0, 1.0, 0.0])
    right = np.cross(forward, up)
    right /= np.linalg.norm(right)
    return Eye(position_m, right, np.cross(right, forward), forward, _HALF_WIDTH_TAN, _HALF_HEIGHT_TAN)


class Views:
    """Looks at places of a building; without one, eyes are chosen blindly and there are no pictures."""

    def __init__(self, building: Building | None) -> None:
        self._building = building
        if building is not None:
            self._engine = open_engine(building.scene, building.patches, engine="open3d")
            self._element = building.element_numbers[building.scene.element_of_triangle]
            self._unseen = building.achievable & building.required & (building.times_seen == 0)
            corners_m = building.scene.vertices_m[building.scene.triangles]
            normals = area_normals(corners_m)
            self._normals: FloatArray = normals / np.maximum(np.linalg.norm(normals, axis=1), 1e-300)[:, None]

    def first_seen(self, places: Sequence[ViewTarget]) -> ViewTarget:
        """Return the first place whose own eye sees unseen surface that it is about; else the last."""
        if self._building is None:
            return places[0]
        for place in places:
            if place.eye_m is not None and self._sees_unseen(self._building, place.eye_m, place):
                return place
        return places[-1]

    def _sees_unseen(self, building: Building, eye_m: FloatArray, place: ViewTarget) -> bool:
        """Whether unseen surface that a place is about is what a line from a point (3,) to it meets first."""
        towards_m = place.target_m - eye_m
        towards_m /= max(float(np.linalg.norm(towards_m)), _SAME_PLACE_M)
        hits = self._engine.cast_rays(eye_m[None], towards_m[None], range_max_m=math.inf)
        if hits.triangle[0] < 0 or self._element[hits.triangle[0]] not in place.also:
            return False
        at_m = eye_m + towards_m * float(hits.range_m[0])
        patch = patch_of_points(building.scene, building.patches, points_m=at_m[None], triangle=hits.triangle)
        return bool(self._unseen[patch[0]])

    def eye(self, place: ViewTarget) -> Eye:
        """Return the first eye, of those that one would choose, with a free line to the place; else the first."""
        distance_m = max(_DISTANCE * place.radius_m, _LEAST_DISTANCE_M)
        eyes_m = [
            place.target_m + share * distance_m * _directions(elevation_deg)
            for elevation_deg in _ELEVATIONS_DEG
            for share in _NEARER
        ]
        if place.eye_m is not None and np.linalg.norm(place.eye_m - place.target_m) > _SAME_PLACE_M:
            eyes_m.insert(0, place.eye_m[None])
        positions_m = np.concatenate(eyes_m)
        free = np.zeros(len(positions_m), dtype=np.bool_)
        if self._building is not None and not place.outside:
            free = self._see(positions_m, place)
        return eye_towards(positions_m[int(np.argmax(free))], place.target_m)

    def _see(self, positions_m: FloatArray, place: ViewTarget) -> BoolArray:
        """(N,) bool: whether nothing is between points (N, 3) and the place, or its own element only."""
        towards_m = place.target_m - positions_m
        hits = self._engine.cast_rays(positions_m, towards_m, range_max_m=math.inf)
        free: BoolArray = ~(hits.range_m < np.linalg.norm(towards_m, axis=1) - _SAME_PLACE_M)
        if place.element != NO_ELEMENT:
            free |= (hits.triangle >= 0) & (self._element[hits.triangle] == place.element)
        return free

    def picture(self, eye: Eye, place: ViewTarget) -> bytes | None:
        """Draw what the eye sees as a PNG: the element in colour, unseen surface strongest, a pin at the target."""
        if self._building is None:
            return None
        across = ((np.arange(WIDTH) + 0.5) / WIDTH * 2 - 1) * _HALF_WIDTH_TAN
        upwards = (1 - (np.arange(HEIGHT) + 0.5) / HEIGHT * 2) * _HALF_HEIGHT_TAN
        rays = (eye.forward + across[None, :, None] * eye.right + upwards[:, None, None] * eye.up).reshape(-1, 3)
        rays /= np.linalg.norm(rays, axis=1)[:, None]
        hits = self._engine.cast_rays(np.broadcast_to(eye.position_m, rays.shape), rays, range_max_m=math.inf)
        points_m = eye.position_m + rays * np.nan_to_num(hits.range_m.astype(np.float64))[:, None]
        rgb = self._colours(points_m, rays, hits.triangle, place).reshape(HEIGHT, WIDTH, 3)
        if place.pinned:
            _pin(rgb, eye.project(place.target_m[None])[0])
        return _png(np.rint(255 * rgb).astype(np.uint8))

    def _colours(self, points_m: FloatArray, rays: FloatArray, triangle: Int32Array, place: ViewTarget) -> FloatArray:
        """(N, 3) sRGB in [0, 1] of beams along rays (N, 3) that meet triangles (N,) at points (N, 3)."""
        assert self._building is not None
        scene, there = self._building.scene, triangle >= 0
        normal = np.where(there[:, None], self._normals[triangle], 0.0)
        of = np.where(there, self._element[triangle], NO_ELEMENT - 1)
        rgb = np.where(there[:, None], palette.NEUTRAL, _SKY)
        rgb[there & (of == place.element)] = 0.35 * np.array(palette.UNSEEN) + 0.65
        own = np.flatnonzero(there & np.isin(of, (place.element, *place.also)))
        patch = patch_of_points(scene, self._building.patches, points_m=points_m[own], triangle=triangle[own])
        rgb[own[self._unseen[patch]]] = palette.UNSEEN
        shade = np.where(there, 0.62 + 0.38 * np.abs(np.einsum("ij,ij->i", normal, rays)), 1.0)
        shade[_is_edge(normal.reshape(HEIGHT, WIDTH, 3), of.reshape(HEIGHT, WIDTH)).ravel()] *= _EDGE_SHARE
        return np.asarray(rgb * shade[:, None])


def _directions(elevation_deg: float) -> FloatArray:
    """(N, 3) unit vectors, all around."""
    elevation, azimuth = np.radians(elevation_deg), np.radians(np.array(_AZIMUTHS_DEG))
    level = np.cos(elevation) * np.stack([np.cos(azimuth), np.sin(azimuth)], axis=1)
    return np.column_stack([level, np.full(len(azimuth), np.sin(elevation))])


def _is_edge(normal: FloatArray, element: Int32Array) -> BoolArray:
    """(H, W) bool: pixels beside which another element, or another face of it, begins."""
    edge = np.zeros(element.shape, dtype=np.bool_)
    for axis in (0, 1):
        here = tuple(slice(None, -1) if axis == each else slice(None) for each in (0, 1))
        beside = tuple(slice(1, None) if axis == each else slice(None) for each in (0, 1))
        turns = np.abs(np.einsum("ijk,ijk->ij", normal[here], normal[beside])) < _TURN_COS
        edge[here] |= (element[here] != element[beside]) | (turns & (element[here] > NO_ELEMENT - 1))
    return edge


def _pin(rgb: FloatArray, at: FloatArray) -> None:
    """Draw a disc with a white rim. at : (2,) -1 to 1 from the left to the right and from the bottom to the top."""
    column, row = (at[0] + 1) / 2 * WIDTH - 0.5, (1 - at[1]) / 2 * HEIGHT - 0.5
    away = np.hypot(np.arange(WIDTH)[None, :] - column, np.arange(HEIGHT)[:, None] - row)
    rgb[away <= _RIM_PIXELS] = 1.0
    rgb[away <= _PIN_PIXELS] = palette.LINK


def _png(rgb: UInt8Array) -> bytes:
    try:
        from matplotlib import image
    except ImportError as error:
        raise MissingPackageError(
            f"snapshots need the package matplotlib, which can't be imported ({error}): pip install matplotlib"
        ) from error
    out = io.BytesIO()
    save: Any = image.imsave  # whose stubs know no metadata that is left out
    save(out, rgb, format="png", metadata={"Software": None})
    return out.getvalue()
