"""The site's coordinates in a USD layer: SiteFrame -> texts under `tlsplan` in the layer's customLayerData.

The keys are in docs/formats/stage.md.
"""

from __future__ import annotations

from planner_core.model import SiteFrame
from planner_core.plan_folder.sdf_authoring import Layer

KEY = "tlsplan"


def put_site(layer: Layer, frame: SiteFrame) -> None:
    """Name the site's coordinates in a layer; what else its customLayerData holds stays."""
    layer.customLayerData = {**dict(layer.customLayerData), KEY: site_data(frame)}


def site_data(frame: SiteFrame) -> dict[str, str]:
    """Coordinates in words, the systems' names for programs, and the 4 x 4 matrix from scene coordinates, by rows."""
    rows = [value for row in frame.matrix.tolist() for value in row]
    return {
        "coordinates": frame.crs_line,
        "crs": frame.crs,
        "verticalCrs": frame.vertical_crs,
        "sceneToSite": " ".join(repr(float(value)) for value in rows),
    }
