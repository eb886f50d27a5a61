"""Every error the library raises on purpose: one root, each also the builtin it refines.

A message says, in one line: what, got, expected, remedy. The command line prints it as it is.
"""


class PlannerError(Exception):
    """Root of all errors raised on purpose. `str(error)` is one line fit for a user."""


class SceneError(PlannerError, ValueError):
    """A scene file can't be used: wrong type, truncated, empty, no triangles, bad indices."""


class SceneNotFoundError(SceneError, FileNotFoundError):
    """The scene file does not exist or can't be read."""


class RequirementError(PlannerError, ValueError):
    """A requirement or option can't be met or makes no sense: bad coverage, unknown scanner or floor."""


class StationListError(PlannerError, ValueError):
    """A given station list (CSV or plan.json) can't be read."""


class PlanFolderError(PlannerError, ValueError):
    """A plan folder can't be read, or is not one."""


class ReviewError(PlannerError, ValueError):
    """A change of a review makes no sense: no such station, an outline that crosses itself, too long a text."""


class OutputExistsError(PlannerError, FileExistsError):
    """The output exists and overwriting was not asked for."""


class DeviceError(PlannerError, RuntimeError):
    """No OpenCL device, a program that does not build, memory exhausted, device lost."""


class DeviceMemoryError(DeviceError, MemoryError):
    """The device's memory does not suffice, by our own count or the driver's: less work at a time may do."""


class MissingPackageError(PlannerError, ImportError):
    """An optional package or system library is missing; the message says how to get it."""


class CoordinatesError(PlannerError, ValueError):
    """The site's coordinates can't be made out: unknown CRS, control points that fix nothing, a bad number."""


class ExportError(PlannerError, ValueError):
    """A plan can't be exported to a format: a missing scene, something that the format can't hold, a full disk."""


class CrsNeededError(ExportError):
    """A format holds longitude and latitude, and the plan's coordinates have no CRS: a pack goes without it."""
