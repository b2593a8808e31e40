#!/usr/bin/env python3
"""A live run over a long time: a camera on the network shows a flight again and again, and its link drops now and then.
Tells how memory, maps and latency were. Its images are JPEGs made of the dataset's.

  soak.py DEEPUAV DATASET CAMERA_YAML [--minutes 60] [--reconnects 20] [--rate 20] [--out FOLDER] [--set NAME=VALUE ...]
"""
import argparse
import io
import os
import signal
import statistics
import sys
import tempfile
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "tests"))
import live_test
import program_under_test

AWAY_S = 3  # How long a dropped link stays away.
QUALITY = 95
SAMPLE_S = 5
RECORDS_FULL_MIN = 12  # The bounded records of frames are full after 8 min at 20 images a second, later where some are left out.


def pictures(dataset):
    """The dataset's images as JPEGs."""
    try:
        from PIL import Image  # here, as --help needs none
    except ModuleNotFoundError:
        raise SystemExit("soak.py: no module PIL: expected Pillow, as in .venv after scripts/test.sh") from None
    files = sorted((Path(dataset) / "mav0/cam0/data").iterdir())
    for file in files:
        jpeg = io.BytesIO()
        Image.open(file).save(jpeg, "jpeg", quality=QUALITY)
        yield jpeg.getvalue()


def fly(arguments, images, out):
    """Resident MB over the run, and the run."""
    camera = live_test.Camera()
    camera.show(images)
    settings = [word for setting in arguments.set for word in ("--set", setting)]
    live = live_test.Live(camera.address, out, "--camera", arguments.camera, "--timeout", "1", *settings)
    began, dropped, memory = time.monotonic(), 0, []
    while (passed_min := (time.monotonic() - began) / 60) < arguments.minutes and live.process.poll() is None:
        time.sleep(SAMPLE_S)
        memory.append((passed_min, live.resident_mb()))
        if passed_min > (dropped + 1) * arguments.minutes / (arguments.reconnects + 1):
            dropped += 1
            camera.show([], refuses=True)
            time.sleep(AWAY_S)
            camera.show(images)
    status, _ = live.end(signal.SIGINT)
    camera.close()
    return memory, live, status


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("deepuav", type=os.path.abspath)
    parser.add_argument("dataset", help="in EuRoC's layout")
    parser.add_argument("camera", help="its camera.yaml (docs/datasets.md)")
    parser.add_argument("--minutes", type=float, default=60)
    parser.add_argument("--reconnects", type=int, default=20)
    parser.add_argument("--rate", type=float, default=20, help="images a second")
    parser.add_argument("--out", type=Path, help="keeps the run; otherwise it is removed")
    parser.add_argument("--set", action="append", default=[], help="an option of the run, as of `deepuav live`")
    arguments = parser.parse_args()
    program_under_test.DEEPUAV, live_test.RATE_HZ = arguments.deepuav, arguments.rate
    with tempfile.TemporaryDirectory(prefix="deepuav-soak-") as folder:
        memory, live, status = fly(arguments, list(pictures(arguments.dataset)), arguments.out or Path(folder) / "out")
        summary = live.summary()
        told, frames = summary["live"], summary["frames"]
        print(f"{summary['wall_s'] / 60:.1f} minutes, exit {status} (130: by SIGINT); {told['arrived']} images, "
              f"{frames['skipped_late']} left out; pose after {told['median_latency_ms']:.0f} ms "
              f"(95 %: {told['p95_latency_ms']:.0f} ms)")
        print(f"{told['reconnects']} reconnects, {len(summary['maps'])} maps of "
              f"{', '.join(str(one['keyframes']) for one in summary['maps'])} keyframes, "
              f"{summary['relocalisations']} times found again")
        later = [mb for minute, mb in memory if minute >= min(RECORDS_FULL_MIN, arguments.minutes / 2)]
        tenth = max(1, len(later) // 10)
        first, last = statistics.median(later[:tenth]), statistics.median(later[-tenth:])
        print(f"memory once the records are full {first:.0f} MB, in the end {last:.0f} MB ({100 * (last / first - 1):+.1f} %)")
        print("  MB: " + " ".join(f"{mb:.0f}" for _, mb in memory[::max(1, len(memory) // 20)]))


if __name__ == "__main__":
    main()
