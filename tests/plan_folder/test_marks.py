"""Marks of stations: discs, or dots where discs would hide the building."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import pytest

from planner_core.plan_folder.drawing.canvas import Box
from planner_core.plan_folder.drawing.marks import DISC_MM, DOT_MM, Labels, draw_stations


@dataclass
class Recorder:
    """A canvas that keeps discs and words, and the corners of areas, in millimetres."""

    discs: list[tuple[float, float, float]] = field(default_factory=list)
    words: list[str] = field(default_factory=list)
    areas: list[np.ndarray] = field(default_factory=list)

    def disc(self, centre: tuple[float, float], radius: float, *_: object) -> None:
        self.discs.append((*centre, radius))

    def text(self, _at: tuple[float, float], words: str, *_: object, **__: object) -> None:
        self.words.append(words)

    def area(self, rings: list[np.ndarray], *_: object) -> None:
        self.areas += rings

    def lines(self, *_: object, **__: object) -> None:
        pass


def drawn(spots: np.ndarray, mm_per_m: float, words: tuple[str, ...] = ()) -> Recorder:
    canvas = Recorder()
    numbers = list(range(1, len(spots) + 1))
    draw_stations(Labels(canvas, Box(0, 0, 200, 120), []), spots, numbers, words, mm_per_m=mm_per_m)  # type: ignore[arg-type]
    return canvas


@pytest.mark.parametrize("turned", [False, True], ids=["wide", "high"])
def test_dots_leave_a_narrow_corridor_to_be_seen(turned: bool) -> None:
    mm_per_m, half_mm = 1.0, 1.3  # a corridor of 2.6 m on a site of 180 m
    along = np.linspace(15, 105, 8)
    spots = np.column_stack([np.full(8, 60.0), along] if turned else [along, np.full(8, 60.0)])
    canvas = drawn(spots, mm_per_m)
    np.testing.assert_allclose(np.array(canvas.discs)[:, :2], spots)
    assert {radius for *_, radius in canvas.discs} == {DOT_MM}
    assert canvas.words == [str(number) for number in range(1, 9)]
    across = [ring[:, 0 if turned else 1] - 60.0 for ring in canvas.areas]
    assert all(np.abs(each).min() > half_mm for each in across)


@pytest.mark.parametrize(("mm_per_m", "has_disc"), [(2.0, False), (2.6, True), (10.0, True)])
def test_discs_are_drawn_from_the_scale_on_at_which_they_hide_no_corridor(mm_per_m: float, has_disc: bool) -> None:
    canvas = drawn(np.array([[50.0, 60.0]]), mm_per_m)
    assert {each for *_, each in canvas.discs} == ({DOT_MM, DISC_MM} if has_disc else {DOT_MM})


def test_words_of_a_dot_stand_behind_its_number() -> None:
    assert drawn(np.array([[50.0, 60.0], [90.0, 60.0]]), 1.0, ("ground +2.80 m", "")).words == [
        "1  ground +2.80 m",
        "2",
    ]


def test_names_of_rooms_go_above_or_below_what_is_there_and_are_left_out_where_all_is_taken() -> None:
    canvas = Recorder()
    disc = Box(97, 57, 6, 6)
    labels = Labels(canvas, Box(0, 0, 200, 120), [disc])  # type: ignore[arg-type]
    labels.put_where_free(np.array([40.0, 60.0]), "Kitchen")
    labels.put_where_free(np.array([100.0, 60.0]), "Hall")
    labels.put_where_free(np.array([199.0, 60.0]), "beside the drawing")
    middles = [ring.mean(axis=0) for ring in canvas.areas]
    assert canvas.words == ["Kitchen", "Hall"]
    np.testing.assert_allclose(middles[0], [40.0, 60.0])
    assert middles[1][0] == pytest.approx(100.0)
    assert middles[1][1] > disc.bottom + disc.height
    labels.taken.append(Box(20, 40, 40, 40))
    labels.put_where_free(np.array([40.0, 60.0]), "Larder")
    assert "Larder" not in canvas.words
