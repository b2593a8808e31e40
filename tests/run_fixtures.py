"""Two short datasets of a sequence and a run over one of them, for tests of `deepuav run`."""
import os
import re

import command_test_data as data
from command_fixtures import (CommandTest, OUTPUT_FILES, REPRODUCIBLE_FILES, SCRATCH, SEQUENCE, call, needs_shared,
                              run_arguments, summary_of)


@needs_shared
class RunTest(CommandTest):
    @classmethod
    def setUpClass(cls):
        frames = data.euroc_frames(SEQUENCE)
        cls.frames = frames[60:140:2]
        cls.flight = data.euroc_part(SCRATCH / "flight", SEQUENCE, cls.frames)
        cls.short_frames = frames[60:108:4]
        cls.short = data.euroc_part(SCRATCH / "short", SEQUENCE, cls.short_frames)
        cls.short_out = SCRATCH / "short-out"
        cls.short_result = call(*run_arguments(cls.short, cls.short_out))

    def check_whole(self, out):
        names = set(os.listdir(out)) if out.exists() else set()
        names = {name for name in names if not re.fullmatch(r"\.deepuav-\d+-\d+\.tmp", name)}
        self.assertLessEqual(names, OUTPUT_FILES)
        for name in names.intersection(REPRODUCIBLE_FILES):
            self.assertEqual((out / name).read_bytes(), (self.short_out / name).read_bytes(), f"{out}/{name}")
        if "summary.json" in names:
            self.assertEqual(summary_of(out)["frames"], summary_of(self.short_out)["frames"])
        if "timings.csv" in names:
            rows = [file.read_text().splitlines() for file in (out / "timings.csv", self.short_out / "timings.csv")]
            self.assertEqual(len(rows[0]), len(rows[1]))
