#!/usr/bin/env python3
"""The manual page and the shells' completions know every command and option that --help knows.

  help_documents_test.py DEEPUAV
"""
import re
import shutil
import subprocess
import sys
import unittest

DEEPUAV = None
COMMANDS = ("run", "live", "view", "eval", "map info", "map export", "match", "bench networks")


def call(*words, **options):
    return subprocess.run(words, capture_output=True, text=True, check=True, **options).stdout


def flags_of(command):
    return set(re.findall(r"(?<![\w-])--[a-z][a-z-]*", call(DEEPUAV, *command.split(), "--help")))


def completed(*words):
    """What bash offers for the last of the words."""
    script = call(DEEPUAV, "completion", "bash")
    words = ("deepuav", *words)
    quoted = " ".join(f"'{word}'" for word in words)
    ask = f"COMP_WORDS=({quoted}); COMP_CWORD={len(words) - 1}; _deepuav; printf '%s\\n' \"${{COMPREPLY[@]}}\""
    return call("bash", "-c", script + ask).split()


class HelpDocumentsTest(unittest.TestCase):
    def test_the_manual_knows_all(self):
        page = call(DEEPUAV, "manual")
        for command in COMMANDS:
            section = page.split(f"\n.SS deepuav {command}\n")[1].split("\n.SS ")[0].replace("\\-", "-")
            for flag in flags_of(command):
                self.assertIn(flag, section, command)

    def test_the_manual_is_a_page(self):
        if not shutil.which("man"):
            self.skipTest("no man")
        shown = subprocess.run(["man", "--warnings", "-l", "-"], input=call(DEEPUAV, "manual"), capture_output=True, text=True,
                               env={"PATH": "/usr/bin:/bin", "MANWIDTH": "120", "LC_ALL": "C.UTF-8"})
        self.assertEqual((shown.returncode, shown.stderr), (0, ""))
        self.assertIn("deepuav run MH_01_easy --out out/mh01", shown.stdout)

    def test_bash_completes(self):
        self.assertIn("run", completed(""))
        self.assertEqual(completed("si"), ["simulate"])
        self.assertEqual(set(completed("map", "")), {"info", "export", "merge", "-h", "--help"})
        self.assertEqual(completed("run", "scene", "--sch"), ["--schedule"])
        self.assertEqual(completed("run", "scene", "--schedule", "s"), ["sequential"])
        self.assertEqual(completed("run", "sce"), [], "files are the shell's own")
        for command in COMMANDS:
            self.assertLessEqual(flags_of(command), set(completed(*command.split(), "--")), command)

    def test_zsh_completes(self):
        script = call(DEEPUAV, "completion", "zsh")
        self.assertTrue(script.startswith("#compdef deepuav\n"))
        if not shutil.which("zsh"):
            self.skipTest("no zsh")
        call("zsh", "-n", input=script)
        stub = "compadd() { shift; print -l -- $@ }\n_files() { }\nwords=(deepuav run scene --schedule '') CURRENT=5\n"
        self.assertEqual(call("zsh", "-c", stub + "complete() {\n" + script + "}\ncomplete").split(),
                         ["sequential", "threaded", "live"])

    def test_an_unknown_shell_is_wrong_use(self):
        done = subprocess.run([DEEPUAV, "completion", "fish"], capture_output=True, text=True)
        self.assertEqual(done.returncode, 2)


if __name__ == "__main__":
    DEEPUAV = sys.argv[1]
    unittest.main(argv=sys.argv[:1] + sys.argv[2:])
