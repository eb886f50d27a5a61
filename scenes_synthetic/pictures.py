"""Pictures of the synthetic scenes for the documentation: `python -m scenes_synthetic.pictures docs/images`.

Every part is cut by a horizontal plane and closed again, so that walls show their thickness.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pyvista as pv
from PIL import Image

import scenes_synthetic
from scenes_synthetic.model import Part, SyntheticScene

_COLOURS = {
    "IfcWall": "#e9e6df",
    "IfcSlab": "#cbb994",
    "IfcRoof": "#8d8f93",
    "IfcStair": "#b98b5a",
    "IfcRailing": "#5d6470",
    "IfcDoor": "#9c6a46",
    "IfcWindow": "#86b6d8",
    "IfcFurniture": "#d9b48a",
    "IfcSanitaryTerminal": "#f7f9fb",
    "IfcElectricAppliance": "#c3c9d1",
}
_SOFT = ("bed", "sofa", "armchair")
_SOFT_COLOUR = "#7f9fb0"
_CUT_COLOUR = "#4a4f57"
_SIZE = (1000, 740)
_N_COLOURS = 256
"""Enough for flat colours and shading; a third of the bytes of a full-colour PNG."""


@dataclass(frozen=True)
class View:
    """One picture: the parts whose storey is listed, cut at a height, seen from a direction."""

    file_name: str
    scene: str
    storeys: tuple[int, ...]
    cut_m: float
    seen_from: tuple[float, float, float]


VIEWS = (
    View("house-outside.png", "house", (0, 1), 99.0, (-1.0, -1.7, 0.8)),
    View("house-ground-floor.png", "house", (0,), 2.15, (-0.55, -1.2, 1.9)),
    View("house-upper-floor.png", "house", (0, 1), 4.95, (-0.55, -1.2, 1.9)),
)


def draw(synthetic: SyntheticScene, view: View, path: Path) -> None:
    """Render one view off-screen to a PNG."""
    plotter = pv.Plotter(off_screen=True, window_size=_SIZE, lighting="none")
    plotter.set_background("white")
    for part in synthetic.parts:
        if part.storey in view.storeys:
            _add(plotter, part, view.cut_m)
    for direction, strength in (((-1.0, -2.0, 3.0), 0.75), ((2.0, -1.0, 2.0), 0.35), ((0.0, 2.0, 1.0), 0.3)):
        plotter.add_light(pv.Light(position=direction, light_type="scene light", intensity=strength))
    plotter.enable_ssao(radius=0.8, bias=0.02, kernel_size=64)
    plotter.enable_anti_aliasing("ssaa")
    middle = np.asarray(plotter.bounds).reshape(3, 2).mean(axis=1)
    plotter.camera.focal_point = middle
    plotter.camera.position = middle + 20 * np.asarray(view.seen_from)
    plotter.camera.up = (0.0, 0.0, 1.0)
    plotter.reset_camera()
    plotter.camera.zoom(1.0)
    image = Image.fromarray(plotter.screenshot(return_img=True, window_size=_SIZE))
    plotter.close()
    image.quantize(_N_COLOURS).save(path, optimize=True)


def _add(plotter: pv.Plotter, part: Part, cut_m: float) -> None:
    solid = part.solid
    low, high = solid.bounds_m[:, 2]
    if low >= cut_m:
        return
    faces = np.column_stack([np.full(len(solid.triangles), 3), solid.triangles])
    mesh = pv.PolyData(solid.vertices_m, faces.ravel())
    colour = _SOFT_COLOUR if part.name.endswith(_SOFT) else _COLOURS[part.kind]
    if high > cut_m:
        mesh = mesh.clip_closed_surface(normal=(0, 0, -1), origin=(0, 0, cut_m))
        on_cut = np.abs(mesh.cell_centers().points[:, 2] - cut_m) < 1e-6
        cap = mesh.extract_cells(on_cut)
        if cap.n_cells:
            plotter.add_mesh(cap, color=_CUT_COLOUR, lighting=False)
        mesh = mesh.extract_cells(~on_cut)
    plotter.add_mesh(mesh, color=colour, ambient=0.35, diffuse=0.8)
    edges = mesh.extract_feature_edges(25, boundary_edges=False, manifold_edges=False, non_manifold_edges=False)
    if edges.n_cells:
        plotter.add_mesh(edges, color="#33373d", line_width=1, lighting=False)


def main(arguments: Sequence[str]) -> None:
    """Draw all views into the folder named by the only argument."""
    (folder,) = arguments
    Path(folder).mkdir(parents=True, exist_ok=True)
    for view in VIEWS:
        draw(scenes_synthetic.build(view.scene), view, Path(folder) / view.file_name)


if __name__ == "__main__":
    main(sys.argv[1:])
