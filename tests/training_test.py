#!/usr/bin/env python3
"""The unit tests of training/, where its virtual environment is (scripts/test.sh --with-training); skipped without."""
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
SKIPPED = 77

if __name__ == "__main__":
    python = ROOT / ".venv-training/bin/python"
    if not python.exists():
        print(f"skipped: no {python.relative_to(ROOT)}; scripts/test.sh --with-training makes it")
        sys.exit(SKIPPED)
    command = [python, "-B", "-m", "pytest", "-q", "-p", "no:cacheprovider"]
    sys.exit(subprocess.run(command, cwd=ROOT / "training").returncode)
