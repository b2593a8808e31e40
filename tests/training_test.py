#!/usr/bin/env python3
"""The unit tests of training/, where its virtual environment is whole and of the present requirements
(scripts/test.sh --with-training makes it); skipped without."""
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
SKIPPED = 77
STUCK_S = 200  # A test that runs so long shows where it is, before ctest ends them all.

if __name__ == "__main__":
    python, stamp = (ROOT / ".venv-training" / name for name in ("bin/python", ".requirements.txt"))
    if not stamp.exists() or stamp.read_text() != (ROOT / "training/requirements.txt").read_text():
        print("skipped: no .venv-training of the present requirements; scripts/test.sh --with-training makes it")
        sys.exit(SKIPPED)
    command = [python, "-B", "-m", "pytest", "-q", "-p", "no:cacheprovider", "-o", f"faulthandler_timeout={STUCK_S}"]
    sys.exit(subprocess.run(command, cwd=ROOT / "training").returncode)
