"""The review in its USD layer: what is written is read again, what others wrote stays, viewers show stations moved."""

from __future__ import annotations

import math
import re
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pxr import Sdf, Usd, UsdGeom, UsdValidation

from planner_core.errors import PlanFolderError, ReviewError
from planner_core.model import Entrance, PlanUnderReview, Review, StationEdit, Zone
from planner_core.model.site import GroundPick
from planner_core.plan_folder.usd_stage import empty_review
from planner_core.review import changes as c
from planner_core.review.commit import Committed, commit
from planner_core.review.usd_read import read_review
from planner_core.review.usd_write import review_text

from .conftest import ANA, OFFSET_M, make_plan, some_changes

X, Y, Z = OFFSET_M
HERE = (X + 5.25, Y + 5.5, Z + 1.75)
ZONE = Zone("", "priority", ((X, Y), (X + 2, Y), (X + 2, Y + 2)), "F1", "hall", 0.98)
ALL_KINDS = (
    c.MoveStation("S001", HERE),
    c.RemoveStation("S003"),
    c.AddStation((X + 7, Y + 1, Z + 4.6), "F1", 1.6, locked=True),
    c.LockStation("S 04"),
    c.AddZone(ZONE),
    c.AddZone(Zone("", "keep_out", ZONE.outline_m)),
    c.PickGround(GroundPick((X + 1, Y + 1, Z), is_ground=False, floor="F0")),
    c.AddEntrance(Entrance("", (X + 1, Y + 2, Z), "F0")),
    c.SetDoor("0w$5Bz2Kf9yR4Q_x7LmN1c", "shut"),
    c.AddComment('He said "no"', "S001", HERE),
    c.AddComment("This wall?", 3),
    c.SetVerdict("S 04", "rejected", "in the way"),
    c.SetProgress("S 04", "skipped"),
    c.Sign("go"),
)


def lines_of(text: str) -> str:
    """USD text wants a line for every opinion."""
    return re.sub(r"([{}])(?=[ }])", r"\1\n", text).replace(" }", "\n}")


def reviewed(*changes: c.Change) -> Review:
    review = Review()
    for change in changes:
        outcome = commit(review, review.revision, [change], make_plan(), ANA)
        assert isinstance(outcome, Committed)
        review = outcome.review
    return review


@settings(max_examples=80, deadline=None)
@given(batches=st.lists(st.lists(some_changes, min_size=1, max_size=3), max_size=6))
def test_what_is_written_is_read_again_whatever_was_written_over(batches) -> None:
    plan, review, text = make_plan(), Review(), ""
    for batch in batches:
        try:
            outcome = commit(review, review.revision, batch, plan, ANA)
        except ReviewError:
            continue
        assert isinstance(outcome, Committed)
        review = outcome.review
        text = review_text(review, plan, text)
        assert read_review(text, plan) == review


def test_a_layer_as_it_comes_with_the_plan_is_an_empty_review(plan: PlanUnderReview) -> None:
    assert read_review(empty_review(), plan) == Review()
    assert read_review(review_text(Review(), plan), plan) == Review()


def test_everything_taken_back_leaves_only_revisions_in_the_layer(plan: PlanUnderReview) -> None:
    text = review_text(Review(), plan, review_text(reviewed(*ALL_KINDS), plan))
    assert text == review_text(Review(), plan)
    assert "over" not in text.replace('over "Plan"', "")


def below(opinion: str, *path: str) -> str:
    """A layer that says one thing of one prim."""
    text = opinion
    for name in reversed(path):
        text = f'def "{name}"\n{{\n{text}\n}}\n'
    return f"#usda 1.0\n{text}"


def below_review(opinion: str, *path: str) -> str:
    return below(opinion, "Plan", "Review", *path)


FOREIGN = lines_of("""#usda 1.0
(
    defaultPrim = "Plan"
    metersPerUnit = 1
    upAxis = "Z"
    customLayerData = { string mine = "kept" }
)
over "Plan"
{
    over "Building" { over "Storey_0" { token visibility = "invisible" } }
    over "Stations"
    {
        over "S001" { int tlsplan:order = 9 }
        def Sphere "Balloon" { double radius = 3 }
    }
    over "Links" { over "Link_0" ( active = false ) {} }
    def Scope "Review"
    {
        string owner = "Carl"
        def Scope "Comments"
        {
            def Scope "Mine" { string text = "not ours" }
        }
    }
}
""")


def foreign_opinions(text: str) -> list[object]:
    layer = Sdf.Layer.CreateAnonymous()
    layer.ImportFromString(text)
    values = [
        layer.GetAttributeAtPath(path).default
        for path in (
            "/Plan/Building/Storey_0.visibility",
            "/Plan/Stations/S001.tlsplan:order",
            "/Plan/Stations/Balloon.radius",
            "/Plan/Review.owner",
            "/Plan/Review/Comments/Mine.text",
        )
    ]
    return [*values, dict(layer.customLayerData), layer.GetPrimAtPath("/Plan/Links/Link_0").active]


def test_opinions_of_other_programs_survive_every_commit_and_its_undo(plan: PlanUnderReview) -> None:
    expected = ["invisible", 9, 3.0, "Carl", "not ours", {"mine": "kept"}, False]
    assert foreign_opinions(FOREIGN) == expected
    assert read_review(FOREIGN, plan) == Review()
    review = reviewed(*ALL_KINDS)
    text = review_text(review, plan, FOREIGN)
    assert foreign_opinions(text) == expected
    assert read_review(text, plan) == review
    back = review_text(Review(), plan, text)
    assert foreign_opinions(back) == expected
    assert read_review(back, plan) == Review()


def test_a_station_that_another_program_moved_or_switched_off_counts_as_changed(plan: PlanUnderReview) -> None:
    text = lines_of("""#usda 1.0
over "Plan" { over "Stations" {
    over "S001" {
        matrix4d xformOp:transform = ( (1, 0, 0, 0), (0, 1, 0, 0), (0, 0, 1, 0), (6, 7, 1.25, 1) )
    }
    over "S003" ( active = false ) {}
} }
""")
    assert read_review(text, plan).stations == {
        "S001": StationEdit((X + 6, Y + 7, Z + 1.25), 1.5, "F0"),
        "S003": StationEdit(removed=True),
    }


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("not usda", "does not begin with #usda"),
        ('#usda 1.0\n(\n    "What', "(line 3: it breaks off)"),
        ("#usda 1.0\nunder", "(line 2: 'under' is not understood)"),
        ('#usda 1.0\ndef "A" { int a = "x" }', "(line 2: Error parsing"),
        (below_review('string tlsplan:review:schema = "tlsplan/review/9"'), "version"),
        (below_review("int64 tlsplan:review:revision = -1"), "revision is -1"),
        (below_review('string tlsplan:review:revision = "1"'), "revision is '1'"),
        (below_review('string[] tlsplan:review:touched = ["zone:Z1"]'), "differ in length"),
        (below_review('string tlsplan:review:kind = "hole"', "Zones", "Z1"), "/Zones/Z1: zone: kind is 'hole'"),
        (below_review("int tlsplan:review:outline = 1", "Zones", "Z1"), "/Zones/Z1: "),
        (below_review('string tlsplan:review:floor = "F0"', "Entrances", "E1"), "expected its position"),
        (below_review('string tlsplan:review:element = "x"', "Doors", "D"), "/Doors/D: state is None"),
        (
            below_review('string tlsplan:review:element = "x"\nstring tlsplan:review:state = "ajar"', "Doors", "D"),
            "/Doors/D: door: state is 'ajar'",
        ),
        (below_review("int tlsplan:review:text = 1", "Comments", "C1"), "text is 1, expected text"),
        (below_review("bool tlsplan:review:isGround = 1", "GroundPicks", "G1"), "expected its position"),
        (below('string xformOp:transform = "x"', "Plan", "Stations", "S001"), "/Plan/Stations/S001: "),
    ],
)
def test_a_layer_that_can_not_be_read_is_told_with_its_prim_and_a_way_out(
    plan: PlanUnderReview, text: str, message: str
) -> None:
    with pytest.raises(PlanFolderError) as refused:
        read_review(text, plan, name="plan/review.usda")
    assert message in str(refused.value)
    assert str(refused.value).startswith("plan/review.usda: ")
    assert "or rename it to begin a new review: nothing is deleted" in str(refused.value)
    assert "\n" not in str(refused.value)


PLAN_LAYER = lines_of("""#usda 1.0
(
    defaultPrim = "Plan"
    metersPerUnit = 1
    upAxis = "Z"
)
def Xform "Plan" ( kind = "assembly" )
{
    def Xform "Stations" ( kind = "group" )
    {
        def Xform "S001" ( kind = "component" )
        {
            custom double tlsplan:coveredArea = 9
            matrix4d xformOp:transform = ( (1, 0, 0, 0), (0, 1, 0, 0), (0, 0, 1, 0), (1, 2, 1.5, 1) )
            uniform token[] xformOpOrder = ["xformOp:transform"]
            def Points "Cloud" {}
        }
        def Xform "S002" ( kind = "component" ) { def Points "Cloud" {} }
        def Xform "S003" ( kind = "component" ) {}
    }
    def Scope "Links" { def BasisCurves "Link_0" {}  def BasisCurves "Link_1" {} }
    def Scope "Routes" { def BasisCurves "F0" {}  def BasisCurves "F1" {} }
}
""")


@pytest.fixture
def stage(tmp_path: Path, plan: PlanUnderReview) -> Usd.Stage:
    (tmp_path / "stations.usda").write_text(PLAN_LAYER)
    head = PLAN_LAYER.partition(")")[0]
    (tmp_path / "plan.usda").write_text(f"{head}subLayers = [ @./review.usda@, @./stations.usda@ ]\n)\n")
    (tmp_path / "review.usda").write_text(review_text(reviewed(*ALL_KINDS), plan))
    return Usd.Stage.Open(str(tmp_path / "plan.usda"))


def test_the_composed_stage_shows_stations_where_reviewers_put_them(stage: Usd.Stage) -> None:
    def place(name: str) -> tuple[float, ...]:
        prim = UsdGeom.Xformable(stage.GetPrimAtPath(f"/Plan/Stations/{name}"))
        return tuple(prim.ComputeLocalToWorldTransform(Usd.TimeCode.Default()).ExtractTranslation())

    assert place("S001") == (5.25, 5.5, 1.75)
    assert place("S004") == pytest.approx((7, 1, 4.6), abs=1e-9)
    assert not stage.GetPrimAtPath("/Plan/Stations/S003").IsActive()
    assert stage.GetPrimAtPath("/Plan/Stations/S004/Marker").IsA(UsdGeom.Sphere)


def test_the_composed_stage_hides_what_showed_the_plan_before(stage: Usd.Stage) -> None:
    moved = stage.GetPrimAtPath("/Plan/Stations/S001")
    assert moved.GetAttribute("tlsplan:coveredArea").Get() is None
    active = {
        path: stage.GetPrimAtPath(path).IsActive()
        for path in ("/Plan/Stations/S001/Cloud", "/Plan/Stations/S002/Cloud", "/Plan/Links/Link_0",
                     "/Plan/Links/Link_1", "/Plan/Routes/F0", "/Plan/Routes/F1")
    }  # fmt: skip
    assert [path for path, shown in active.items() if shown] == ["/Plan/Stations/S002/Cloud"]


def test_the_composed_stage_has_no_validation_errors(stage: Usd.Stage) -> None:
    validators = UsdValidation.ValidationRegistry().GetOrLoadAllValidators()
    assert len(validators) > 10
    errors = UsdValidation.ValidationContext(validators).Validate(stage)
    assert [f"{error.GetName()}: {error.GetMessage()}" for error in errors] == []


def test_zones_are_drawn_on_their_floor_and_comments_stand_at_their_pins(stage: Usd.Stage) -> None:
    zone = UsdGeom.BasisCurves(stage.GetPrimAtPath("/Plan/Review/Zones/Z001"))
    np.testing.assert_allclose(zone.GetPointsAttr().Get(), [(0, 0, 3.02), (2, 0, 3.02), (2, 2, 3.02)], rtol=1e-6)
    assert zone.GetWrapAttr().Get() == "periodic"
    pin = UsdGeom.Xformable(stage.GetPrimAtPath("/Plan/Review/Comments/C001"))
    assert tuple(pin.GetLocalTransformation().ExtractTranslation()) == (5.25, 5.5, 1.75)


def test_a_height_that_is_not_known_stays_so(plan: PlanUnderReview) -> None:
    review = reviewed(c.MoveStation("S001", HERE, None))
    text = review_text(review, plan)
    layer = Sdf.Layer.CreateAnonymous()
    layer.ImportFromString(text)
    assert math.isnan(layer.GetAttributeAtPath("/Plan/Stations/S001.tlsplan:instrumentHeight").default)
    assert read_review(text, plan).stations["S001"].instrument_height_m is None


def test_opinions_of_another_type_or_kind_are_replaced_or_told(plan: PlanUnderReview) -> None:
    review = reviewed(*ALL_KINDS)
    wrong = review_text(review, plan).replace("custom string tlsplan:review:author", "custom int tlsplan:review:author")
    wrong = re.sub(r'(int tlsplan:review:author) = ".*"', r"\1 = 1", wrong)
    assert read_review(review_text(review, plan, wrong), plan) == review
    related = below("rel tlsplan:review:revision", "Plan", "Review")
    with pytest.raises(PlanFolderError, match="in the way of the review"):
        review_text(review, plan, related)


@pytest.mark.slow
@settings(max_examples=100, deadline=None)
@given(
    edits=st.lists(
        st.tuples(st.integers(0, 10_000), st.sampled_from(["", "x", "-1", '"', "nan", "None", "[", "int", "string"])),
        min_size=1, max_size=4,
    )
)  # fmt: skip
def test_a_layer_that_somebody_spoiled_is_a_review_or_is_told(edits: list[tuple[int, str]]) -> None:
    plan = make_plan()
    words = re.split(r"(\W)", review_text(reviewed(*ALL_KINDS), plan))
    for place, word in edits:
        words[place % len(words)] = word
    text = "".join(words)
    try:
        review = read_review(text, plan)
    except PlanFolderError as error:
        assert "\n" not in str(error)
    else:
        try:
            again = review_text(review, plan, text)
        except PlanFolderError as error:
            assert "\n" not in str(error)
        else:
            assert read_review(again, plan) == review


N_DEEP = 100_000


@pytest.mark.parametrize(
    "deep",
    [
        'def "a"\n{\n' * N_DEEP + "}\n" * N_DEEP,
        'def "a" (\n customData = {\n' + "dictionary a = {\n" * N_DEEP + "}\n" * N_DEEP + "}\n)\n{\n}\n",
        'def "a"\n{\n custom double[] x = ' + "[" * N_DEEP + "]" * N_DEEP + "\n}\n",
        'def "a"\n{\n custom double3 x = ' + "(" * N_DEEP,
        'def "a"\n{\n' + 'variantSet "v" = {\n "x" {\n' * N_DEEP,
        'def "a"\n{\n custom string s = "\\"" # "\n custom asset b = @"@\n' + "[" * N_DEEP,
    ],
    ids=["prims", "dictionaries", "lists", "tuples", "variants", "behind texts"],
)
def test_brackets_deep_inside_each_other_are_refused_before_they_take_the_process_down(deep: str) -> None:
    with pytest.raises(PlanFolderError, match="more than 200 brackets inside each other"):
        read_review("#usda 1.0\n" + deep, make_plan())


def test_brackets_in_words_of_people_are_no_brackets() -> None:
    said = "([{" * 300 + "\n" + "'" * 5 + '"' * 7 + "# /* @ \\"
    review = reviewed(c.AddComment(said))
    again = read_review(review_text(review, make_plan(), empty_review()), make_plan())
    assert next(iter(again.comments.values())).text == next(iter(review.comments.values())).text
    assert "([{" * 300 in next(iter(again.comments.values())).text
