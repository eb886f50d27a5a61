"""A machine on which pyopencl can't be loaded: `PYTHONPATH=tests/machines/no_pyopencl`."""

import sys

sys.modules["pyopencl"] = None  # `import pyopencl` raises ImportError
