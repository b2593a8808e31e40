"""The program that a test file is given: called, or left to run; and the test file's own main."""
import os
import re
import subprocess
import sys
import time
import unittest
from pathlib import Path

SKIPPED = 77
FAILURE, WRONG_USE = 1, 2
TIMEOUT_S = 120

DEEPUAV = None


def command(*arguments):
    return [DEEPUAV, *map(os.fspath, arguments)]


class UnderWay:
    """The program as it goes on; what it says goes to a log."""

    def __init__(self, log, *arguments, **options):
        self.log = Path(log)
        with self.log.open("w") as stderr:
            self.process = subprocess.Popen(command(*arguments), stderr=stderr, **options)

    def text(self):
        return self.log.read_text()

    def wait_for(self, pattern, seconds=TIMEOUT_S):
        """Until the log holds it; gives the match."""
        end = time.monotonic() + seconds
        while not (found := re.search(pattern, self.text())):
            if self.process.poll() is not None or time.monotonic() > end:
                raise AssertionError(f"no {pattern!r} in:\n{self.text()}")
            time.sleep(0.05)
        return found

    def resident_mb(self):
        status = Path(f"/proc/{self.process.pid}/status").read_text()
        return int(re.search(r"VmRSS:\s+(\d+) kB", status)[1]) / 1024


def main(doc):
    """For a test file: its first argument is the program. Exits with 77 where what was skipped is all that did not pass."""
    global DEEPUAV  # pylint: disable=global-statement
    if len(sys.argv) < 2:
        sys.exit(doc)
    DEEPUAV = str(Path(sys.argv.pop(1)).resolve())
    program = unittest.main(module="__main__", exit=False)
    skipped = program.result.skipped
    if skipped:
        print(f"skipped: {skipped[0][1]}")
    sys.exit(1 if not program.result.wasSuccessful() else SKIPPED if skipped else 0)
