#!/usr/bin/env python3
"""What a live run costs and how late it is, without a page and with one that clients watch: images left out, time from an
image's arrival to its pose, processor time, memory, messages a client gets.

  live_bench.py DEEPUAV DATASET [--seconds 60] [--clients 3] [--memory]
"""
import argparse
import json
import os
import sys
import tempfile
import threading
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "tests"))
import program_under_test
import view_test

FIRST_S = 1  # Not judged.
WARM_UP_S = 5


class Watcher(threading.Thread):
    """A client that takes all it is sent."""

    def __init__(self, program):
        super().__init__(daemon=True)
        self.program, self.counts = program, {}

    def run(self):
        client, _ = self.program.handshake()
        began = time.monotonic()
        try:
            while True:
                kind, _ = view_test.message(client)
                self.counts[kind] = self.counts.get(kind, 0) + 1
                self.seconds = time.monotonic() - began
        except OSError:
            pass


def processor_s(pid):
    fields = Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def server_s(pid):
    """Processor time of the page's server: the one thread of low priority."""
    total = 0
    for task in Path(f"/proc/{pid}/task").iterdir():
        fields = (task / "stat").read_text().rsplit(")", 1)[1].split()
        if int(fields[16]) > 0:
            total += int(fields[11]) + int(fields[12])
    return total / os.sysconf("SC_CLK_TCK")


def skipped_after(out, first_s):
    """Images that were overtaken after the first seconds: gaps in the numbers of the frames."""
    rows = [row.split(",")[:2] for row in (out / "frames.csv").read_text().splitlines()[1:]]
    frames = [(int(number), int(time_ns)) for number, time_ns in rows]
    later = [number for number, time_ns in frames if time_ns >= frames[0][1] + first_s * 1e9]
    return later[-1] - later[0] + 1 - len(later)


def measure(arguments, clients):
    with tempfile.TemporaryDirectory(prefix="deepuav-live-bench-") as folder:
        out = Path(folder) / "out"
        program_under_test.DEEPUAV = arguments.deepuav
        # The page is served in any case, so that the program says when it begins; without clients it does nothing.
        program = view_test.Program(Path(folder) / "log", "live", arguments.dataset, "--loop", "--out", out, "--view",
                                    "--port", "0", "--log-level", "off")
        watchers = [Watcher(program) for _ in range(clients)]
        for watcher in watchers:
            watcher.start()
        time.sleep(WARM_UP_S)
        before, began, memory = processor_s(program.process.pid), time.monotonic(), []
        server_before = server_s(program.process.pid)
        while time.monotonic() - began < arguments.seconds:
            time.sleep(1)
            memory.append(program.resident_mb())
        load = (processor_s(program.process.pid) - before) / (time.monotonic() - began)
        server_load = (server_s(program.process.pid) - server_before) / (time.monotonic() - began)
        alive_s = time.monotonic() - began + WARM_UP_S
        program.stop()
        summary = json.loads((out / "summary.json").read_text())
        live, frames = summary["live"], summary["frames"]
        cost_s = load * alive_s / frames["processed"]
        print(f"{clients} clients: {frames['images']} images, {frames['skipped_late'] + live['late']} left out, "
              f"{skipped_after(out, FIRST_S)} of them after the first second; pose after "
              f"{live['median_latency_ms']:.0f} ms (95 %: {live['p95_latency_ms']:.0f} ms); {load:.2f} cores, "
              f"{1e3 * cost_s:.1f} ms of processor time a frame; "
              f"{memory[0]:.0f} to {memory[-1]:.0f} MB; {len(summary['maps'])} maps, {summary['relocalisations']} times found again")
        print(f"  the page's server: {100 * server_load / load:.1f} % of the processor time")
        for watcher in watchers:
            print("  a client: " + ", ".join(f"{count / watcher.seconds:.1f} {kind}" for kind, count in
                                            sorted(watcher.counts.items())) + " a second")
        if arguments.memory:
            step = max(1, len(memory) // 12)
            print("  MB: " + " ".join(f"{value:.0f}" for value in memory[::step]))
        return cost_s


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("deepuav", type=os.path.abspath)
    parser.add_argument("dataset")
    parser.add_argument("--seconds", type=float, default=60)
    parser.add_argument("--clients", type=int, default=3)
    parser.add_argument("--memory", action="store_true")
    arguments = parser.parse_args()
    alone = measure(arguments, 0)
    if arguments.clients:
        print(f"the page costs {100 * (measure(arguments, arguments.clients) / alone - 1):+.1f} % processor time a frame")


if __name__ == "__main__":
    main()
