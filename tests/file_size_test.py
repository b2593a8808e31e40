#!/usr/bin/env python3
"""A file is one idea: none of the project's own is longer than MOST_LINES, and those over FEW_LINES are named, with their
reason, in docs/architecture.md."""
import subprocess
import unittest

from include_graph_test import ARCHITECTURE, ROOT, table_rows

HEAD = "| long file | why it is one idea |"
FEW_LINES, MOST_LINES = 300, 400
KINDS = {".cc", ".h", ".py", ".js", ".html", ".css", ".sh", ".cmake"}


def own_files():
    """Those under version control or, where there is none, as in an archive, all but what is built and hidden."""
    listed = subprocess.run(["git", "ls-files"], cwd=ROOT, capture_output=True, text=True, check=False)
    names = listed.stdout.splitlines() if listed.returncode == 0 else []
    files = [ROOT / name for name in names] or [
        file for folder in ("apps", "bench", "python", "scripts", "src", "tests", "training") for file in (ROOT / folder).rglob("*")]
    return [file for file in files if file.suffix in KINDS and file.is_file()]


def lines(file):
    return len(file.read_text().splitlines())


class FileSizeTest(unittest.TestCase):
    def test_long_files_have_their_reason(self):
        long = {str(file.relative_to(ROOT)): lines(file) for file in own_files() if lines(file) > FEW_LINES}
        self.assertEqual({name: count for name, count in long.items() if count > MOST_LINES}, {})
        reasons = {name.strip("`"): reason for name, reason in table_rows(ARCHITECTURE.read_text(), HEAD)}
        self.assertEqual(set(long), set(reasons))
        self.assertTrue(all(reasons.values()))

    def test_it_sees_the_files(self):
        self.assertGreater(len(own_files()), 500)


if __name__ == "__main__":
    unittest.main()
