#!/usr/bin/env python3
"""What an autopilot receives of a live run: rate, jitter, jumps, times, covariances, clock.

  autopilot_bench.py DEEPUAV DATASET [--seconds 600] [--map MAP] [--grow]

Without --map one is made of the dataset first, with its IMU; where that gives no metres the map is taken as if it had them.
With --grow the run goes on mapping, so that loops and adjustments count.
"""
import argparse
import json
import os
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "tests"), str(ROOT / ".deps/pymavlink")]
import autopilot_test


def metric_map(arguments, folder):
    if arguments.map:
        return Path(arguments.map)
    out = folder / "first"
    subprocess.run([arguments.deepuav, "run", arguments.dataset, "--out", out, "--log-level", "off"], check=True,
                   stdout=subprocess.DEVNULL)
    kinds = [one["gauge"]["kind"] for one in json.loads((out / "summary.json").read_text())["maps"]]
    print(f"a map of {arguments.dataset}: {', '.join(kinds)}")
    if "free" not in kinds:
        return out / "map.deepuav"
    return autopilot_test.with_gauge(out / "map.deepuav", folder / "metric.deepuav", autopilot_test.METRIC)


def share(values, part):
    return sorted(values)[min(int(part * len(values)), len(values) - 1)]


def describe(autopilot, began):
    odometry = [one for one in autopilot.of("ODOMETRY") if one[0] >= began]
    if len(odometry) < 2:
        print(f"no odometry; texts: {autopilot.texts()}")
        return 1
    arrivals = [arrived for arrived, _, _ in odometry]
    gaps_ms = [1e3 * (b - a) for a, b in zip(arrivals, arrivals[1:])]
    times = [message.time_usec for _, _, message in odometry]
    ages_ms = [1e-6 * clock_ns - 1e-3 * message.time_usec for _, clock_ns, message in odometry]
    per_second = {}
    for arrived in arrivals[1:-1]:
        per_second[int(arrived)] = per_second.get(int(arrived), 0) + 1
    counts = [per_second.get(second, 0) for second in range(int(arrivals[0]) + 1, int(arrivals[-1]))]
    (steps, counted), (jumps, _) = (autopilot_test.uncounted_jumps(odometry, limit_m) for limit_m in (0.1, 0.3))
    finite = sum(all(abs(v) < 1e30 for v in (*m.pose_covariance, *m.velocity_covariance)) for _, _, m in odometry)
    seconds = arrivals[-1] - arrivals[0]
    print(f"{len(odometry)} ODOMETRY in {seconds:.0f} s: {(len(odometry) - 1) / seconds:.1f} Hz; in a second {min(counts)} to "
          f"{max(counts)}, 1 % of the seconds at most {share(counts, 0.01)}")
    print(f"interval: median {share(gaps_ms, 0.5):.1f} ms, 1 to 99 % {share(gaps_ms, 0.01):.1f} to {share(gaps_ms, 0.99):.1f} ms, "
          f"longest {max(gaps_ms):.0f} ms")
    print(f"times that do not grow: {sum(a >= b for a, b in zip(times, times[1:]))}; age when received on the autopilot's clock: "
          f"median {share(ages_ms, 0.5):.2f} ms, 99 % {share(ages_ms, 0.99):.2f} ms")
    print(f"reset_counter rose {counted} times; jumps beyond 0.3 m that it did not count: {jumps}; steps beyond 0.1 m: {steps}")
    print(f"covariances finite: {finite} of {len(odometry)}; position's sigma, median "
          f"{1e3 * share([m.pose_covariance[0] ** 0.5 for _, _, m in odometry], 0.5):.1f} mm; quality {min(m.quality for _, _, m in odometry)} "
          f"to {max(m.quality for _, _, m in odometry)}")
    print(f"heartbeats: {len([one for one in autopilot.of('HEARTBEAT') if one[0] >= began])}; texts: {autopilot.texts()}")
    return 0


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("deepuav", type=os.path.abspath)
    parser.add_argument("dataset")
    parser.add_argument("--seconds", type=float, default=600)
    parser.add_argument("--map")
    parser.add_argument("--grow", action="store_true")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="deepuav-autopilot-bench-") as folder:
        folder = Path(folder)
        world = metric_map(arguments, folder)
        autopilot = autopilot_test.Autopilot()
        program = subprocess.Popen(
            [arguments.deepuav, "live", arguments.dataset, "--loop", "--out", folder / "out", "--save-every", "0", "--map", world,
             "--mavlink", autopilot.address, "--log-level", "error", *([] if arguments.grow else ["--localise-only"])],
            stdout=subprocess.DEVNULL)
        try:
            autopilot.wait("ODOMETRY", 1)
            began = time.monotonic()
            time.sleep(arguments.seconds)
        finally:
            program.send_signal(signal.SIGINT)
            program.wait()
        status = describe(autopilot, began)
        frames = json.loads((folder / "out/summary.json").read_text())["frames"]
        print(f"images: {frames['images']}, {frames['skipped_late']} overtaken")
        autopilot.close()
        return status


if __name__ == "__main__":
    sys.exit(main())
