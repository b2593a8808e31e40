#!/usr/bin/env python3
"""The "where is" table of docs/architecture.md: every file it names is there and holds every symbol it names."""
import re
import unittest

from include_graph_test import ARCHITECTURE, ROOT, table_rows

HEAD = "| question | file | symbols |"
FEWEST_QUESTIONS = 20


def names_in(cell):
    return re.findall(r"`([^`]+)`", cell)


def problems(rows, root):
    """One line for every file that is not there and every symbol that it does not hold."""
    for question, file_cell, symbol_cell in rows:
        files, symbols = names_in(file_cell), names_in(symbol_cell)
        if len(files) != 1 or not symbols:
            yield f"{question}: expected one file and a symbol or more"
            continue
        file = root / files[0]
        if not file.is_file():
            yield f"{question}: there is no {files[0]}"
            continue
        words = set(re.findall(r"\w+", file.read_text()))
        for symbol in symbols:
            if symbol not in words:
                yield f"{question}: {files[0]} holds no {symbol}"


class WhereIsTest(unittest.TestCase):
    def test_every_answer_is_true(self):
        rows = table_rows(ARCHITECTURE.read_text(), HEAD)
        self.assertGreaterEqual(len(rows), FEWEST_QUESTIONS)
        self.assertEqual(list(problems(rows, ROOT)), [])

    def test_it_notices_what_is_not_true(self):
        file = "`tests/where_is_test.py`"
        for row, part in ((["q", "`tests/absent.py`", "`x`"], "there is no tests/absent.py"),
                          (["q", file, "`Absent" + "Symbol`"], "holds no Absent" + "Symbol"),
                          (["q", file, ""], "expected one file"), (["q", "", "`problems`"], "expected one file")):
            found = list(problems([row], ROOT))
            self.assertEqual(len(found), 1, row)
            self.assertIn(part, found[0])
        self.assertEqual(list(problems([["q", file, "`problems`"]], ROOT)), [])


if __name__ == "__main__":
    unittest.main()
