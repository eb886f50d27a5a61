"""The curve of coverage: covered share of the achievable area against the number of stations. Plan -> PNG."""

from __future__ import annotations

from pathlib import Path

from planner_core.model import Plan
from planner_core.plan_folder.drawing.canvas import Box
from planner_core.plan_folder.drawing.plot import draw_curve
from planner_core.plan_folder.drawing.png_canvas import PngCanvas
from planner_core.plan_folder.sheet import WIDTH_MM


def write_coverage_curve(plan: Plan, path: Path) -> None:
    """Draw the curve with the station first that adds most; in the order of choice where the plan does not say why."""
    steps = plan.why.curve if plan.why is not None else ()
    order = {station.id: str(station.order) for station in plan.stations}
    zoom = 1.6
    canvas = PngCanvas(WIDTH_MM / zoom, 80.0, zoom=zoom)
    draw_curve(
        canvas,
        Box(5.0, 2.0, canvas.box.width - 10.0, 76.0),
        [float(step.fraction_of_achievable) for step in steps] or list(plan.coverage_curve),
        [order[step.station] for step in steps],
        required=plan.settings.requirements.coverage,
    )
    canvas.save(path)
