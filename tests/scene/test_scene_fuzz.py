"""Damaged copies of valid files are read or refused in one line: never a crash, never an exception of another kind."""

from __future__ import annotations

import random
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from planner_core.errors import PlannerError
from planner_core.scene.load import LoadOptions, load_scene

N_MUTATIONS = 30
NUMBERS = (b"-1", b"99999999999999999999", b"nan", b"1e999", b"0", b"", b"[]", b"null", b"'", b"{}")


def mutations(contents: bytes, seed: int) -> Iterator[bytes]:
    """Copies with a bit flipped, cut off, with bytes or a number replaced, in turn; the same ones on every run."""
    rng = random.Random(seed)
    for i in range(N_MUTATIONS):
        at = rng.randrange(len(contents))
        if i % 5 == 0:
            yield contents[:at]
        elif i % 5 == 1:
            length = rng.randrange(1, 9)
            yield contents[:at] + rng.randbytes(length) + contents[at + length :]
        elif i % 5 == 2:
            digits = [j for j, byte in enumerate(contents) if 48 <= byte <= 57]
            at = rng.choice(digits)
            yield contents[:at] + rng.choice(NUMBERS) + contents[at + 1 :]
        else:
            flipped = bytearray(contents)
            flipped[at] ^= 1 << rng.randrange(8)
            yield bytes(flipped)


def load_or_refuse(path: Path, *, skip_bad_faces: bool) -> str:
    try:
        scene = load_scene(path, options=LoadOptions(skip_bad_faces=skip_bad_faces))
    except PlannerError as error:
        message = str(error)
        assert "\n" not in message
        message.encode()
        return "refused"
    for element in scene.elements:
        element.name.encode()
    return "loaded"


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize(
    "name", ["house.obj", "binary.stl", "text.stl", "little.ply", "big.ply", "text.ply", "house.glb"]
)
def test_damaged_file_is_read_or_refused(tmp_path, write_house, name):
    whole = write_house(tmp_path, name).read_bytes()
    told = set()
    for seed in range(3):
        for number, contents in enumerate(mutations(whole, seed)):
            path = tmp_path / f"{seed}-{number}{Path(name).suffix}"
            path.write_bytes(contents)
            told.add(load_or_refuse(path, skip_bad_faces=bool(number % 2)))
    assert told == {"loaded", "refused"}


@pytest.mark.filterwarnings("error")
def test_damaged_json_of_a_gltf_file_is_read_or_refused(tmp_path, write_house):
    """Most of a GLB is numbers; here only its JSON is damaged."""
    whole = write_house(tmp_path, "house.glb").read_bytes()
    end = 20 + int.from_bytes(whole[12:16], "little")
    text = whole[20:end]
    told = set()
    for seed in range(3):
        for number, changed in enumerate(mutations(text, seed)):
            path = tmp_path / f"{seed}-{number}.glb"
            padded = changed[: len(text)].ljust(len(text))
            path.write_bytes(whole[:20] + padded + whole[end:])
            told.add(load_or_refuse(path, skip_bad_faces=bool(number % 2)))
    assert told == {"loaded", "refused"}


@pytest.mark.slow
@pytest.mark.parametrize("name", ["house.usda", "house.usdc", "four.ifc"])
def test_damaged_file_of_a_native_library_is_read_or_refused(tmp_path, write_house, name):
    """In a process of its own, which a library that crashes ends."""
    path = write_house(tmp_path, name)
    program = (
        "import sys; sys.path.insert(0, sys.argv[1]); from pathlib import Path; import test_scene_fuzz as fuzz\n"
        "whole = Path(sys.argv[2]); told = []\n"
        "for number, contents in enumerate(fuzz.mutations(whole.read_bytes(), 3)):\n"
        "    path = whole.with_name(f'{number}{whole.suffix}'); path.write_bytes(contents)\n"
        "    print(number, file=sys.stderr, flush=True)\n"
        "    told.append(fuzz.load_or_refuse(path, skip_bad_faces=False))\n"
        "print(*told)\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", program, str(Path(__file__).parent), str(path)],
        capture_output=True,
        text=True,
        check=False,
        timeout=240,
    )
    assert done.returncode == 0, done.stderr[-2000:]
    told = done.stdout.split()
    assert len(told) == N_MUTATIONS
    assert "refused" in told
