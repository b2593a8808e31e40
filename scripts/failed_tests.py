#!/usr/bin/env python3
"""Prints the last lines that each failed test of the last run of ctest printed.

  failed_tests.py BUILD_FOLDER
"""
import re
import sys
from pathlib import Path

LINES = 20


def main():
    log = Path(sys.argv[1]) / "Testing/Temporary/LastTest.log"
    if not log.exists():
        return
    for part in re.split(r"^\d+/\d+ Testing: ", log.read_text(errors="replace"), flags=re.MULTILINE)[1:]:
        name = part.splitlines()[0]
        output = part.split("Output:\n", 1)[-1]
        if not re.search(r"^Test Failed", output, re.MULTILINE):
            continue
        before_end = output.split("<end of output>")[0].rstrip().splitlines()
        print(f"--- {name}: the end of what it printed")
        print("\n".join(before_end[-LINES:]))


main()
