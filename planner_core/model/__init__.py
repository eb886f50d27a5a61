"""The frozen dataclasses that the stages hand on, and nothing else.

Frames
------
*source*  as the file has it: any unit, y or z up, any origin.
*scene*   metres, z up, right-handed; otherwise the source's own origin. plan.json, CSV and every export use it.
*local*   scene minus `Scene.offset_m`. ALL geometry in memory is local, float64 on the host and float32 in kernels.

Conventions: arrays are C-contiguous and not written to after construction. A miss is range NaN, triangle -1, patch -1.
Angles are radians; azimuth runs counter-clockwise from +x seen from above, elevation up from the horizontal.
"""

from planner_core.model.arrays import BoolArray, Float32Array, FloatArray, Int32Array, Int64Array, UInt8Array
from planner_core.model.choices import (
    Doors,
    Glass,
    NetworkKind,
    Objective,
    OverlapMeasure,
    OverlapOf,
    PreAlignment,
    Role,
    ScanBy,
    Scope,
    UpAxis,
)
from planner_core.model.length_units import FOOT, LENGTH_UNITS, METRE, US_SURVEY_FOOT, LengthUnit
from planner_core.model.methods import METHODS, F2Settings, Greedy, Method, Paper, Proven
from planner_core.model.planning import Candidates, Crew, InstrumentHeights, PlanSettings, Survey
from planner_core.model.registration import (
    FloorNetworks,
    Link,
    LinkLimits,
    NetworkGap,
    Registration,
    RegistrationNetwork,
    WeakMotion,
)
from planner_core.model.requirements import PartRequirement, PartResult, PointLimits, Requirements
from planner_core.model.results import (
    CheckedFigure,
    CheckedLink,
    Coverage,
    IndependentCheck,
    Loss,
    Plan,
    Station,
    UnseenElement,
)
from planner_core.model.review import (
    Comment,
    Entrance,
    ForbiddenPlace,
    PlanUnderReview,
    Review,
    ReviewedStation,
    SignOff,
    StationEdit,
    Verdict,
    Zone,
)
from planner_core.model.route import FieldTime, Leg, Route, SealedArea
from planner_core.model.scans import BeamTemplate, PatchReturns, RayHits, ReturnMoments, ScanBatch, Scanner, Visibility
from planner_core.model.scene import Element, Floor, LoadReport, Optics, Patches, Room, Scene, SceneSource, Storey
from planner_core.model.scope import SurveyScope
from planner_core.model.site import GroundPick, KeepOut, PriorStation, Site
from planner_core.model.site_frame import Georeference, SiteFrame
from planner_core.model.unseen import (
    NOT_AS_REQUIRED,
    REASONS,
    BestPosition,
    CurveStep,
    OwnPart,
    StationReason,
    UnseenPiece,
    UnseenSurface,
    Why,
)

__all__ = [
    "FOOT",
    "LENGTH_UNITS",
    "METHODS",
    "METRE",
    "NOT_AS_REQUIRED",
    "REASONS",
    "US_SURVEY_FOOT",
    "BeamTemplate",
    "BestPosition",
    "BoolArray",
    "Candidates",
    "CheckedFigure",
    "CheckedLink",
    "Comment",
    "Coverage",
    "Crew",
    "CurveStep",
    "Doors",
    "Element",
    "Entrance",
    "F2Settings",
    "FieldTime",
    "Float32Array",
    "FloatArray",
    "Floor",
    "FloorNetworks",
    "ForbiddenPlace",
    "Georeference",
    "Glass",
    "Greedy",
    "GroundPick",
    "IndependentCheck",
    "InstrumentHeights",
    "Int32Array",
    "Int64Array",
    "KeepOut",
    "Leg",
    "LengthUnit",
    "Link",
    "LinkLimits",
    "LoadReport",
    "Loss",
    "Method",
    "NetworkGap",
    "NetworkKind",
    "Objective",
    "Optics",
    "OverlapMeasure",
    "OverlapOf",
    "OwnPart",
    "Paper",
    "PartRequirement",
    "PartResult",
    "PatchReturns",
    "Patches",
    "Plan",
    "PlanSettings",
    "PlanUnderReview",
    "PointLimits",
    "PreAlignment",
    "PriorStation",
    "Proven",
    "RayHits",
    "Registration",
    "RegistrationNetwork",
    "Requirements",
    "ReturnMoments",
    "Review",
    "ReviewedStation",
    "Role",
    "Room",
    "Route",
    "ScanBatch",
    "ScanBy",
    "Scanner",
    "Scene",
    "SceneSource",
    "Scope",
    "SealedArea",
    "SignOff",
    "Site",
    "SiteFrame",
    "Station",
    "StationEdit",
    "StationReason",
    "Storey",
    "Survey",
    "SurveyScope",
    "UInt8Array",
    "UnseenElement",
    "UnseenPiece",
    "UnseenSurface",
    "UpAxis",
    "Verdict",
    "Visibility",
    "WeakMotion",
    "Why",
    "Zone",
]
