"""Pictures of floor plans, drawn by Pillow: lines are traced, scaled, set upright, and recognised."""

import numpy as np
import pytest
import shapely
from PIL import Image, ImageDraw

from planner_core.drawings.floor_plan import floor_plans
from planner_core.drawings.line_tracing import filled_areas, traced_lines
from planner_core.drawings.pictures import drawing_of_pixels, read_picture
from planner_core.drawings.plan_picture import write_plan_picture
from planner_core.drawings.scales import PageScale, page_scale, scaled
from planner_core.errors import SceneError
from planner_core.requirements.quantities import coordinate_m
from tests.drawings.drawn_buildings import ROOM_WALLS

PX = 100.0
"""Pixels in a metre."""
SIZE = (900, 700)


def strokes_m():
    """Outlines of the walls of two rooms, two doors and a window between the wall's faces, metres."""
    walls = [
        shapely.get_coordinates(ring)
        for part in shapely.get_parts(ROOM_WALLS)
        for ring in (part.exterior, *part.interiors)
    ]
    angle = np.linspace(0.0, np.pi / 2, 40)
    quarter = np.column_stack([np.cos(angle), np.sin(angle)])
    doors = []
    for hinge, radius in (((3.25, 1.0), 0.9), ((1.0, 0.1), 1.0)):
        doors += [np.array([hinge, np.add(hinge, (radius, 0.0))]), np.array(hinge) + radius * quarter]
    panes = [np.array([(4.0, y), (5.5, y)]) for y in (4.2, 4.3, 4.4)]
    return walls, doors, panes


def picture(place=lambda points: points, colours=("black", "black", "black"), paper="white"):
    """(H, W, 3) uint8. place : from metres of the plan to pixels from the lower left corner."""
    image = Image.new("RGB", SIZE, paper)
    draw = ImageDraw.Draw(image)
    for strokes, colour in zip(strokes_m(), colours, strict=True):
        for stroke in strokes:
            at = place(np.asarray(stroke) * PX + [80.0, 120.0])
            draw.line([(x, SIZE[1] - 1 - y) for x, y in at.tolist()], fill=colour, width=2)
    return np.array(image)


METRE = PageScale(points=((0, 0), (PX, 0)), distance_m=1.0)


def plan_of(rgb, scale=METRE, **options):
    drawing = scaled(drawing_of_pixels(rgb, "a.png"), scale)
    (plan,) = floor_plans(drawing, unit_m=1.0, **options)
    return plan


def overlap(plan):
    """Intersection of the plan's walls with the true ones over their union, brought together at their lower left."""
    walls = shapely.union_all([piece.area for piece in plan.walls])
    move = np.array(ROOM_WALLS.bounds[:2]) - walls.bounds[:2]
    walls = shapely.affinity.translate(walls, *move)
    return walls.intersection(ROOM_WALLS).area / walls.union(ROOM_WALLS).area


def kinds(plan):
    return sorted((str(opening.kind), round(opening.width_m, 1)) for opening in plan.openings)


def test_lines_are_traced_through_crossings_and_round_rings():
    ink = np.zeros((60, 80), dtype=bool)
    ink[10:12, 5:75] = ink[2:50, 40:42] = True
    y, x = np.mgrid[:60, :80]
    ink |= np.abs(np.hypot(x - 20, y - 35) - 10) < 1
    traced = shapely.multilinestrings([shapely.linestrings(line) for line in traced_lines(ink)])
    true = [[(5, 10.5), (74, 10.5)], [(40.5, 2), (40.5, 49)]]
    ring = shapely.Point(20, 35).buffer(10).exterior
    drawn = shapely.union_all([*(shapely.linestrings(line) for line in true), ring])
    assert shapely.hausdorff_distance(traced, drawn, densify=0.02) < 2.5
    assert traced.length == pytest.approx(drawn.length, rel=0.05)


def test_thick_ink_is_an_area_with_its_holes():
    ink = np.zeros((80, 100), dtype=bool)
    ink[10:70, 10:90] = True
    ink[25:55, 30:70] = False
    ink[75, 5:95] = True
    (rings,), lines = filled_areas(ink, 6.0)
    assert [shapely.Polygon(ring).area for ring in rings] == pytest.approx([60 * 80, 30 * 40], rel=0.03)
    assert lines.sum() == 90


def test_two_rooms_are_recognised_by_shape_alone():
    plan = plan_of(picture())
    assert overlap(plan) > 0.9
    assert kinds(plan) == [("door", 0.9), ("door", 1.0), ("window", 1.5)]
    assert [room.outline.area for room in plan.rooms] == pytest.approx([12.0, 12.0], rel=0.03)
    assert "what looks like walls on layer black" in plan.warnings[0]


def test_colours_are_layers_and_dark_paper_is_paper():
    plan = plan_of(picture(colours=("lime", "red", "blue"), paper="black"))
    assert overlap(plan) > 0.85
    assert kinds(plan)[:2] == [("door", 0.9), ("door", 1.0)]
    assert "on layer green and no other layer" in plan.warnings[0]


def test_picture_that_lies_askew_is_turned_upright():
    angle = np.deg2rad(4.0)
    turn = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
    plan = plan_of(picture(lambda points: (points - 300.0) @ turn + 330.0))
    assert overlap(plan) > 0.9
    assert len(plan.rooms) == 2


def test_picture_that_is_turned_by_far_is_refused():
    image = Image.fromarray(picture()).rotate(45.0, expand=True, fillcolor="white", resample=Image.Resampling.BICUBIC)
    with pytest.raises(SceneError, match=r"run at 4[45] degrees to the edges of the picture.*turn it upright"):
        plan_of(np.array(image))


def seen_askew(points):
    """A camera looks down on the plan from one side: lines meet at a point far away."""
    depth = 1.0 + points[:, 1:] / 2200.0
    return (points - [450.0, 0.0]) / depth + [450.0, 30.0]


def pixels_of(points_m):
    """Places of the plan in the picture that the camera takes, from its upper left corner."""
    at = seen_askew(np.array(points_m) * PX + [80.0, 120.0])
    return [(x, SIZE[1] - 1 - y) for x, y in at.tolist()]


ASKEW = PageScale(
    corners=tuple(pixels_of([(0.0, 4.4), (6.5, 4.4), (6.5, 0.0), (0.0, 0.0)])),
    size_m=(6.5, 4.4),
)


def test_four_corners_take_the_perspective_away():
    plan = plan_of(picture(seen_askew), ASKEW)
    assert overlap(plan) > 0.85
    assert kinds(plan)[:2] == [("door", 0.9), ("door", 1.0)]


def test_resolution_of_the_file_and_a_ratio_give_the_scale(tmp_path):
    path = tmp_path / "a.png"
    Image.fromarray(picture()).save(
        path, dpi=(254, 254)
    )  # 100 pixels in a metre are 1:100 at 10 pixels in a millimetre
    drawing = scaled(read_picture(str(path)), PageScale(ratio=100.0))
    (plan,) = floor_plans(drawing, unit_m=1.0)
    assert overlap(plan) > 0.9
    Image.fromarray(picture()).save(path)
    with pytest.raises(SceneError, match=r"does not state its resolution.*--scale-by 2\.4m"):
        scaled(read_picture(str(path)), PageScale(ratio=100.0))
    with pytest.raises(SceneError, match=r"states no scale, expected one; pass it, such as --scale-by"):
        scaled(read_picture(str(path)), PageScale())


@pytest.mark.parametrize(
    ("values", "words"),
    [
        (np.full((300, 400, 3), 255), "nothing is drawn on it"),
        (np.random.default_rng(1).integers(0, 256, (300, 400, 3)), "% of it is ink, expected dark or coloured lines"),
        (np.full((50, 60, 3), 255), r"it has 3 000 pixels, expected 10 000 to"),
    ],
)
def test_pictures_of_other_things_are_refused_in_one_line(tmp_path, values, words):
    Image.fromarray(values.astype(np.uint8)).save(tmp_path / "a.png")
    with pytest.raises(SceneError, match=words):
        read_picture(str(tmp_path / "a.png"))


def test_what_is_no_picture_is_refused(tmp_path):
    (tmp_path / "a.png").write_bytes(b"\x89PNG\r\n\x1a\nhello")
    with pytest.raises(SceneError, match=r"can't be read as a picture .*save it again"):
        read_picture(str(tmp_path / "a.png"))


def test_furniture_alone_is_no_floor_plan():
    image = Image.new("RGB", SIZE, "white")
    ImageDraw.Draw(image).rectangle((100, 100, 300, 300), outline="black", width=2)
    ImageDraw.Draw(image).ellipse((400, 300, 520, 420), outline="black", width=2)
    with pytest.raises(SceneError, match="has a name for walls or holds lines like walls"):
        plan_of(np.array(image))


def test_scales_are_read_as_people_type_them():
    assert page_scale(coordinate_m, scale="1:50").ratio == 50.0
    by = page_scale(coordinate_m, scale_by="8ft,10,20,110,20")
    assert by.distance_m == pytest.approx(2.4384)
    assert by.points == ((10.0, 20.0), (110.0, 20.0))
    four = page_scale(coordinate_m, corners="6.5m,4.4m,0,0,9,0,9,9,0,9")
    assert (four.size_m, len(four.corners)) == ((6.5, 4.4), 4)
    for wrong in ({"scale": "100"}, {"scale_by": "2.4m,1,2,3"}, {"scale_by": "2m,1,1,2,1"}, {"corners": "1m,2m,3,4"}):
        with pytest.raises(SceneError, match=r"^--\S+: got"):
            page_scale(coordinate_m, **wrong)
    with pytest.raises(SceneError, match="more than one"):
        page_scale(coordinate_m, scale="1:50", scale_by="1m,0,0,50,0")


def test_facade_is_no_floor_plan():
    """Frames of windows look like walls round rooms that nobody can enter."""
    image = Image.new("RGB", SIZE, "white")
    draw = ImageDraw.Draw(image)
    for x, y in ((100, 100), (400, 100), (100, 350), (400, 350)):
        draw.rectangle((x, y, x + 200, y + 180), outline="black", width=2)
        draw.rectangle((x + 10, y + 10, x + 190, y + 170), outline="black", width=2)
    with pytest.raises(SceneError, match=r"encloses 4 rooms without a door or a gap, as on facades.*--layer wall=NAME"):
        plan_of(np.array(image))


def test_picture_lies_over_its_storey_without_perspective(tmp_path):
    """A red square of the plan, drawn as a camera sees it, is where it is in the plan."""
    image = Image.fromarray(picture(seen_askew))
    ImageDraw.Draw(image).polygon(pixels_of([(2.0, 1.0), (3.0, 1.0), (3.0, 2.0), (2.0, 2.0)]), fill="red")
    image.save(tmp_path / "a.png")
    drawing = scaled(read_picture(str(tmp_path / "a.png")), ASKEW)
    box_m = [-0.5, -0.5, 7.5, 5.5]
    write_plan_picture(str(tmp_path / "a.png"), str(tmp_path / "b.png"), drawing.from_picture.tolist(), box_m)
    plan = np.asarray(Image.open(tmp_path / "b.png"))
    assert plan.shape == (1800, 2400, 3)
    rows, columns = np.nonzero((plan[..., 0] > 200) & (plan[..., 1] < 60))
    low = [columns.min() / 300 - 0.5, 5.5 - (rows.max() + 1) / 300]
    high = [(columns.max() + 1) / 300 - 0.5, 5.5 - rows.min() / 300]
    assert [*low, *high] == pytest.approx([2.0, 1.0, 3.0, 2.0], abs=0.03)
