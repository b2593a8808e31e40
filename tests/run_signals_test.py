#!/usr/bin/env python3
"""Runs that are ended: by signals, at any moment, or by another run; what they leave is whole.

  run_signals_test.py DEEPUAV

Exits with 77, which ctest shows as skipped, where there is no network or no sequence in $DEEPUAV_SHARED.
"""
import json
import os
import random
import re
import shutil
import signal
import subprocess
import time

from command_fixtures import ENVIRONMENT, call, run_arguments, summary_of
from program_under_test import command, main
from run_fixtures import RunTest


class RunEnded(RunTest):
    def stop_once_a_map_is_there(self, sent, schedule):
        process = subprocess.Popen(command(*run_arguments(self.flight, self.out, "--schedule", schedule)),
                                   stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=ENVIRONMENT)
        for line in process.stderr:
            if "map 0 starts" in line:
                break
        process.send_signal(sent)
        process.communicate(timeout=100)
        summary = self.check_output(self.out)
        self.assertTrue(summary["stopped_early"])
        self.assertLess(summary["frames"]["processed"], len(self.frames))
        self.assertGreater(summary["frames"]["located"], 0)
        return process.returncode

    def test_interrupted(self):
        self.assertEqual(self.stop_once_a_map_is_there(signal.SIGINT, "threaded"), 130)

    def test_terminated(self):
        self.assertEqual(self.stop_once_a_map_is_there(signal.SIGTERM, "sequential"), 143)

    def test_terminated_with_every_loop_at_its_longest(self):
        """All options that bound how often something is done, at their upper bounds: what a sequence runs through ends
        when asked to."""
        bounds = {option["name"]: re.fullmatch(r"\d+ to (\d+)", option["bounds"])
                  for option in json.loads(call("options", "--json").stdout)
                  if re.search(r"(iterations|rounds|samples|tries)$", option["name"])}
        self.assertGreater(len(bounds), 20)
        longest = [word for name, bound in bounds.items() for word in ("--set", f"{name}={bound[1]}")]
        statuses = []
        for delay_s in (0, 4, 10):
            process = subprocess.Popen(command(*run_arguments(self.flight, self.out, *longest)),
                                       stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True, env=ENVIRONMENT)
            self.addCleanup(process.kill)
            for line in process.stderr:
                if "map 0 starts" in line:
                    break
            time.sleep(delay_s)
            process.send_signal(signal.SIGTERM)
            process.communicate(timeout=25)  # 5 s for the end of the run, on a busy machine.
            statuses.append(process.returncode)
            self.check_output(self.out)
        self.assertTrue(set(statuses) <= {0, 143}, statuses)
        self.assertEqual(statuses[0], 143)

    def test_the_terminal_went_away(self):
        self.assertEqual(self.stop_once_a_map_is_there(signal.SIGHUP, "threaded"), 129)

    def test_interrupted_before_its_first_frame_it_leaves_an_earlier_run(self):
        shutil.copytree(self.short_out, self.out)
        for delay_s in (0.02, 0.05, 0.1, 0.15, 0.2, 0.3, 0.4):
            process = subprocess.Popen(command(*run_arguments(self.short, self.out)), stdout=subprocess.DEVNULL,
                                       stderr=subprocess.DEVNULL, env=ENVIRONMENT)
            time.sleep(delay_s)
            process.send_signal(signal.SIGINT)
            # 0: it was over before that.
            self.assertIn(process.wait(timeout=100), (130, -signal.SIGINT, 0), delay_s)
            self.assertGreater(summary_of(self.out)["frames"]["processed"], 0, delay_s)

    def test_what_nohup_started_goes_on(self):
        process = subprocess.Popen(["nohup", *command(*run_arguments(self.short, self.out))],
                                   stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE,
                                   text=True, env=ENVIRONMENT)
        for line in process.stderr:
            if "map 0 starts" in line:
                break
        process.send_signal(signal.SIGHUP)
        process.communicate(timeout=100)
        self.assertEqual(process.returncode, 0)
        self.assertFalse(self.check_output(self.out)["stopped_early"])

    def test_two_runs_at_once_into_one_folder_are_refused(self):
        first = subprocess.Popen(command(*run_arguments(self.flight, self.out)), stdout=subprocess.DEVNULL,
                                 stderr=subprocess.PIPE, text=True, env=ENVIRONMENT)
        for line in first.stderr:
            if "map 0 starts" in line:
                break
        self.expect_failure(call(*run_arguments(self.short, self.out)), "another deepuav is writing into it")
        first.kill()
        first.communicate()

    def test_killed_leaves_whole_files_or_none(self):
        generator = random.Random(1)
        for attempt in range(8):
            out = self.folder / f"out{attempt}"
            process = subprocess.Popen(command(*run_arguments(self.short, out)), stdout=subprocess.DEVNULL,
                                       stderr=subprocess.DEVNULL, env=ENVIRONMENT)
            if attempt < 6:
                self.wait_for_writing(process, out)
                time.sleep(generator.uniform(0, 0.03))
            else:
                time.sleep(generator.uniform(0.2, 1))
            process.kill()
            process.wait()
            self.check_whole(out)

    def wait_for_writing(self, process, out):
        probe = f".deepuav-{process.pid}-0.tmp"  # of the check that files can be made
        while process.poll() is None:
            if out.exists() and any(name != probe for name in os.listdir(out)):
                return
            time.sleep(0.0005)


if __name__ == "__main__":
    main(__doc__)
