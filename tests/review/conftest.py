"""A plan of three stations far from the origin, as reviews see it, and random changes of its reviews."""

from __future__ import annotations

from collections.abc import Callable

import pytest
from hypothesis import strategies as st

from planner_core.model import Entrance, ForbiddenPlace, PlanUnderReview, Review, ReviewedStation, Zone
from planner_core.model.site import GroundPick
from planner_core.review import changes as c

OFFSET_M = (500_000.0, 4_000_000.0, 100.0)
ANA = c.Signature("Ana", "2026-11-21T16:30:00Z")
BEN = c.Signature("Ben", "2026-11-21T16:45:00Z")


def make_plan() -> PlanUnderReview:
    """S002 is scanned, S003 locked, the height of `S 04` not known; its name is no identifier."""
    rows = (("S001", 1.0, 1.5, False), ("S002", 2.0, 1.5, True), ("S003", 3.0, 1.5, False), ("S 04", 4.0, None, False))
    x, y, z = OFFSET_M
    return PlanUnderReview(
        sha256="ab" * 32,
        stations=tuple(
            ReviewedStation(name, "F0", (x + at, y + 2.0, z + 1.5), height, fixed, locked=name == "S003")
            for name, at, height, fixed in rows
        ),
        floor_elevations_m={"F0": z, "F1": z + 3.0},
        n_elements=7,
        offset_m=OFFSET_M,
        links=(("S001", "S002"), ("S002", "S003")),
    )


@pytest.fixture(scope="session")
def plan() -> PlanUnderReview:
    return make_plan()


_near = st.floats(-50, 50, allow_nan=False).map(lambda value: round(value, 7))
points = st.tuples(_near, _near, _near).map(lambda p: tuple(a + b for a, b in zip(p, OFFSET_M, strict=True)))
heights = st.floats(0, 3)
floors = st.sampled_from(["F0", "F1"])
any_floors = st.sampled_from(["", "F0", "F1"])
texts = st.text(st.characters(exclude_categories=["Cs", "Cc"], exclude_characters="\u2028\u2029"), min_size=1).filter(
    lambda text: text.strip() != "" and not any("\u202a" <= x <= "\u202e" or "\u2066" <= x <= "\u2069" for x in text)
) | st.sampled_from(['say "no"', "back\\slash\n'''three'''", 'a"""b', "#usda 1.0\n(", "墙 é 🙂", "tab\there"])
lines = st.sampled_from(["Ana", "Ben", "Zoë O'Neil", '"quoted"'])
station_names = st.sampled_from(["S001", "S002", "S003", "S 04", "S005", "S006", "nobody"])
ids = st.sampled_from(["Z001", "Z002", "P001", "P002", "C001", "C002", "G001", "G002", "E001", "E002"])
doors = st.sampled_from(["0w$5Bz2Kf9yR4Q_x7LmN1c", "0w_5Bz2Kf9yR4Q_x7LmN1c", "Door", "door"])


@st.composite
def zones(draw: Callable[..., object]) -> Zone:
    """A triangle that has an area."""
    x, y = (draw(_near) + at for at in OFFSET_M[:2])
    width, depth = (draw(st.floats(0.1, 30)) for _ in range(2))
    kind = draw(st.sampled_from(["keep_out", "priority"]))
    return Zone(
        id=draw(st.just("") | ids),
        kind=kind,
        outline_m=((x, y), (x + width, y), (x + width / 2, y + depth)),
        floor=draw(any_floors),
        name=draw(st.just("") | lines),
        coverage=draw(st.floats(0.01, 1)) if kind == "priority" else None,
    )


places = st.builds(
    ForbiddenPlace, id=st.just("") | ids, position_m=points, radius_m=st.floats(0.01, 1000), floor=any_floors
)
picks = st.builds(GroundPick, point_m=points, is_ground=st.booleans(), floor=any_floors)

entrances = st.builds(Entrance, id=st.just("") | ids, position_m=points, floor=floors)

some_changes = st.one_of(
    st.builds(c.MoveStation, station_names, points, st.just(c.AS_NOW) | st.none() | heights, st.none() | floors),
    st.builds(c.MoveStation, station_names, st.none()),
    st.builds(c.SetHeight, station_names, heights),
    st.builds(c.AddStation, points, floors, st.none() | heights, st.none() | station_names, st.none() | st.booleans()),
    st.builds(c.RemoveStation, station_names),
    st.builds(c.RestoreStation, station_names),
    st.builds(c.LockStation, station_names, st.none() | st.booleans()),
    st.builds(c.UnlockStation, station_names),
    st.builds(c.Forbid, places),
    st.builds(c.Allow, ids),
    st.builds(c.AddZone, zones()),
    st.builds(c.ChangeZone, zones()),
    st.builds(c.RemoveZone, ids),
    st.builds(c.PickGround, picks, st.none() | ids),
    st.builds(c.UnpickGround, ids),
    st.builds(c.AddEntrance, entrances),
    st.builds(c.RemoveEntrance, ids),
    st.builds(c.SetDoor, doors, st.sampled_from(["open", "shut", None])),
    st.builds(c.AddComment, texts, st.none() | st.integers(0, 6) | station_names, st.none() | points),
    st.builds(c.AssignComment, ids, st.sampled_from(["", "Kim"]), st.sampled_from(["", "2026-12-01"])),
    st.builds(c.EditComment, ids, texts),
    st.builds(c.ResolveComment, ids, st.booleans()),
    st.builds(c.RemoveComment, ids),
    st.builds(c.SetVerdict, station_names, st.sampled_from(["accepted", "rejected"]), st.just("") | texts),
    st.builds(c.ClearVerdict, station_names),
    st.builds(c.SetProgress, station_names, st.sampled_from(["done", "skipped", None])),
    st.builds(c.Sign, st.just("") | texts),
    st.just(c.Unsign()),
)


def content(review: Review) -> tuple[object, ...]:
    """All of a review but its revisions."""
    return (
        review.stations, review.forbidden, review.zones, review.ground_picks, review.entrances, review.doors,
        review.comments, review.verdicts, review.progress, review.sign_off,
    )  # fmt: skip
