"""What benchmarks share: a synthetic office, a dense template, the processor's name. Needs NumPy alone."""

from __future__ import annotations

import platform
from pathlib import Path

import numpy as np

from planner_core.model import BeamTemplate, LoadReport, Scene, SceneSource
from planner_core.operating_system import processor_flags


def scene_of(vertices: np.ndarray, triangles: np.ndarray) -> Scene:
    return Scene(
        source=SceneSource(Path("memory"), "", "memory", "metre", 1.0, "Z"),
        vertices_m=vertices,
        triangles=triangles.astype(np.int32),
        element_of_triangle=np.zeros(len(triangles), dtype=np.int32),
        elements=(),
        storeys=(),
        offset_m=np.zeros(3),
        report=LoadReport(len(triangles)),
    )


def grid_faces(low: np.ndarray, high: np.ndarray, cells: int) -> tuple[np.ndarray, np.ndarray]:
    """The six faces of a box, each of cells x cells quads."""
    at = np.linspace(0.0, 1.0, cells + 1)
    u, v = (x.ravel() for x in np.meshgrid(at, at, indexing="ij"))
    quad = (np.arange(cells)[:, None] * (cells + 1) + np.arange(cells)).ravel()
    split = np.stack([quad, quad + cells + 1, quad + 1, quad + 1, quad + cells + 1, quad + cells + 2], axis=1)
    vertices: list[np.ndarray] = []
    triangles: list[np.ndarray] = []
    for axis in range(3):
        for side in (0.0, 1.0):
            unit = np.insert(np.stack([u, v], axis=1), axis, side, axis=1)
            triangles.append(split.reshape(-1, 3) + sum(len(face) for face in vertices))
            vertices.append(low + unit * (high - low))
    return np.concatenate(vertices), np.concatenate(triangles)


def office(n_rooms: int, cells: int, *, seed: int) -> Scene:
    """Rooms of 6 x 5 x 3 m on a square grid with walls of 1 m gaps and thirty pieces of furniture each."""
    rng = np.random.default_rng(seed)
    side = int(np.ceil(np.sqrt(n_rooms)))
    parts: list[tuple[np.ndarray, np.ndarray]] = []

    def add(low: tuple[float, float, float], high: tuple[float, float, float]) -> None:
        parts.append(grid_faces(np.array(low), np.array(high), cells))

    add((0, 0, -0.2), (6 * side, 5 * side, 0))
    add((0, 0, 3), (6 * side, 5 * side, 3.2))
    for room in range(n_rooms):
        x, y = 6.0 * (room % side), 5.0 * (room // side)
        add((x, y, 0), (x + 2.5, y + 0.1, 3))
        add((x + 3.5, y, 0), (x + 6, y + 0.1, 3))
        add((x, y, 0), (x + 0.1, y + 2, 3))
        add((x, y + 3, 0), (x + 0.1, y + 5, 3))
        for _ in range(30):
            low = np.array([x, y, 0]) + rng.uniform((0.2, 0.2, 0), (5.2, 4.2, 1.0))
            add(tuple(low), tuple(low + rng.uniform(0.05, 0.7, 3)))
    vertices = np.concatenate([v for v, _ in parts])
    offsets = np.cumsum([0] + [len(v) for v, _ in parts[:-1]])
    return scene_of(vertices, np.concatenate([t + o for (_, t), o in zip(parts, offsets, strict=True)]))


def dome() -> BeamTemplate:
    """A survey scanner's field of view, -60 to 90 degrees, at 0.18 degrees."""
    return BeamTemplate(
        azimuth_rad=np.asarray(np.arange(2000) * (2 * np.pi / 2000), dtype=np.float64),
        elevation_rad=np.deg2rad(np.linspace(90.0, -60.0, 833)),
        range_min_m=0.0,
        range_max_m=np.inf,
    )


def processor() -> str:
    """Name, family and model, and how many floats its widest instructions take."""
    cpuinfo = Path("/proc/cpuinfo")
    pairs = (line.partition(":") for line in cpuinfo.read_text().splitlines()) if cpuinfo.exists() else ()
    said = {key.strip(): value.strip() for key, _, value in pairs}
    flags = processor_flags()
    lanes = 16 if "avx512f" in flags else 8 if "avx2" in flags else 4
    family = f"family {said.get('cpu family', '?')} model {said.get('model', '?')}"
    return f"{said.get('model name', platform.processor())} ({family}), {lanes} lanes"
