"""Pages of PDF, written by reportlab: vectors, texts, scales, turned pages, and pages that are pictures."""

import io

import numpy as np
import pytest
import shapely
from PIL import Image
from reportlab.lib.utils import ImageReader
from reportlab.pdfgen.canvas import Canvas

from planner_core.drawings.lift import DrawingOptions, lift_drawings, recognised
from planner_core.drawings.pdf import POINT_M, read_pdf
from planner_core.drawings.scales import PageScale, cropped, scaled, stated_ratio
from planner_core.errors import SceneError
from tests.drawings.test_pictures import ROOM_WALLS, picture, strokes_m

PER_M = 0.01 / POINT_M
"""Points of a page in a metre at 1:100."""


def draw_plan(canvas, at=(60.0, 60.0), per_m=PER_M, names=True):
    walls, doors, panes = strokes_m()
    for width, strokes in ((1.4, walls), (0.5, doors), (0.5, panes)):
        canvas.setLineWidth(width)
        for stroke in strokes:
            path = canvas.beginPath()
            (x, y), *rest = (np.asarray(stroke) * per_m + at).tolist()
            path.moveTo(x, y)
            for x, y in rest:
                path.lineTo(x, y)
            canvas.drawPath(path)
    if names:
        canvas.setFont("Helvetica", 8)
        for x, text in ((1.2, "101 Office"), (4.4, "102 Kitchen")):
            canvas.drawString(at[0] + x * per_m, at[1] + 2.6 * per_m, text)


@pytest.fixture
def page(tmp_path):
    """Returns a function that draws a page by one that gets the canvas, and gives its path."""

    def make(draw, *, rotation=0, n_pages=1):
        canvas = Canvas(str(tmp_path / "a.pdf"), pagesize=(400, 300), invariant=1)
        for number in range(n_pages):
            if rotation:
                canvas.setPageRotation(rotation)
            draw(canvas)
            canvas.drawString(20, 20, f"sheet {number + 1}")
            canvas.showPage()
        canvas.save()
        return tmp_path / "a.pdf"

    return make


def plan(path, **options):
    (storey,) = lift_drawings([path], DrawingOptions(**options)).storeys
    return storey


def kinds(storey):
    return sorted(e.kind for e in storey.elements if e.kind in ("IfcDoor", "IfcWindow"))


def walls(storey):
    prisms = [p for e in storey.elements if e.kind == "IfcWall" and e.opening is None for p in e.prisms]
    return shapely.union_all([prism.area for prism in prisms])


def test_plan_on_a_page_is_recognised_with_its_names(page):
    storey = plan(page(draw_plan), scales=(PageScale(ratio=100.0),))
    assert kinds(storey) == ["IfcDoor", "IfcDoor", "IfcWindow"]
    assert [(room.name, room.long_name) for room in storey.rooms] == [("101", "Office"), ("102", "Kitchen")]
    area = shapely.affinity.translate(walls(storey), *(np.array([-60.0, -60.0]) / PER_M))
    assert shapely.symmetric_difference(area, ROOM_WALLS).area < 0.05


@pytest.mark.parametrize("rotation", [90, 180, 270])
def test_turned_pages_are_read_as_they_are_shown(page, rotation):
    drawing = read_pdf(str(page(draw_plan, rotation=rotation)))
    assert drawing.page_height == 300.0  # reportlab turns the sheet, too: it is shown 400 wide and 300 high
    low, high = drawing.points[:, :2].min(axis=0), drawing.points[:, :2].max(axis=0)
    size = np.array([6.5, 4.4]) * PER_M
    assert high - low == pytest.approx(size[::-1] if rotation in (90, 270) else size)
    # The plan's corner beside that of the sheet as drawn, which went round clockwise.
    corner, place = {90: ((low[0], high[1]), (60.0, 240.0)), 180: (high, (340.0, 240.0))}.get(
        rotation, ((high[0], low[1]), (340.0, 60.0))
    )
    assert corner == pytest.approx(place)


def test_scale_that_the_page_states_is_taken_with_a_warning(page):
    def draw(canvas):
        draw_plan(canvas)
        canvas.drawString(250, 20, "M 1:100")

    building = lift_drawings([page(draw)])
    assert "its scale is 1:100 by the text 1:100 on its page" in building.warnings[0]
    assert walls(building.storeys[0]).bounds[2] - walls(building.storeys[0]).bounds[0] == pytest.approx(6.5, abs=0.01)


def test_dimensions_that_agree_with_their_lines_give_the_scale(page):
    def draw(canvas):
        draw_plan(canvas)
        for n, (x, length) in enumerate(((0.0, 3.3), (3.3, 3.2), (0.0, 1.0), (1.0, 1.0), (2.0, 4.5))):
            y = 30 if n < 2 else 45
            canvas.line(60 + x * PER_M, y, 60 + (x + length) * PER_M, y)
            canvas.drawCentredString(60 + (x + length / 2) * PER_M, y + 2, f"{length:.2f}")

    assert stated_ratio(read_pdf(str(page(draw)))) == (100.0, "5 dimensions on its page")
    assert stated_ratio(read_pdf(str(page(draw_plan)))) is None


def test_page_without_scale_is_refused(page):
    with pytest.raises(SceneError, match=r"a\.pdf: it states no scale, expected one; pass it, such as --scale 1:100"):
        lift_drawings([page(draw_plan)])


def test_pages_are_storeys_and_have_to_be_named(page):
    path = page(draw_plan, n_pages=3)
    scales = (PageScale(ratio=100.0),)
    with pytest.raises(SceneError, match=r"it has 3 pages and got no page.*--page 1"):
        lift_drawings([path], DrawingOptions(scales=scales))
    with pytest.raises(SceneError, match=r"it has 3 pages and got page 4"):
        lift_drawings([path], DrawingOptions(scales=scales, pages=((4,),)))
    assert len(lift_drawings([path], DrawingOptions(scales=scales, pages=((1, 3),))).storeys) == 2


def test_one_of_two_plans_on_a_page_is_picked_by_its_box(page):
    def draw(canvas):
        draw_plan(canvas, per_m=PER_M / 2, at=(20.0, 60.0), names=False)
        draw_plan(canvas, per_m=PER_M / 2, at=(200.0, 60.0), names=False)

    drawing = read_pdf(str(page(draw)))
    left = cropped(drawing, (0.0, 0.0, 150.0, 300.0))
    assert left.points[:, 0].max() < 150.0 < drawing.points[:, 0].max()
    assert 2 * left.n_strokes == drawing.n_strokes
    with pytest.raises(SceneError, match="nothing lies inside the part 390,0,400,9"):
        cropped(drawing, (390.0, 0.0, 400.0, 9.0))
    path = page(draw)
    assert len(plan(path, scales=(PageScale(ratio=200.0),), parts=(((180.0, 0.0, 400.0, 300.0),),)).rooms) == 2


@pytest.mark.slow
def test_page_that_is_a_picture_is_traced(page):
    pixels = io.BytesIO()
    Image.fromarray(picture()).resize((1800, 1400)).save(pixels, "png")

    def draw(canvas):
        canvas.drawImage(ImageReader(pixels), 20, 40, 9.0 * PER_M, 7.0 * PER_M)

    path = page(draw)
    storey = plan(path, scales=(PageScale(ratio=100.0),))
    assert len(storey.rooms) == 2
    assert kinds(storey)[:2] == ["IfcDoor", "IfcDoor"]


def test_page_that_is_a_picture_is_scaled_by_points_of_the_page_and_shown_under_its_storey(page, tmp_path):
    def draw(canvas):
        canvas.drawImage(ImageReader(Image.fromarray(picture())), 20, 40, 9.0 * PER_M, 7.0 * PER_M)

    path = page(draw)
    by = PageScale(points=((20.0, 100.0), (20.0 + 9.0 * PER_M, 100.0)), distance_m=9.0)
    found = recognised([path], DrawingOptions(scales=(by,)))
    walls = np.array([corner for wall in found.drawn.storeys[0].walls for corner in wall.outline])
    assert np.ptp(walls, axis=0) == pytest.approx([6.5, 4.4], abs=0.1)  # in points; by pixels it would be 18 m
    (shown,) = found.pictures
    shown.write(tmp_path / "a.png")
    ink = np.asarray(Image.open(tmp_path / "a.png"))[..., 0] < 128
    rows, columns = np.nonzero(ink)
    x0, _, x1, y1 = shown.box_m
    per_m = ink.shape[1] / (x1 - x0)
    high = [x0 + (columns.max() + 1) / per_m, y1 - rows.min() / per_m]
    assert high == pytest.approx(walls.max(axis=0).tolist(), abs=0.03)


def test_scale_bar_gives_the_scale_and_contradicts_a_text_of_another(page):
    def draw(canvas, text=""):
        draw_plan(canvas, names=False)
        for label, value in (("0", 0), ("1", 1), ("2", 2), ("5 m", 5)):
            canvas.drawCentredString(60.0 + value * PER_M, 30.0, label)
        canvas.drawString(300.0, 20.0, text)

    assert stated_ratio(read_pdf(str(page(draw)))) == (100.0, "the scale bar on its page")
    drawing = read_pdf(str(page(lambda canvas: draw(canvas, "1:50"))))
    with pytest.raises(SceneError, match=r"got the text 1:50 and a scale bar of about 1:100 on its page.*--scale-by"):
        stated_ratio(drawing)


@pytest.mark.parametrize(("contents", "words"), [(b"%PDF-1.7\nhello", "PDFium can't read it"), (b"", "PDFium")])
def test_what_is_no_pdf_is_refused(tmp_path, contents, words):
    (tmp_path / "a.pdf").write_bytes(contents)
    with pytest.raises(SceneError, match=words):
        read_pdf(str(tmp_path / "a.pdf"))


def test_white_lines_and_empty_pages_hold_nothing(page):
    def draw(canvas):
        canvas.setStrokeColorRGB(1, 1, 1)
        canvas.line(0, 0, 100, 100)

    with pytest.raises(SceneError, match="nothing is drawn on its page"):
        read_pdf(str(page(draw)))


def test_scale_by_two_points_of_a_page(page):
    drawing = read_pdf(str(page(draw_plan)))
    by = PageScale(points=((60.0, 240.0), (60.0 + 6.5 * PER_M, 240.0)), distance_m=6.5)
    assert np.ptp(scaled(drawing, by).points[:, 0]) == pytest.approx(6.5)
