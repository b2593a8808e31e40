#!/usr/bin/env python3
"""Other real surveys: the whole photographs of OpenDroneMap's sets that lie, reduced to 640 pixels and
without EXIF, among the training photographs. They are told nothing of the lens.

  bench/system/small_surveys.py [--only NAME ...] [--set name=value ...]

For each: photographs in the main map and in all maps, focal length and k1 found, those of COLMAP 3.8 (SIMPLE_RADIAL, 4,096
SIFT features, exhaustive matching, CPU), time and memory. `garfield` is a Sequoia's colour camera (rolling shutter, level ground,
506 px by its data sheet), `garfield_nir` a near-infrared one of it (530 px), `garfield_both` both in one folder. The table
goes to stdout as Markdown. Photographs are looked for in $DEEPUAV_SHARED/images (default ../shared); what is absent is skipped
and named. Needs build/deepuav and Python's standard library.
"""
import argparse
import csv
import json
import os
import shutil
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "bench/system"))
from surveys import run, table_row  # noqa: E402

# Name: source, what the names of its photographs hold, and COLMAP's photographs in its largest map, focal length, px, and k1.
SURVEYS = {
    "lewis": ("OpenDroneMap/odm_data_lewis", "", (52, 461.5, -0.040)),
    "seneca": ("OpenDroneMap/odm_data_seneca", "", (30, 454.1, -0.024)),
    "copr": ("OpenDroneMap/odm_data_copr", "", (19, 849.9, -0.135)),
    "boruszyn": ("merkato/odm_boruszyn_kap", "", (28, 524.3, -0.038)),
    "garfield": ("OpenDroneMap/odm_data_garfield_msp", "RGB", (24, 1543.9, -0.232)),
    "garfield_nir": ("OpenDroneMap/odm_data_garfield_msp", "NIR", (28, 553.6, -0.263)),
    "garfield_both": ("OpenDroneMap/odm_data_garfield_msp", "", None),
}


def whole_photographs(images, source, part):
    """The files of whole photographs, in the order of their original names."""
    with open(images / "MANIFEST.tsv", newline="") as stream:
        rows = [row for row in csv.DictReader(stream, delimiter="\t", quoting=csv.QUOTE_NONE)
                if row["source_repo"] == source and row["note"].startswith("full of") and part in row["original_path"]]
    return [images / row["file"] for row in sorted(rows, key=lambda row: row["original_path"])]


def measure(name, images, arguments):
    source, part, colmap = SURVEYS[name]
    photographs = whole_photographs(images, source, part)
    folder = arguments.out / name / "photographs"
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    for number, photograph in enumerate(photographs):
        (folder / f"{number:04}.jpg").symlink_to(photograph.resolve())
    result = run(name, folder, arguments.out / name, arguments)
    if "failure" not in result:
        summary = json.loads((Path(result["folder"]) / "summary.json").read_text())
        result["in_maps"] = " + ".join(str(size) for size in sorted((m["frames"] for m in summary["maps"]), reverse=True))
    if colmap:
        result.update(zip(("colmap_views", "colmap_focal_px", "colmap_k1"), colmap))
    return result


def row(result):
    return table_row(result, result["name"], ["{in_maps:s}", "{focal_px:.1f}", "{k1:.3f}", "{colmap_views:d}",
                                              "{colmap_focal_px:.1f}", "{colmap_k1:.3f}"])


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", nargs="*", default=list(SURVEYS), choices=list(SURVEYS))
    parser.add_argument("--set", nargs="*", default=[], help="options passed on to run, name=value")
    parser.add_argument("--out", type=Path, default=ROOT / "out/small_surveys")
    arguments = parser.parse_args()
    images = Path(os.environ.get("DEEPUAV_SHARED", ROOT / "../shared")) / "images"
    if not (images / "MANIFEST.tsv").is_file():
        print(f"skipped: no MANIFEST.tsv in {images}")
        return
    print("| survey | in the main map | maps | photographs of each | focal length, px | k1 | COLMAP: photographs | focal length, px "
          "| k1 | s | MB |\n|---|---|---|---|---|---|---|---|---|---|---|")
    for name in arguments.only:
        print(row(measure(name, images, arguments)), flush=True)


if __name__ == "__main__":
    main()
