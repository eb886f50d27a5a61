"""Formats of scene files by their extensions."""

from __future__ import annotations

from pathlib import Path

FORMAT_OF_EXTENSION = {
    ".ifc": "ifc",
    ".ifczip": "ifc",
    ".ifcxml": "ifc",
    ".obj": "obj",
    ".ply": "ply",
    ".stl": "stl",
    ".gltf": "gltf",
    ".glb": "gltf",
    ".usd": "usd",
    ".usda": "usd",
    ".usdc": "usd",
    ".usdz": "usd",
}
DRAWINGS = frozenset({".dxf", ".dwg", ".pdf", ".png", ".jpg", ".jpeg", ".tif", ".tiff", ".bmp", ".webp"})
"""What `planner_core.drawings` lifts to IFC."""
POINT_CLOUDS = frozenset({".asc", ".e57", ".las", ".laz", ".pcd", ".pts", ".ptx", ".rcp", ".rcs", ".xyz"})


def is_scene_file(path: Path) -> bool:
    """Whether a path is of a scene file, by its extension: for readers of other files, which were given one."""
    return path.suffix.lower() in FORMAT_OF_EXTENSION and path.is_file()
