"""IFC and USD are read in a child process: the same scene as here, and one line where the library ends the child."""

from __future__ import annotations

import os
import re
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from planner_core import child_process
from planner_core.child_process import LostChildError
from planner_core.errors import SceneError
from planner_core.progress import ProgressEvent, silent
from planner_core.scene import isolated_readers
from planner_core.scene.ifc_shapes import SHAPES
from planner_core.scene.load import load_scene
from planner_core.scene.usd import read_usd
from tests.scene import broken_ifc

pytestmark = pytest.mark.usefixtures("read_apart")
USDA = '#usda 1.0\n(\n    metersPerUnit = 1\n    upAxis = "Z"\n{})\n'
CUBE = 'def Cube "C"\n{\n    double size = 2\n}\n'


def is_same(one: Any, other: Any) -> bool:
    """Of one type and value, arrays bit by bit."""
    if type(one) is not type(other):
        return False
    if isinstance(one, np.ndarray):
        return (one.dtype, one.shape, one.tobytes()) == (other.dtype, other.shape, other.tobytes())
    if is_dataclass(one):
        return all(is_same(getattr(one, f.name), getattr(other, f.name)) for f in fields(one))
    if isinstance(one, tuple):
        return len(one) == len(other) and all(map(is_same, one, other))
    return bool(one == other)


def message_of(path: Path) -> str:
    with pytest.raises(SceneError) as caught:
        load_scene(path)
    message = str(caught.value)
    assert message.startswith(f"{path.name}: ")
    assert "\n" not in message
    assert len(message) < 600
    return message


def written(path: Path, text: str) -> Path:
    path.write_text(text)
    return path


# ------------------------------------------------------------------------------------------------ the same
def check_same(path: Path, file_format: str) -> None:
    apart = isolated_readers.read_apart(path, file_format, skip_bad_faces=False, progress=silent)
    here = isolated_readers.read(str(path), file_format, skip_bad_faces=False)
    assert len(apart.triangles)
    for each in fields(here):
        assert is_same(getattr(apart, each.name), getattr(here, each.name)), each.name


@pytest.mark.slow
@pytest.mark.parametrize("name", ["two.ifc", "four.ifc", "house.usda", "house.usdc"])
def test_small_file_is_the_same_as_in_this_process(tmp_path, write_house, name):
    check_same(write_house(tmp_path, name), "ifc" if name.endswith("ifc") else "usd")


@pytest.mark.slow
def test_building_with_rooms_and_storeys_is_the_same(tmp_path, write_building):
    write_building(tmp_path / "a.ifc")
    check_same(tmp_path / "a.ifc", "ifc")


@pytest.mark.slow
@pytest.mark.parametrize(
    "name", ["ifc-openhouse-ifc4.ifc", "ifc-munich-roof-bricscad.ifc", "ifc-schependomlaan-staal-archicad18.ifczip"]
)
def test_real_file_is_the_same(corpus_file, name):
    check_same(corpus_file(name), "ifc")


@pytest.mark.campaign
@pytest.mark.parametrize("name", ["duplex.ifc", "fzk-haus.ifc"])
def test_real_building_is_the_same(real_ifc, name):
    """Georeferenced, with rooms."""
    check_same(real_ifc(name), "ifc")


@pytest.mark.slow
def test_file_whose_name_is_not_utf8_is_read_or_refused(tmp_path, write_house):
    folder = Path(os.fsdecode(os.fsencode(tmp_path) + b"/w\xe4nde"))
    folder.mkdir()
    assert load_scene(write_house(tmp_path, "four.ifc").rename(folder / "four.ifc")).n_triangles == 48
    path = written(folder / "a.usda", USDA.format("") + CUBE)
    assert "is not UTF-8, which the USD library needs; rename it" in message_of(path)


# ------------------------------------------------------------------------------------------------ losses
@pytest.mark.parametrize(
    "text",
    [
        USDA.format("") + 'def Xform "a"\n{\n' * 200_000 + CUBE + "}\n" * 200_000,
        USDA.format("    customLayerData = " + "{ dictionary a = " * 200_000 + "{}" + "}" * 200_000 + "\n") + CUBE,
    ],
    ids=["prims", "metadata"],
)
def test_usd_that_is_nested_too_deep_is_refused(tmp_path, text):
    message = message_of(written(tmp_path / "deep.usda", text))
    assert "the USD library crashed (segmentation fault) while reading its layers, expected" in message


@pytest.mark.slow
def test_pipe_among_the_layers_of_usd_is_not_waited_for_without_end(tmp_path, monkeypatch):
    monkeypatch.setattr(child_process, "ASLEEP_S", 2.0)
    os.mkfifo(tmp_path / "pipe.usda")
    path = written(tmp_path / "a.usda", USDA.format("    subLayers = [@./pipe.usda@]\n") + CUBE)
    assert "the USD library hung: it did nothing for 2 s while reading its layers" in message_of(path)


@pytest.mark.slow
def test_usd_of_many_billions_is_ended_by_the_limit_of_memory(tmp_path, monkeypatch):
    """Ten references in each of ten references, nine deep."""
    monkeypatch.setenv(child_process.MEMORY_VARIABLE, "0.3")
    levels = ['def Xform "L0"\n{\n' + CUBE + "}\n"]
    for level in range(1, 10):
        parts = "".join(f'    def "c{i}" (references = </L{level - 1}>)\n    {{\n    }}\n' for i in range(10))
        levels.append(f'def Xform "L{level}"\n{{\n{parts}}}\n')
    message = message_of(written(tmp_path / "laughs.usda", USDA.format("") + "".join(levels)))
    assert "the USD library took more than 0.3 GB of memory (TLSPLAN_READ_MEMORY_GB changes that)" in message


def instances(n: int) -> str:
    return (
        f'def PointInstancer "P"\n{{\n    rel prototypes = </P/proto>\n    int[] protoIndices = {[0] * n}\n'
        f"    point3f[] positions = [{','.join(f'({i}, 0, 0)' for i in range(n))}]\n"
        f'    def Xform "proto"\n    {{\n{CUBE}    }}\n}}\n'
    )


def test_instances_of_usd_are_told_as_they_are_made(tmp_path):
    events: list[ProgressEvent] = []
    path = written(tmp_path / "a.usda", USDA.format("") + instances(30))
    assert len(read_usd(path, skip_bad_faces=False, progress=events.append).elements) == 30
    assert [event.done for event in events] == [*range(1, 31)]


def test_usd_of_too_many_instances_is_refused(tmp_path, monkeypatch, in_this_process):
    """The instancer and a Cube in a Xform for each."""
    path = written(tmp_path / "a.usda", USDA.format("") + instances(30))
    monkeypatch.setattr("planner_core.scene.usd.MOST_PRIMS", 62)
    assert len(load_scene(path).elements) == 30
    monkeypatch.setattr("planner_core.scene.usd.MOST_PRIMS", 61)
    assert "a.usda: it has more than 61 prims, counted in every instance, expected fewer" in message_of(path)


@pytest.fixture(scope="session")
def building_text(tmp_path_factory, write_building) -> str:
    path = tmp_path_factory.mktemp("building") / "building.ifc"
    write_building(path)
    return path.read_text()


@pytest.mark.slow
def test_element_that_hangs_is_found(tmp_path, building_text, monkeypatch):
    """Past the checks that would refuse the file: what IfcOpenShell does with an id that is no text."""
    monkeypatch.setattr(child_process, "ASLEEP_S", 2.0)
    wall = broken_ifc.instance(building_text, "IfcWall")
    path = written(tmp_path / "a.ifc", broken_ifc.bad_id("IfcWall", "$")(building_text))
    assert isolated_readers._culprit(path, LostChildError("hung", SHAPES, ()), silent) == f"{wall} IfcWall 'Wall' None"
    made = tuple(int(number) for number in re.findall(r"#(\d+)=IFCWALL\(", building_text))
    assert isolated_readers._culprit(path, LostChildError("hung", SHAPES, made), silent) == SHAPES


@pytest.mark.slow
def test_element_whose_cuts_have_no_end_is_left_out_and_named(tmp_path, building_text, monkeypatch):
    """The others are as in the sound file."""
    monkeypatch.setattr(child_process, "STEP_CPU_S", 1.5)
    monkeypatch.delenv(child_process.LIMIT_VARIABLE, raising=False)
    path = written(tmp_path / "a.ifc", broken_ifc.chained_cuts(1500)(building_text))
    number = broken_ifc.instance(building_text, "IfcWall")
    guid = broken_ifc.slots(building_text, number)[0].strip("'")
    sound = load_scene(written(tmp_path / "sound.ifc", building_text))
    scene = load_scene(path)
    assert {e.source_id for e in sound.elements} - {e.source_id for e in scene.elements} == {guid}
    assert len(scene.elements) == len(sound.elements) - 1
    assert (
        f"a.ifc: 1 element takes IfcOpenShell too long and is left out: {number} IfcWall 'Wall' {guid}; simplify what "
        "is named, or set TLSPLAN_READ_LIMIT_S."
    ) in scene.report.warnings


def test_more_slow_elements_than_are_left_out_are_refused(tmp_path, building_text, monkeypatch):
    made: list[list[int]] = []
    steps_s: list[float] = []
    monkeypatch.delenv(child_process.LIMIT_VARIABLE, raising=False)

    def run_isolated(function: str, arguments: Any, *, limits: child_process.ChildLimits, **_: Any) -> Any:
        steps_s.append(limits.step_cpu_s or 0.0)
        if function == "planner_core.scene.isolated_readers:read":
            raise LostChildError("made no progress", SHAPES, (), is_slow=True)
        made.append(arguments["made"])
        raise LostChildError("made no progress", f"#{len(made)} IfcWall 'Wall'", (), is_slow=True)

    monkeypatch.setattr(child_process, "run_isolated", run_isolated)
    path = written(tmp_path / "a.ifc", building_text)
    assert (
        "a.ifc: more than 20 elements take IfcOpenShell too long, the first is #1 IfcWall 'Wall'; simplify them"
        in message_of(path)
    )
    assert made == [list(range(1, n)) for n in range(1, 22)]
    # The first is looked for as long as any step may take, all of them together in four times as long.
    first_s = steps_s[1]
    assert steps_s[1:6] == pytest.approx([first_s * share for share in (1, 0.5, 0.25, 0.125, 0.125)])
    assert sum(steps_s) < 6 * first_s


def test_limit_that_the_user_set_counts_for_every_slow_element(tmp_path, building_text, monkeypatch):
    monkeypatch.setenv(child_process.LIMIT_VARIABLE, "7")
    steps_s: list[float | None] = []

    def run_isolated(function: str, arguments: Any, *, limits: child_process.ChildLimits, **_: Any) -> Any:
        steps_s.append(limits.step_cpu_s)
        assert limits.whole_cpu_s is None
        place = SHAPES if function == "planner_core.scene.isolated_readers:read" else f"#{len(steps_s)} IfcWall 'Wall'"
        raise LostChildError("made no progress", place, (), is_slow=True)

    monkeypatch.setattr(child_process, "run_isolated", run_isolated)
    message_of(written(tmp_path / "a.ifc", building_text))
    assert set(steps_s) == {7.0}


def test_file_whose_many_steps_take_too_long_together_is_ended_and_says_how_far_it_came(tmp_path, monkeypatch):
    """Each cube is a step, and none is slow."""
    monkeypatch.setattr(child_process, "WHOLE_CPU_S", 0.7)
    monkeypatch.setattr(child_process, "WHOLE_CPU_S_PER_BYTE", 0.0)
    monkeypatch.delenv(child_process.LIMIT_VARIABLE, raising=False)
    cubes = "".join(CUBE.replace('"C"', f'"C{number}"') for number in range(5000))
    message = message_of(written(tmp_path / "many.usda", USDA.format("") + cubes))
    assert "the USD library took more than 1 s of processor time for the whole file" in message
    assert "TLSPLAN_READ_LIMIT_S=0 gives it its time" in message


@pytest.mark.parametrize("is_slow_alone", [False, True])
def test_elements_that_are_slow_together_are_read_but_for_one_that_is_slow_alone(
    tmp_path, building_text, monkeypatch, in_this_process, is_slow_alone
):
    """A first child that shows no step, and a second one that shows none at the wall, or goes through."""
    number = broken_ifc.instance(building_text, "IfcWall")
    wall = f"{number} IfcWall 'Wall' {broken_ifc.slots(building_text, number)[0].strip(chr(39))}"
    real, places = child_process.run_isolated, [SHAPES, wall] if is_slow_alone else [SHAPES]

    def run_isolated(function: str, arguments: Any, **options: Any) -> Any:
        if places:
            raise LostChildError("made no progress", places.pop(0), (), is_slow=True)
        assert (function == "planner_core.scene.isolated_readers:read") == (options["limits"].step_cpu_s is None)
        return real(function, arguments, **options)

    monkeypatch.setattr(child_process, "run_isolated", run_isolated)
    scene = load_scene(written(tmp_path / "a.ifc", building_text))
    assert places == []
    assert (len(scene.elements), "Wall" in [e.name for e in scene.elements]) == (
        (7, False) if is_slow_alone else (8, True)
    )
    assert [line for line in scene.report.warnings if "left out" in line] == [
        f"a.ifc: 1 element takes IfcOpenShell too long and is left out: {wall}; simplify what is named, or set "
        "TLSPLAN_READ_LIMIT_S."
    ] * is_slow_alone


@pytest.mark.parametrize("n", [1000, pytest.param(20_000, marks=pytest.mark.slow)])
def test_usd_that_is_nested_deep_is_refused_before_it_takes_minutes(tmp_path, in_this_process, n):
    """20 000 prims inside each other take the library's own walk minutes, and less than its stack."""
    path = written(tmp_path / "a.usda", USDA.format("") + 'def Xform "a"\n{\n' * n + CUBE + "}\n" * n)
    assert "a.usda: its prims are nested more than 1 000 deep, expected fewer; export it again." in message_of(path)


def test_usd_of_a_billion_instances_is_refused_before_they_are_placed(tmp_path, monkeypatch, in_this_process):
    placed: list[object] = []
    path = written(tmp_path / "a.usda", USDA.format("") + instances(30))
    monkeypatch.setattr("planner_core.scene.usd.MOST_PRIMS", 29)
    monkeypatch.setattr("planner_core.scene.usd.chained", lambda *a: placed.append(a))
    assert "a.usda: it has more than 29 prims, counted in every instance" in message_of(path)
    assert not placed


def test_file_that_takes_too_much_memory_of_python_is_refused(tmp_path, monkeypatch, write_house):
    def fail(*args: Any, **options: Any) -> None:
        raise MemoryError("no")

    monkeypatch.setattr(child_process, "run_isolated", fail)
    message = message_of(write_house(tmp_path, "four.ifc"))
    assert "reading it takes more memory than there is; export it in parts" in message
