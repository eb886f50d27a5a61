"""The scale of pages and pictures, by the user: `1:100`, two points of known distance, or four corners of a rectangle.

Points of a picture are pixels, those of a page points of 1/72 inch, both from the upper left corner, as viewers show
them. Four corners take the perspective of a photograph away (a homography). A picture that lies a little askew is
turned, so that most of its lines run along an axis.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from planner_core.drawings.drawing import NO_FILL, Drawing, DrawingText
from planner_core.errors import SceneError
from planner_core.model import FloatArray, Int64Array

_RATIO = re.compile(r"^\s*1\s*[:/]\s*(\d+(?:\.\d+)?)\s*$")
_MOST_SKEW_RAD, _LEAST_SKEW_RAD = np.deg2rad(15.0), np.deg2rad(0.05)
_STEP_RAD = np.deg2rad(0.1)
_MAIN_SHARE = 0.3
"""Of the length of all lines that those of a plan have which run along its main axes, at least."""
_LEAST_APART = 10.0
"""Units between points, so that a pixel more or less does not count."""


_RATIO_IN_TEXT = re.compile(r"(?<![\d.:,])1\s?[:/]\s?(\d{2,4})(?![\d.:,])")
_BAR_LABEL = re.compile(r"^(\d{1,4}(?:[.,]\d{1,2})?)\s*(m|M|cm|mm|ft|')?\.?$")
_BAR_UNIT_M = {"m": 1.0, "cm": 0.01, "mm": 0.001, "ft": 0.3048, "'": 0.3048}
_SAME_BAR_SHARE, _SAME_ROW_POINTS = 0.03, 2.0
"""How well labels of a scale bar agree: their middles lie beside their marks by a part of a letter."""
_NUMBER = re.compile(r"^\d{1,5}(?:[.,]\d{1,3})?$")
_USUAL = (10, 20, 25, 33.333, 40, 50, 75, 100, 125, 150, 200, 250, 300, 400, 500, 1000, 24, 48, 64, 96, 192)
"""Ratios of scales that plans are drawn at, in metres and in feet and inches."""
_VOTES, _LEAD, _SAME_SHARE = 4, 3, 0.004
"""Dimensions that have to agree, how many times as many as for another ratio, and how well."""
_BESIDE_POINTS = 14.0
"""A dimension stands this near to the middle of its line, in points of the page."""


@dataclass(frozen=True)
class PageScale:
    """What the user gives; one of the three, or nothing.

    ratio : 100 of 1:100. points : two, (2, 2) of the page, with their distance_m apart. corners : (4, 2) of the page,
    of a rectangle of size_m, from its upper left corner clockwise.
    """

    ratio: float | None = None
    points: tuple[tuple[float, float], ...] = ()
    distance_m: float | None = None
    corners: tuple[tuple[float, float], ...] = ()
    size_m: tuple[float, float] | None = None


def page_scale(
    length_m: Callable[[str], float],
    *,
    scale: str | None = None,
    scale_by: str | None = None,
    corners: str | None = None,
) -> PageScale:
    """Read what a user types: `1:100`; `2.4m,x1,y1,x2,y2`; `6.5m,4.4m,x1,y1,...,x4,y4`.

    Parameters
    ----------
    length_m
        Metres of a length with its unit.

    Raises
    ------
    SceneError
        Something else.
    """
    if sum(each is not None for each in (scale, scale_by, corners)) > 1:
        raise SceneError(
            "scale: got more than one of --scale, --scale-by and --corners, expected one; leave out others."
        )
    if scale is not None:
        match = _RATIO.match(scale)
        if match is None or not float(match[1]):
            raise SceneError(f"--scale: got {scale!r}, expected a ratio such as 1:100; correct it.")
        return PageScale(ratio=float(match[1]))
    if scale_by is not None:
        form = "LENGTH,X1,Y1,X2,Y2, such as 2.4m,120,300,480,300"
        (distance_m,), points = _lengths_and_points(length_m, scale_by, "--scale-by", 1, 2, form)
        if np.hypot(*(np.array(points[0]) - points[1])) < _LEAST_APART:
            raise SceneError(
                f"--scale-by: got two points less than {_LEAST_APART:g} apart, expected the ends of a long known "
                "distance; choose others."
            )
        return PageScale(points=points, distance_m=distance_m)
    if corners is not None:
        form = "WIDTH,HEIGHT and four corners X,Y clockwise from the upper left"
        (width_m, height_m), four = _lengths_and_points(length_m, corners, "--corners", 2, 4, form)
        return PageScale(corners=four, size_m=(width_m, height_m))
    return PageScale()


def _lengths_and_points(
    length_m: Callable[[str], float], text: str, option: str, n_lengths: int, n_points: int, form: str
) -> tuple[list[float], tuple[tuple[float, float], ...]]:
    words = text.split(",")
    try:
        lengths = [length_m(word) for word in words[:n_lengths]]
        values = [float(word) for word in words[n_lengths:]]
    except ValueError:
        lengths, values = [], []
    if len(values) != 2 * n_points or not all(np.isfinite(values)) or not all(0.0 < each < 1e4 for each in lengths):
        raise SceneError(f"{option}: got {text!r}, expected {form}; correct it.")
    return lengths, tuple(zip(values[::2], values[1::2], strict=True))


def scaled(drawing: Drawing, scale: PageScale) -> Drawing:
    """Bring a page or a picture to metres, x to the right and y up; a picture upright.

    Raises
    ------
    SceneError
        Nothing states its scale, or four corners are no quadrilateral.
    """
    corners = drawing.points[:, :2]
    places = np.array([(text.x, text.y) for text in drawing.texts], dtype=np.float64).reshape(-1, 2)
    if scale.corners:
        matrix = _squaring(scale, drawing)
        corners, places = mapped(corners, matrix), mapped(places, matrix)
    else:
        size_m = _unit_m(drawing, scale)
        corners, places = size_m * corners, size_m * places
        matrix = np.diag([size_m, size_m, 1.0])
    if drawing.from_picture is not None and not scale.corners:
        turn = _upright(drawing.name, corners, drawing.starts)
        corners, places = corners @ turn.T, places @ turn.T
        matrix[:2, :2] = turn @ matrix[:2, :2]
    at = zip(drawing.texts, places.tolist(), strict=True)
    texts = tuple(replace(text, x=x, y=y) for text, (x, y) in at)
    points = np.column_stack([corners, np.zeros(len(corners))])
    return replace(
        drawing,
        points=points,
        texts=texts,
        unit_m=1.0,
        paper_unit_m=None,
        page_height=None,
        from_picture=None if drawing.from_picture is None else matrix @ drawing.from_picture,
    )


def stated_ratio(drawing: Drawing) -> tuple[float, str] | None:
    """The scale that a page states, and where: a text such as `1:100`, a scale bar, or dimensions of lines.

    None: it states none, or several.

    Raises
    ------
    SceneError
        Its text and its scale bar contradict each other: it was enlarged or reduced when it was printed.
    """
    found = {float(match[1]) for text in drawing.texts for match in _RATIO_IN_TEXT.finditer(text.text)}
    bar = _ratio_of_bar(drawing)
    if len(found) == 1:
        ratio = found.pop()
        if bar is not None and abs(bar / ratio - 1.0) > _SAME_BAR_SHARE:
            raise SceneError(
                f"{drawing.name}: got the text 1:{ratio:g} and a scale bar of about 1:{bar:.0f} on its page, expected "
                "one scale, so it was perhaps printed larger or smaller; measure, and pass --scale or --scale-by."
            )
        return ratio, f"the text 1:{ratio:g} on its page"
    if bar is not None and bar in _USUAL:
        return bar, "the scale bar on its page"
    votes = _votes_of_dimensions(drawing)
    if not votes:
        return None
    ratio, count = max(votes.items(), key=lambda vote: (vote[1], -vote[0]))
    others = max((n for other, n in votes.items() if other != ratio), default=0)
    if count < _VOTES or count < _LEAD * others:
        return None
    return ratio, f"{count} dimensions on its page"


def _ratio_of_bar(drawing: Drawing) -> float | None:
    """The ratio of a scale bar: labels in a row from 0, as far apart as their numbers are, the last one with a unit.

    0    1    2         5 m
    |----|----|---------|
    """
    labels = [(text.x, text.y, float(match[1].replace(",", ".")), match[2])
              for text in drawing.texts if (match := _BAR_LABEL.match(text.text))]  # fmt: skip
    if drawing.paper_unit_m is None:
        return None
    for x0, y0, value0, unit0 in labels:
        row = sorted(each for each in labels if abs(each[1] - y0) <= _SAME_ROW_POINTS and each[0] > x0)
        plain = [each for each in row if not each[3]]
        last = next((each for each in row if each[3]), None)
        if value0 or unit0 or last is None or len(plain) < 2:
            continue
        per_point = np.array([value / (x - x0) for x, _, value, _ in plain])
        slope = float(np.median(per_point))
        is_even = (np.abs(per_point / slope - 1.0) <= _SAME_BAR_SHARE).all()
        # The middle of a label with its unit lies aside of its mark.
        if is_even and abs(last[2] / slope - (last[0] - x0)) <= _BESIDE_POINTS and last[2] >= plain[-1][2]:
            ratio = slope * _BAR_UNIT_M[last[3].lower()] / drawing.paper_unit_m
            return next((float(usual) for usual in _USUAL if abs(ratio / usual - 1.0) <= _SAME_BAR_SHARE), ratio)
    return None


def _votes_of_dimensions(drawing: Drawing) -> dict[float, int]:
    """How many numbers on a page are the lengths of lines beside them, in m, cm or mm, by usual ratios."""
    if drawing.paper_unit_m is None:
        return {}
    first = drawing.starts[:-1][(np.diff(drawing.starts) == 2) & (drawing.fill_of_stroke == NO_FILL)]
    starts, ends = drawing.points[first, :2], drawing.points[first + 1, :2]
    middle, length = 0.5 * (starts + ends), np.hypot(*(ends - starts).T)
    votes: dict[float, int] = {}
    for text in drawing.texts:
        if not _NUMBER.match(text.text):
            continue
        value = float(text.text.replace(",", "."))
        near = np.hypot(*(middle - [text.x, text.y]).T) <= _BESIDE_POINTS
        for unit_m in (1.0, 0.01, 0.001):
            ratios = value * unit_m / np.maximum(length[near] * drawing.paper_unit_m, 1e-9)
            for usual in _USUAL:
                if 0.3 <= value * unit_m <= 200.0 and (np.abs(ratios / usual - 1.0) <= _SAME_SHARE).any():
                    votes[float(usual)] = votes.get(float(usual), 0) + 1
    return votes


def cropped(drawing: Drawing, box: tuple[float, float, float, float]) -> Drawing:
    """The part of a drawing inside a box x1, y1, x2, y2: of a page from its upper left corner, else of its coordinates.

    Raises
    ------
    SceneError
        Nothing lies in it.
    """
    x1, y1, x2, y2 = box
    if drawing.page_height is not None:
        y1, y2 = drawing.page_height - y1, drawing.page_height - y2
    low, high = np.array([min(x1, x2), min(y1, y2)]), np.array([max(x1, x2), max(y1, y2)])
    inside = ((drawing.points[:, :2] >= low) & (drawing.points[:, :2] <= high)).all(axis=1)
    n_outside = np.concatenate([[0], np.cumsum(~inside)])[drawing.starts]
    kept = np.diff(n_outside) == 0
    if not kept.any():
        raise SceneError(
            f"{drawing.name}: nothing lies inside the part {','.join(f'{value:g}' for value in box)}, expected a floor "
            "plan; points of a page and pixels of a picture count from its upper left corner."
        )
    lengths = np.diff(drawing.starts)
    return replace(
        drawing,
        points=drawing.points[np.repeat(kept, lengths)],
        starts=np.concatenate([[0], np.cumsum(lengths[kept])]).astype(np.int64),
        layer_of_stroke=drawing.layer_of_stroke[kept],
        symbol_of_stroke=drawing.symbol_of_stroke[kept],
        fill_of_stroke=drawing.fill_of_stroke[kept],
        texts=tuple(t for t in drawing.texts if low[0] <= t.x <= high[0] and low[1] <= t.y <= high[1]),
    )


_MARK = "\0mark"


def with_mark(drawing: Drawing, at: tuple[float, float]) -> Drawing:
    """A drawing with a text at a point of the user, which goes wherever the drawing is brought."""
    x, y = at
    y = y if drawing.page_height is None else drawing.page_height - y
    return replace(drawing, texts=(*drawing.texts, DrawingText(_MARK, x, y, 0.0, "")))


def without_mark(drawing: Drawing) -> tuple[Drawing, FloatArray]:
    """The drawing without its mark, and where that is, (2,)."""
    mark = next(text for text in drawing.texts if text.text == _MARK)
    rest = tuple(text for text in drawing.texts if text is not mark)
    return replace(drawing, texts=rest), np.array([mark.x, mark.y])


def _unit_m(drawing: Drawing, scale: PageScale) -> float:
    """Metres of the building in a unit of the page."""
    by_points = "--scale-by 2.4m,x1,y1,x2,y2 (pixels from the upper left corner)"
    if scale.points and scale.distance_m:
        return scale.distance_m / float(math.dist(*scale.points))
    if scale.ratio is None:
        example = by_points if drawing.paper_unit_m is None else "--scale 1:100"
        raise SceneError(f"{drawing.name}: it states no scale, expected one; pass it, such as {example}.")
    if drawing.paper_unit_m is None:
        raise SceneError(
            f"{drawing.name}: it does not state its resolution, so its scale 1:{scale.ratio:g} gives no lengths; pass "
            f"two points of known distance, such as {by_points}."
        )
    return scale.ratio * drawing.paper_unit_m


def mapped(points: FloatArray, matrix: FloatArray) -> FloatArray:
    """Points (N, 2) by a homography (3, 3); NaN where they have no image."""
    images = np.column_stack([points, np.ones(len(points))]) @ matrix.T
    depth = images[:, 2:]
    return np.asarray(images[:, :2] / np.where(np.abs(depth) < 1e-12, np.nan, depth))


def _squaring(scale: PageScale, drawing: Drawing) -> FloatArray:
    """(3, 3) from points seen in perspective to metres in the plane of the rectangle of four corners."""
    assert scale.size_m is not None and drawing.page_height is not None
    width_m, height_m = scale.size_m
    seen = np.array(scale.corners) * [1.0, -1.0] + [0.0, drawing.page_height]
    sides = np.roll(seen, -1, axis=0) - seen
    turns = sides[:, 0] * np.roll(sides, -1, axis=0)[:, 1] - sides[:, 1] * np.roll(sides, -1, axis=0)[:, 0]
    if not (turns < -_LEAST_APART).all():
        raise SceneError(
            "--corners: got corners that enclose no area clockwise, expected the upper left, upper right, lower right "
            "and lower left corner of a rectangle; correct them."
        )
    to = np.array([(0.0, height_m), (width_m, height_m), (width_m, 0.0), (0.0, 0.0)])
    middle, size = seen.mean(axis=0), float(np.ptp(seen))
    rows = []
    for (x, y), (u, v) in zip(((seen - middle) / size).tolist(), to.tolist(), strict=True):
        rows.append([x, y, 1, 0, 0, 0, -u * x, -u * y, -u])
        rows.append([0, 0, 0, x, y, 1, -v * x, -v * y, -v])
    matrix = np.linalg.svd(np.array(rows))[2][-1].reshape(3, 3)
    return np.asarray(matrix @ [[1 / size, 0, -middle[0] / size], [0, 1 / size, -middle[1] / size], [0, 0, 1]])


def _upright(name: str, points: FloatArray, starts: Int64Array) -> FloatArray:
    """(2, 2) turn by the small angle at which most lines of points (N, 2) run along an axis."""
    step = np.diff(points, axis=0)
    inner = np.ones(len(step), dtype=np.bool_)
    inner[starts[1:-1] - 1] = False
    step = step[inner]
    length = np.hypot(step[:, 0], step[:, 1])
    if not length.sum():
        return np.eye(2)
    angle = (np.arctan2(step[:, 1], step[:, 0]) + np.pi / 4) % (np.pi / 2) - np.pi / 4
    values, at = np.unique(np.rint(angle / _STEP_RAD), return_inverse=True)
    best = values[np.argmax(np.bincount(at.reshape(-1), weights=length))] * _STEP_RAD
    near = np.abs(angle - best) <= 2 * _STEP_RAD
    skew = float((angle[near] * length[near]).sum() / length[near].sum())
    if abs(skew) >= _MOST_SKEW_RAD and length[near].sum() > _MAIN_SHARE * length.sum():
        raise SceneError(
            f"{name}: its lines run at {abs(np.rad2deg(skew)):.0f} degrees to the edges of the picture, expected less "
            f"than {np.rad2deg(_MOST_SKEW_RAD):.0f}, as slanting lines are traced badly; turn it upright in an image "
            "editor, or photograph it from straight ahead."
        )
    if not _LEAST_SKEW_RAD < abs(skew) < _MOST_SKEW_RAD:
        return np.eye(2)
    return np.array([[np.cos(skew), np.sin(skew)], [-np.sin(skew), np.cos(skew)]])
