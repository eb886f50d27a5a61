"""Buildings of closed boxes, turned and moved: plans that are known exactly."""

from collections.abc import Callable

import numpy as np
import pytest

from planner_core.model import Scene
from planner_core.scene.build import scene_from_arrays

Box = tuple[tuple[float, float, float], tuple[float, float, float]]
#: Thickness of slabs and outer walls, and height of rooms.
WALL_M, HIGH_M = 0.2, 2.6


def scene_of(boxes: list[Box], angle_rad: float, at_m: tuple[float, float, float]) -> Scene:
    corner = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], dtype=float)
    faces = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    triangles = [t for a, b, c, d in faces for t in ((a, b, c), (a, c, d))]
    points = np.concatenate(
        [(np.array(low) + corner * (np.array(high) - low))[triangles].reshape(-1, 3) for low, high in boxes]
    )
    turn = np.array([[np.cos(angle_rad), -np.sin(angle_rad)], [np.sin(angle_rad), np.cos(angle_rad)]])
    points = np.column_stack([points[:, :2] @ turn.T, points[:, 2]]) + at_m
    return scene_from_arrays(points, np.arange(len(points)).reshape(-1, 3))


@pytest.fixture(scope="session")
def boxes_scene() -> Callable[..., Scene]:
    """Call with a list of boxes (low, high); `angle_rad` turns them about z, `at_m` moves them afterwards."""

    def make(boxes: list[Box], *, angle_rad: float = 0.0, at_m: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> Scene:
        return scene_of(boxes, angle_rad, at_m)

    return make


@pytest.fixture(scope="session")
def two_rooms() -> Callable[..., list[Box]]:
    """Boxes of two rooms, x from 0 to 4 and from 4 + t to 7 + t, 4 m deep, with doors (y, width) between them."""

    def make(doors: list[tuple[float, float]], *, thickness_m: float = 0.2, high_m: float = HIGH_M) -> list[Box]:
        east = 7.0 + thickness_m
        boxes: list[Box] = [
            ((-WALL_M, -WALL_M, -WALL_M), (east + WALL_M, 4 + WALL_M, 0.0)),
            ((-WALL_M, -WALL_M, high_m), (east + WALL_M, 4 + WALL_M, high_m + WALL_M)),
            ((-WALL_M, -WALL_M, 0.0), (east + WALL_M, 0.0, high_m)),
            ((-WALL_M, 4.0, 0.0), (east + WALL_M, 4 + WALL_M, high_m)),
            ((-WALL_M, 0.0, 0.0), (0.0, 4.0, high_m)),
            ((east, 0.0, 0.0), (east + WALL_M, 4.0, high_m)),
        ]
        begin = 0.0
        for middle, width in sorted(doors):
            boxes.append(((4.0, begin, 0.0), (4.0 + thickness_m, middle - width / 2, high_m)))
            boxes.append(((4.0, middle - width / 2, 2.1), (4.0 + thickness_m, middle + width / 2, high_m)))
            begin = middle + width / 2
        boxes.append(((4.0, begin, 0.0), (4.0 + thickness_m, 4.0, high_m)))
        return boxes

    return make
