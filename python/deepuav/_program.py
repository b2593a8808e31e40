"""The command line that comes with the package."""
import os
import sys
from pathlib import Path

PROGRAM = Path(__file__).resolve().parent / "bin" / "deepuav"


def main() -> None:
    """Becomes the program, with this one's arguments."""
    os.execv(PROGRAM, [os.fspath(PROGRAM), *sys.argv[1:]])
