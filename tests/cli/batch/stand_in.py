"""Stands in for the process of a job: what it does is the text of its scene file. `stand_in.py PARENT WORD...`

`plan`: writes a plan folder with the plan.json of $STAND_IN_PLAN. `crash`: as a library does. `refuse`: one line.
`wait`: tells its number, and works until it is ended. `pause`: plans, but takes a while.
"""

import os
import signal
import sys
import time
from pathlib import Path

from tlsplan.exit_codes import exit_code_of

from planner_core.operating_system import end_with_parent

end_with_parent(int(sys.argv[1]))
_, _, command, scene, *words = sys.argv
if words in (["lacks"], ["full"]):
    print("tlsplan: no OpenCL device" if words == ["lacks"] else "tlsplan: kein Platz", file=sys.stderr)
    sys.exit(6 if words == ["lacks"] else 9)
if command == "floors":
    print('{"floors": [{"id": "F0", "name": "Ground"}, {"id": "F1", "name": "Upper"}]}')
    sys.exit(0)
does = Path(scene).read_text()
print(f"scan: 1 of 9  process {os.getpid()}", file=sys.stderr, flush=True)
if does == "crash":
    os.kill(os.getpid(), signal.SIGSEGV)
elif does == "refuse":
    print(f"tlsplan: {scene}: no triangles, expected some; check the file", file=sys.stderr)
    sys.exit(3)
elif does == "wait":
    time.sleep(600)
elif does == "pause":
    time.sleep(1)
folder = Path(words[words.index("-o") + 1])
try:
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "words.txt").write_text("\n".join(words))
    (folder / "plan.json").write_bytes(Path(os.environ["STAND_IN_PLAN"]).read_bytes())
except OSError as error:  # told as the command tells it
    print(f"tlsplan: {folder}: can't be written ({error.strerror}), nothing was changed", file=sys.stderr)
    sys.exit(exit_code_of(error))
