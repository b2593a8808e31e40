"""Where rosbags is: tests of ROS bags are skipped where no Python has it; that of .venv/ does."""
import os
import subprocess
import sys
from pathlib import Path

from program_under_test import SKIPPED

ROOT = Path(__file__).resolve().parent.parent


def use_python_with_rosbags():
    """Goes on in an interpreter that has it."""
    for python in (Path(sys.executable), ROOT / ".venv/bin/python"):
        if python.exists() and subprocess.run([python, "-c", "import rosbags, numpy"], capture_output=True,
                                              check=False).returncode == 0:
            if python != Path(sys.executable):
                os.execv(python, [os.fspath(python), "-B", *sys.argv])
            return
    print("skipped: no Python has rosbags: scripts/test.sh makes one that has")
    sys.exit(SKIPPED)
