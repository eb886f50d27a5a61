"""tlsplan from Python: load a building, plan it, evaluate stations, export. docs/howto/notebook.md shows it.

    scene = tlsplan.load_scene("building.ifc")
    plan = tlsplan.plan(scene, scanner="rtc360:6mm", coverage="95 %")

Nothing here prints or exits: progress goes to a callback, and what can't be done raises a `PlannerError` of one line.
What it is made of is in `planner_core`, whose modules may be imported as well.

The folder `cli/` of the repository is installed as the package `tlsplan`; its command, one file each in `commands/`, is
the only place of the project that prints and exits.
"""

# ruff: noqa: F403, F405 - names are those of api.py
TYPE_CHECKING = False  # so that not even `typing` is imported: the command line is quick to start
if TYPE_CHECKING:
    from .api import *

__all__ = [
    "Doors",
    "ExportOptions",
    "FrameRequest",
    "Glass",
    "Greedy",
    "LoadOptions",
    "Method",
    "Objective",
    "Paper",
    "Plan",
    "PlanSettings",
    "PlanSource",
    "PlannerError",
    "Progress",
    "ProgressEvent",
    "Proven",
    "Requirements",
    "Scene",
    "UpAxis",
    "Written",
    "evaluate",
    "export",
    "load_scene",
    "open_plan",
    "plan",
    "settings",
    "write_plan",
]


def __getattr__(name: str) -> object:
    """Import the library when its first name is used."""
    if name in __all__:
        from . import api

        return getattr(api, name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return [*globals(), *__all__]
