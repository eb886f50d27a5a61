"""The process of one job: `python -m tlsplan.batch.child PARENT WORD...` is `tlsplan WORD...`, and ends with its batch.

A batch that is killed can't end its jobs: the system does (Linux), so that they don't go on unseen.
"""

import sys

from planner_core.operating_system import end_with_parent

from ..main import main

if __name__ == "__main__":
    end_with_parent(int(sys.argv.pop(1)))
    main()
