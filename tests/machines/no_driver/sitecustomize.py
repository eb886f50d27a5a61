"""A machine on which no OpenCL driver is installed: `PYTHONPATH=tests/machines/no_driver`.

pyopencl's own loader finds PoCL in the folder that PYOPENCL_HOME names, which importing pyopencl sets, and the system's
drivers in the folder that OCL_ICD_VENDORS names. Both are led to where nothing is, as soon as pyopencl is imported and
before the loader looks, which it does once, at the first call. pyopencl is not imported here: commands that need none
start as fast as ever.
"""

import os
import sys
from importlib.abc import Loader, MetaPathFinder
from importlib.machinery import ModuleSpec, PathFinder
from pathlib import Path
from types import ModuleType


class _Blind(Loader):
    """Loads pyopencl as ever, and lets it find nothing."""

    def __init__(self, real: Loader) -> None:
        self._real = real

    def create_module(self, spec: ModuleSpec) -> ModuleType | None:
        return self._real.create_module(spec)

    def exec_module(self, module: ModuleType) -> None:
        self._real.exec_module(module)
        nowhere = str(Path(__file__).with_name("no_such_folder"))
        os.environ["PYOPENCL_HOME"] = os.environ["OCL_ICD_VENDORS"] = nowhere


class _Finder(MetaPathFinder):
    def find_spec(self, fullname, path=None, target=None):
        if fullname != "pyopencl":
            return None
        spec = PathFinder.find_spec(fullname, path)
        if spec is not None:
            spec.loader = _Blind(spec.loader)
        return spec


sys.meta_path.insert(0, _Finder())
