"""A machine whose processor PoCL's compiler does not know: `PYTHONPATH=tests/machines/unknown_processor`.

There PoCL calls it `generic`, or what NAME in the environment says. Here that name is put in the place of the right
one as soon as pyopencl is asked for platforms, before anything of ours sees a device. With UNAIDED=1 in the
environment our remedy is taken away, too;
with LEVEL=x86-64-v3 it is of that level, whatever this processor has.

The place of the name is written out here once more: a test is no test of offsets that it reads from what it tests.
"""

import ctypes
import os
import sys
from importlib.abc import Loader, MetaPathFinder
from importlib.machinery import ModuleSpec, PathFinder
from types import ModuleType

_NAME_OFFSET = 640
_name = ctypes.create_string_buffer(os.environ.get("NAME", "generic").encode())


class _Then(Loader):
    """Loads a module as ever, and changes it."""

    def __init__(self, real: Loader, change) -> None:
        self._real, self._change = real, change

    def create_module(self, spec: ModuleSpec) -> ModuleType | None:
        return self._real.create_module(spec)

    def exec_module(self, module: ModuleType) -> None:
        self._real.exec_module(module)
        self._change(module)


class _Finder(MetaPathFinder):
    def find_spec(self, fullname, path=None, target=None):
        change = _CHANGES.get(fullname)
        spec = None if change is None else PathFinder.find_spec(fullname, path)
        if spec is not None:
            spec.loader = _Then(spec.loader, change)
        return spec


def _forget_the_processor(pyopencl: ModuleType) -> None:
    real, done = pyopencl.get_platforms, set()

    def get_platforms():
        platforms = real()
        for platform in platforms:
            for device in platform.get_devices() if "PoCL 3.0-rc2" in platform.version else ():
                if device.int_ptr not in done:
                    done.add(device.int_ptr)
                    ctypes.c_void_p.from_address(device.int_ptr + _NAME_OFFSET).value = ctypes.addressof(_name)
        return platforms

    pyopencl.get_platforms = get_platforms


def _change_the_remedy(pocl: ModuleType) -> None:
    if os.environ.get("UNAIDED") == "1":
        pocl.name_processor = lambda device: None
    if level := os.environ.get("LEVEL"):
        pocl.level_of = lambda flags: level


_CHANGES = {"pyopencl": _forget_the_processor, "planner_core.device.pocl": _change_the_remedy}
sys.meta_path.insert(0, _Finder())
