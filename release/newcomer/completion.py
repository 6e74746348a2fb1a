"""A shell that has read what `stickslip completion bash` prints asks, and is answered."""

import os
import subprocess
import sys
from pathlib import Path

STICKSLIP = str(Path(sys.executable).with_name("stickslip"))
script = subprocess.run([STICKSLIP, "completion", "bash"], capture_output=True, check=True).stdout
if b"_ARGCOMPLETE" not in script:
    sys.exit(f"bash would not ask: {script}")
line = "stickslip simu"
asked = {"_ARGCOMPLETE": "1", "COMP_LINE": line, "COMP_POINT": str(len(line)), "COMP_TYPE": "9"}
asked |= {"_ARGCOMPLETE_STDOUT_FILENAME": "answer"}
subprocess.run([STICKSLIP], env=os.environ | asked, check=True)
if Path("answer").read_text().split() != ["simulate"]:
    sys.exit(f"the answer to {line!r} is {Path('answer').read_text()!r}")
