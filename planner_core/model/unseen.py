"""Why: what each station adds that no other gives, and why the unseen stays unseen."""

from __future__ import annotations

from dataclasses import dataclass

from planner_core.model.arrays import FloatArray, Int32Array, UInt8Array

#: What keeps a patch from being covered. `Why.reason_of_patch` indexes these; docs/method/unseen.md defines how each is
#: found. The first two are of patches that candidates do see, the others of those that none does well enough.
REASONS = (
    "covered",
    "not worth a station",
    "too few spots see it",
    "out of range",
    "outside the field of view",
    "too oblique",
    "too sparse",
    "too noisy",
    "returns no beam",
    "occluded",
    "no admissible spot",
    "inside solids",
)
(
    COVERED,
    NOT_WORTH,
    TOO_FEW,
    OUT_OF_RANGE,
    OUT_OF_VIEW,
    TOO_OBLIQUE,
    TOO_SPARSE,
    TOO_NOISY,
    NO_RETURN,
    OCCLUDED,
    NO_SPOT,
    IN_SOLIDS,
) = range(len(REASONS))
#: Of patches that valid positions see, but none within the limits that are required: range, incidence, spacing, noise.
NOT_AS_REQUIRED = tuple(REASONS[k] for k in (TOO_FEW, OUT_OF_RANGE, TOO_OBLIQUE, TOO_SPARSE, TOO_NOISY))
#: What people read where plan.json has another name; the viewer has the same words (`src/heat/layers.ts`).
_REASON_WORDS = {
    "not worth a station": "reachable, left out",
    "too few spots see it": "seen from too few positions",
    "returns no beam": "no return",
    "no admissible spot": "no valid tripod position",
}
#: `Why.reason_of_patch` of patches that are not required.
OUT_OF_SCOPE = 255


def reason_in_words(reason: str) -> str:
    """Return one of `REASONS` as the report, the sheets and the viewer say it."""
    return _REASON_WORDS.get(reason, reason)


@dataclass(frozen=True)
class OwnPart:
    """Surface that only one station sees. room : index into `Scene.rooms`, -1 none."""

    element: int
    room: int
    area_m2: float


@dataclass(frozen=True)
class StationReason:
    """What the plan would lose without a station."""

    station: str
    own_area_m2: float
    """That would no longer be covered."""
    own_parts: tuple[OwnPart, ...]
    """The largest parts of that, largest first."""
    linked: tuple[str, ...]
    """Stations that it has links to which count for registration."""


@dataclass(frozen=True)
class UnseenPiece:
    """Patches that are connected by their edges. centroid_m : (3,) and box_m : (2, 3) float64, LOCAL frame.

    The scene frame, for flying a camera there, is `+ Scene.offset_m`.
    """

    area_m2: float
    n_patches: int
    centroid_m: FloatArray
    box_m: FloatArray
    patch: int
    """The one of them nearest to the centroid: on the surface, as the centroid of a bent piece is not."""


@dataclass(frozen=True)
class BestPosition:
    """The candidate that sees most of a piece of surface. position_m : (3,) float64, local, the sensor's origin."""

    candidate: int
    """Row of the candidates."""
    position_m: FloatArray
    sees_m2: float
    """Of the surface in question."""
    adds_m2: float
    """Of all that the plan leaves unseen: what a station there would bring."""


@dataclass(frozen=True)
class UnseenSurface:
    """Surface of one element, in one room, that counts for one floor, unseen for one reason.

    element : index into `Scene.elements`. room : into `Scene.rooms`, -1 none. floor : id, empty: of none.
    """

    element: int
    room: int
    floor: str
    reason: str
    """One of `REASONS`."""
    area_m2: float
    n_pieces: int
    pieces: tuple[UnseenPiece, ...]
    """The largest, largest first."""
    best_position: BestPosition | None = None
    """Of surface that is not worth a station."""


@dataclass(frozen=True)
class CurveStep:
    """Coverage after one more station, the one that adds most to those before it."""

    station: str
    covered_area_m2: float
    fraction_of_achievable: float


@dataclass(frozen=True)
class Why:
    """Why the plan is as it is.

    reason_of_patch : (P,) uint8 into `REASONS`; `OUT_OF_SCOPE` where not required.
    area_by_reason_m2 : one a reason, in the order of `REASONS`; they add up to the area in scope.
    """

    stations: tuple[StationReason, ...]
    curve: tuple[CurveStep, ...]
    unseen: tuple[UnseenSurface, ...]
    """Largest first; their areas add up to all that is in scope and not covered."""
    reason_of_patch: UInt8Array
    area_by_reason_m2: tuple[float, ...]
    piece_of_patch: Int32Array | None = None
    """(P,) int32, the `patch` of the `UnseenPiece` that each patch is of; -1: of none in `unseen`."""
