#!/usr/bin/env python3
"""Surveys whose photographs are blurred, soft, noisy or dark: what the program makes of them, beside the same ones whole.

  .venv/bin/python bench/system/damaged_surveys.py FOLDER [--damages NAME ...] [--photographs N] [--set name=value ...]

| damage | what |
|---|---|
| whole | none |
| some | one in four is blurred by motion of 1.2 % of its width, in a direction of its own |
| all | each by 0.6 % |
| thermal, foggy, dark, wet, banded, compressed | as of bench/system/hard_cuts.py |
| noise | noise of 20 of 255 |
| uneven | the brightness of each is between 0.4 and 1.7 times itself |

FOLDER holds photographs, or is a simulated flight (bench/system/simulated_surveys.py keeps those it renders), and then its
truth is the measure; else the run of `whole` is. Of each: photographs in the main map, maps, focal length and k1, root mean
square error of the positions after Sim3, in % of the largest side of what the photographs were taken over, time and memory.
The photographs are grey and told nothing (no EXIF). Everything goes to OUT, the table to stdout as Markdown. Needs
build/deepuav and Pillow (in .venv after scripts/test.sh).
"""
import argparse
import shutil
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "bench/system"))
import damaged_images  # noqa: E402
from place_datasets import require_libraries  # noqa: E402
from surveys import evaluate, main_map, run, table_row, write_positions  # noqa: E402

SOME, SOME_BLUR, ALL_BLUR = 4, 0.012, 0.006
NOISE, DARKEST, BRIGHTEST = 20, 0.4, 1.7
SUFFIXES = (".jpg", ".jpeg", ".png")


def some(image, number):
    return damaged_images.blurred(image, SOME_BLUR * image.width, number) if number % SOME == SOME // 2 else image


def every(image, number):
    return damaged_images.blurred(image, ALL_BLUR * image.width, number)


def noise(image, number):
    return damaged_images.noisy(image, NOISE, number)


def uneven(image, number):
    factor = damaged_images.np.random.default_rng(number).uniform(DARKEST, BRIGHTEST)
    return image.point(lambda value: min(255, round(factor * value)))


DAMAGES = {"whole": lambda image, _number: image, "some": some, "all": every, "noise": noise, "uneven": uneven,
           **damaged_images.DAMAGES}


def photographs_in(folder):
    """Their files, and where each was taken where that is known."""
    truth = folder / "groundtruth_cam0.csv"
    if not truth.is_file():
        return sorted(file for file in folder.iterdir() if file.suffix.lower() in SUFFIXES), None
    places = {row[0]: tuple(map(float, row[1:4])) for row in map(lambda line: line.split(","), truth.read_text().split()[1:])
              if row[0].isdigit()}
    files = sorted((folder / "mav0/cam0/data").iterdir())
    return files, [places[file.stem] for file in files]


def write_damaged(photographs, damage, folder):
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    for number, photograph in enumerate(photographs):
        with damaged_images.Image.open(photograph) as image:
            DAMAGES[damage](image.convert("L"), number).save(folder / f"{number:04}.jpg", quality=92)


def error_share(places, truth, out):
    """In % of the largest side of the truth."""
    write_positions(out / "truth.txt", list(truth.items()))
    write_positions(out / "found.txt", list(places.items()))
    judged = evaluate(out / "truth.txt", out / "found.txt")
    sides = [max(axis) - min(axis) for axis in zip(*truth.values())]
    return 100 * judged["ate_m"]["rmse"] / max(sides) if judged else None


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--damages", nargs="*", default=list(DAMAGES), choices=DAMAGES)
    parser.add_argument("--photographs", type=int, help="the first ones alone")
    parser.add_argument("--set", nargs="*", default=[], help="options passed on to run, name=value")
    parser.add_argument("--out", type=Path, default=ROOT / "out/damaged_surveys")
    arguments = parser.parse_args()
    require_libraries(parser.prog)
    photographs, places = photographs_in(arguments.folder)
    photographs = photographs[:arguments.photographs]
    damages = arguments.damages if places or arguments.damages[:1] == ["whole"] else ["whole", *arguments.damages]
    truth = places and dict(enumerate(places[:arguments.photographs]))
    print("| | photographs in the main map | maps | focal length, px | k1 | error, % | s | MB |\n|---|---|---|---|---|---|---|---|")
    for damage in damages:
        out = arguments.out / damage
        shutil.rmtree(out, ignore_errors=True)
        write_damaged(photographs, damage, out / "photographs")
        result = run("run", out / "photographs", out, arguments)
        if "failure" in result and not truth:
            raise SystemExit(f"damaged_surveys.py: no measure: {result['failure']}")
        if "failure" not in result:
            found = main_map(Path(result["folder"]))
            result["error"] = error_share(found, truth, out) if truth else None
            truth = truth or found
        print(table_row(result, damage, ["{focal_px:.1f} ({focal_sigma_px:.1f})", "{k1:.3f}", "{error:.4f}"]), flush=True)


if __name__ == "__main__":
    main()
