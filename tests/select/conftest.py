"""Lets the tests of this folder import the modules that lie beside them."""

import sys
from pathlib import Path

_FOLDER = str(Path(__file__).parent)
sys.path.insert(0, _FOLDER)
try:
    import joined_instances  # noqa: F401 - from here on they are known by their names
    import numpy_annealer  # noqa: F401
    import selection_instances  # noqa: F401
finally:
    sys.path.remove(_FOLDER)
