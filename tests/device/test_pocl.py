"""PoCL's peculiarities: a processor that its compiler does not know gets a name that it knows; nothing else does."""

import ctypes
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace

import pytest

from planner_core.device import list_devices, open_device, pocl
from planner_core.errors import DeviceError

V1 = ["fpu", "cx8", "cmov", "mmx", "fxsr", "sse", "sse2"]
V2 = [*V1, "cx16", "lahf_lm", "popcnt", "pni", "ssse3", "sse4_1", "sse4_2"]
V3 = [*V2, "avx", "avx2", "bmi1", "bmi2", "f16c", "fma", "abm", "movbe", "xsave"]
V4 = [*V3, "avx512f", "avx512bw", "avx512cd", "avx512dq", "avx512vl"]
TRIPLE = b"x86_64-unknown-linux-gnu"


class Played:
    """A device of PoCL 3.0-rc2 as it lies in memory: two texts that two words at the known places point to."""

    def __init__(self, *, name: bytes = b"generic", triple: bytes = TRIPLE, version: str = "3.0-rc2") -> None:
        self.platform = SimpleNamespace(version=f"OpenCL 3.0 PoCL {version}  Linux, Release, LLVM 14.0.6")
        self._texts = [ctypes.create_string_buffer(text) for text in (triple, name)]
        self._structure = ctypes.create_string_buffer(1024)
        self.int_ptr = ctypes.addressof(self._structure)
        for offset, text in zip((632, 640), self._texts, strict=True):
            ctypes.c_void_p.from_address(self.int_ptr + offset).value = ctypes.addressof(text)

    @property
    def memory(self) -> bytes:
        return self._structure.raw

    @property
    def name(self) -> bytes:
        return ctypes.string_at(ctypes.c_void_p.from_address(self.int_ptr + 640).value)


@pytest.fixture(autouse=True)
def x86_linux(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    monkeypatch.setattr(pocl.platform, "system", lambda: "Linux")
    monkeypatch.setattr(pocl.platform, "machine", lambda: "x86_64")
    before = dict(pocl._named)
    yield
    pocl._named.clear()
    pocl._named.update(before)


@pytest.mark.parametrize(
    ("flags", "level"),
    [
        (V1, "x86-64"),
        (V2, "x86-64-v2"),
        (V3, "x86-64-v3"),
        (V4, "x86-64-v4"),
        ([*V4, "amx_tile"], "x86-64-v4"),
        ([flag for flag in V4 if flag != "avx512vl"], "x86-64-v3"),
        ([flag for flag in V4 if flag != "fma"], "x86-64-v2"),
        ([flag for flag in V4 if flag != "popcnt"], "x86-64"),
        (V4[1:], None),
        ([], None),
    ],
)
def test_the_level_is_the_highest_whose_instructions_are_all_there(flags: list[str], level: str | None) -> None:
    assert pocl.level_of(flags) == level


@pytest.mark.parametrize(("flags", "level"), [(V2, b"x86-64-v2"), (V3, b"x86-64-v3"), (V4, b"x86-64-v4")])
def test_an_unknown_processor_gets_the_name_of_its_level(
    monkeypatch: pytest.MonkeyPatch, flags: list[str], level: bytes
) -> None:
    monkeypatch.setattr(pocl, "processor_flags", lambda: tuple(flags))
    device = Played()
    assert pocl.name_given(device) is None
    pocl.name_processor(device)
    assert device.name == level
    assert pocl.name_given(device) == level.decode()
    before = device.memory
    pocl.name_processor(device)
    assert device.memory == before, "a second call finds a known name"


@pytest.mark.parametrize(
    "unlike",
    [
        {"name": b"znver2"},
        {"name": b"generics"},
        {"name": b""},
        {"triple": b"aarch64-unknown-linux-gnu"},
        {"triple": b"x86_64-unknown-linux-gnux32"},
        {"version": "3.0"},
        {"version": "3.1"},
        {"version": "6.0"},
    ],
)
def test_nothing_is_written_where_the_layout_is_not_the_known_one(
    monkeypatch: pytest.MonkeyPatch, unlike: dict[str, object]
) -> None:
    monkeypatch.setattr(pocl, "processor_flags", lambda: tuple(V4))
    device = Played(**unlike)
    before = device.memory
    pocl.name_processor(device)
    assert device.memory == before
    assert pocl.name_given(device) is None


@pytest.mark.parametrize(("flags", "name"), [(V3, b"znver3"), (V4, b"x86-64-v4")])
def test_a_zen_4_that_is_taken_for_a_zen_3_gets_its_wider_instructions(
    monkeypatch: pytest.MonkeyPatch, flags: list[str], name: bytes
) -> None:
    monkeypatch.setattr(pocl, "processor_flags", lambda: tuple(flags))
    device = Played(name=b"znver3")
    pocl.name_processor(device)
    assert device.name == name
    assert pocl.name_given(device) == (None if name == b"znver3" else name.decode())


@pytest.mark.parametrize(("what", "instead"), [("system", "Darwin"), ("system", "Windows"), ("machine", "aarch64")])
def test_nothing_is_written_on_other_systems(monkeypatch: pytest.MonkeyPatch, what: str, instead: str) -> None:
    monkeypatch.setattr(pocl.platform, what, lambda: instead)
    device = Played()
    before = device.memory
    pocl.name_processor(device)
    assert device.memory == before


def test_wild_addresses_are_told_from_texts_without_a_crash() -> None:
    device = Played()
    for offset in (632, 640):
        for wild in (0, 1, 2**47, 2**64 - 8, 0xC00000000000012C):
            ctypes.c_uint64.from_address(device.int_ptr + offset).value = wild
            before = device.memory
            pocl.name_processor(device)
            assert device.memory == before


def test_nothing_is_written_where_the_processor_does_not_say_what_it_has(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(pocl, "processor_flags", tuple)
    device = Played()
    before = device.memory
    pocl.name_processor(device)
    assert device.memory == before


@pytest.fixture
def no_linker(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """A machine without compiler, linker and C library, as far as the choice of a device can see."""
    monkeypatch.setenv("PATH", str(tmp_path))
    monkeypatch.setattr(pocl, "_LIBRARY_ROOTS", (str(tmp_path),))


@pytest.mark.opencl
@pytest.mark.usefixtures("no_linker")
def test_pocl_without_a_linker_is_refused_with_the_remedy_because_it_would_abort_the_process() -> None:
    there = next(info for info in list_devices() if info.platform == pocl.POCL)
    assert "apt-get install gcc libc6-dev" in there.problem
    with pytest.raises(DeviceError, match="linker") as caught:
        open_device(str(there.index))
    assert "\n" not in str(caught.value)


@pytest.mark.opencl
@pytest.mark.usefixtures("no_linker")
def test_the_linker_alone_is_enough_where_the_libraries_it_needs_are_found(tmp_path: Path) -> None:
    for name in ("ld", "gcc/x86_64-linux-gnu/12/libgcc.a", "x86_64-linux-gnu/libc.so"):
        path = tmp_path / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text("")
        path.chmod(0o755)
    assert [info.problem for info in list_devices() if info.platform == pocl.POCL] == [""]
