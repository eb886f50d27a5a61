"""The day's walk through a plan, and how long the day is."""

from __future__ import annotations

from dataclasses import dataclass

from planner_core.model.arrays import FloatArray, Int32Array, Int64Array


@dataclass(frozen=True)
class Leg:
    """A way of the walk from one stop to the next.

    a, b : indices into the stations; -1 for the place where the walk begins or ends.
    points_m : (M, 3) float64, local, corners of the way on the ground; empty where it can't be walked.
    floor : (max(M - 1, 0),) int32 into the floors, on which each piece between two corners lies; stairs are of the
    floor below. length_m : inf where it can't be walked.
    """

    a: int
    b: int
    points_m: FloatArray
    floor: Int32Array
    length_m: float

    @property
    def walkable(self) -> bool:
        """Whether there is a way."""
        return bool(self.points_m.shape[0])

    @property
    def floors(self) -> tuple[int, ...]:
        """Floors passed, in their order, each as often as it is come to."""
        floors: list[int] = []
        for index in self.floor.tolist():
            if not floors or floors[-1] != index:
                floors.append(index)
        return tuple(floors)


@dataclass(frozen=True)
class Route:
    """A walk through all stations that are to be scanned and can be walked to.

    order : (N,) int64, all stations in the order of visits; those not in the walk last, unless the
    order was given. left_out : stations of them to which no way leads; the others are scanned already.
    legs : from the start, where there is one, from station to station, and to the end or back.
    length_m : of the legs that can be walked. n_unwalkable : the others.
    start_m, end_m : (3,) float64, local, on the ground; None: the walk begins, or ends, at a station.
    exact : no shorter order exists for the distances between the stations. notes : for the user, a line each.
    """

    order: Int64Array
    legs: tuple[Leg, ...]
    length_m: float
    n_unwalkable: int
    exact: bool
    closed: bool = False
    start_m: FloatArray | None = None
    end_m: FloatArray | None = None
    left_out: tuple[int, ...] = ()
    notes: tuple[str, ...] = ()


@dataclass(frozen=True)
class FieldTime:
    """Seconds of a day's parts. scanning_s : None where nobody knows how long a scan takes.

    walking_s : along the legs that can be walked.
    """

    scanning_s: float | None
    set_up_s: float
    walking_s: float

    @property
    def total_s(self) -> float | None:
        """All parts together; None where one is not known."""
        return None if self.scanning_s is None else self.scanning_s + self.set_up_s + self.walking_s


@dataclass(frozen=True)
class UnreachableArea:
    """Ground of a room that no entrance leads to. inside_m : (3,) float64, local, its roomiest place.

    strips_m : (K, 2, 2) float64, local: corners [[x_min, y_min], [x_max, y_max]] of rectangles that make it up in plan.
    """

    floor: int
    area_m2: float
    inside_m: FloatArray
    strips_m: FloatArray
