"""What keeps kernels free of a device's limits: no local memory, no barriers, no atomics."""

import re
from importlib import resources

import pytest

SOURCES = [f for f in resources.files("planner_core.kernels").iterdir() if f.name.endswith((".cl", ".h"))]
#: What would make results depend on the size of a work-group, or need a device that has it.
LIMITED = (
    r"\b(?:__)?local\b|\bbarrier\b|\bwork_group_\w+|\bsub_group_\w+|\batom(?:ic)?_\w+|\bget_local_\w+"
    r"|\bget_group_id\b|reqd_work_group_size"
)


def code_of(text: str) -> str:
    return re.sub(r"/\*.*?\*/|//[^\n]*", "", text, flags=re.DOTALL)


@pytest.mark.parametrize("source", SOURCES, ids=lambda source: source.name)
def test_a_work_item_needs_no_other_one_and_no_local_memory(source: resources.abc.Traversable) -> None:
    found = re.findall(LIMITED, code_of(source.read_text(encoding="utf-8")))
    assert found == [], "docs/method/gpu.md promises that kernels run in work-groups of any size on any device"


def test_the_search_sees_what_it_is_for() -> None:
    for line in ("local int x[4];", "barrier(CLK_LOCAL_MEM_FENCE);", "atom_add(p, 1L);", "atomic_inc(p);"):
        assert re.findall(LIMITED, code_of(line))
    assert not re.findall(LIMITED, code_of("/* local frame */ int local_frame;"))
