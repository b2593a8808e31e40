#!/usr/bin/env python3
"""Quantises a SuperPoint network to int8 with NNCF and says what accuracy it costs.

The network is calibrated on grey images drawn evenly from the sources that the image folder's MANIFEST.tsv names.
Convolutions become int8; those named by --keep-float stay as they are. Example:

    quantise_superpoint.py models/superpoint_coco.onnx --images images --out superpoint_int8.xml
"""

import argparse
import csv
import random
import sys
from pathlib import Path

import cv2
import nncf
import numpy as np
import openvino as ov

NOT_PHOTOGRAPHS = "dem/"


def images_by_source(folder: Path) -> dict[str, list[Path]]:
    """The 8-bit images of the folder by the repository that they come from, in the manifest's order."""
    manifest = folder / "MANIFEST.tsv"
    if not manifest.is_file():
        sys.exit(f"{manifest}: no such file: expected the image folder's table of sources")
    sources: dict[str, list[Path]] = {}
    with manifest.open(newline="") as table:
        for row in csv.DictReader(table, delimiter="\t"):
            if not row["file"].startswith(NOT_PHOTOGRAPHS):
                sources.setdefault(row["source_repo"], []).append(folder / row["file"])
    return sources


def draw_evenly(sources: dict[str, list[Path]], count: int, generator: random.Random) -> list[Path]:
    """`count` different images, one from each source in turn; fewer where there are no more."""
    shuffled = [generator.sample(files, len(files)) for _, files in sorted(sources.items())]
    drawn: list[Path] = []
    while len(drawn) < count and any(shuffled):
        for files in shuffled:
            if files and len(drawn) < count:
                drawn.append(files.pop())
    return drawn


def load(file: Path, height: int, width: int) -> np.ndarray:
    """The image as [1, 1, height, width] in 0..1: its centre, enlarged where it is too small."""
    image = cv2.imread(str(file), cv2.IMREAD_GRAYSCALE)
    if image is None:
        sys.exit(f"{file}: not an image that can be read")
    scale = max(height / image.shape[0], width / image.shape[1])
    if scale > 1:
        size = (max(width, round(image.shape[1] * scale)), max(height, round(image.shape[0] * scale)))
        image = cv2.resize(image, size, interpolation=cv2.INTER_LINEAR)
    top, left = (image.shape[0] - height) // 2, (image.shape[1] - width) // 2
    crop = image[top : top + height, left : left + width]
    return crop[None, None].astype(np.float32) / 255


def detections(logits: np.ndarray, count: int) -> np.ndarray:
    """The `count` pixels [y, x] of highest probability that are the maximum of their 9x9 neighbourhood."""
    exponentials = np.exp(logits[0] - logits[0].max(axis=0))
    probability = (exponentials / exponentials.sum(axis=0))[:-1]
    rows, columns = probability.shape[1:]
    heat_map = probability.reshape(8, 8, rows, columns).transpose(2, 0, 3, 1).reshape(8 * rows, 8 * columns)
    is_peak = heat_map == cv2.dilate(heat_map, np.ones((9, 9), np.uint8))
    order = np.argsort(-np.where(is_peak, heat_map, 0), axis=None, kind="stable")[:count]
    return np.stack(np.unravel_index(order, heat_map.shape), axis=1)


def repeated_share(first: np.ndarray, second: np.ndarray) -> float:
    """The share of the first points that have one of the second within one pixel."""
    distances = np.abs(first[:, None] - second[None]).max(axis=2)
    return float((distances.min(axis=1) <= 1).mean())


def compare(reference: ov.Model, quantised: ov.Model, images: list[np.ndarray], keypoints: int) -> dict[str, float]:
    """How well the quantised network gives what the reference gives, as means over the images."""
    core = ov.Core()
    exact = {"INFERENCE_PRECISION_HINT": "f32"}
    networks = [core.compile_model(model, "CPU", exact) for model in (reference, quantised)]
    shares, similarities = [], []
    for image in images:
        (logits, descriptors), (logits_int8, descriptors_int8) = (
            (outputs["logits"], outputs["descriptors"]) for outputs in (network(image) for network in networks)
        )
        shares.append(repeated_share(detections(logits, keypoints), detections(logits_int8, keypoints)))
        norms = np.linalg.norm(descriptors, axis=1) * np.linalg.norm(descriptors_int8, axis=1)
        similarities.append(float(((descriptors * descriptors_int8).sum(axis=1) / norms).mean()))
    return {
        "key points repeated within 1 px": float(np.mean(shares)),
        "mean cosine of descriptors": float(np.mean(similarities)),
    }


def parse_arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("model", type=Path, help="SuperPoint as ONNX, with outputs logits and descriptors")
    parser.add_argument("--images", type=Path, required=True, help="folder of images with MANIFEST.tsv")
    parser.add_argument("--out", type=Path, required=True, help="the .xml to write; its .bin lies beside it")
    parser.add_argument("--calibration", type=int, default=120, help="images to calibrate on (%(default)s)")
    parser.add_argument("--validation", type=int, default=24, help="other images to compare on (%(default)s)")
    parser.add_argument("--width", type=int, default=640, help="of the images, px (%(default)s)")
    parser.add_argument("--height", type=int, default=480, help="of the images, px (%(default)s)")
    parser.add_argument("--keypoints", type=int, default=500, help="compared in an image (%(default)s)")
    parser.add_argument("--seed", type=int, default=0, help="of the choice of images (%(default)s)")
    parser.add_argument(
        "--keep-float", nargs="*", default=[], metavar="PATTERN", help="regular expressions of nodes not to quantise"
    )
    arguments = parser.parse_args()
    if arguments.out.suffix != ".xml":
        parser.error(f"--out is {arguments.out}: expected a name that ends in .xml")
    if arguments.width % 8 or arguments.height % 8:
        parser.error("--width and --height must be multiples of 8")
    return arguments


def main() -> None:
    arguments = parse_arguments()
    model = ov.Core().read_model(arguments.model)
    drawn = draw_evenly(
        images_by_source(arguments.images), arguments.calibration + arguments.validation, random.Random(arguments.seed)
    )
    if len(drawn) <= arguments.calibration:
        sys.exit(f"{arguments.images}: {len(drawn)} images: expected more than {arguments.calibration}")
    images = [load(file, arguments.height, arguments.width) for file in drawn]
    calibration, validation = images[: arguments.calibration], images[arguments.calibration :]
    model.reshape([1, 1, arguments.height, arguments.width])

    quantised = nncf.quantize(
        model,
        nncf.Dataset(calibration),
        preset=nncf.QuantizationPreset.MIXED,
        subset_size=len(calibration),
        fast_bias_correction=True,
        ignored_scope=nncf.IgnoredScope(patterns=arguments.keep_float, validate=True) if arguments.keep_float else None,
    )
    for name, value in compare(model, quantised, validation, arguments.keypoints).items():
        print(f"{name}: {value:.4f}")
    quantised.reshape([1, 1, -1, -1])
    arguments.out.parent.mkdir(parents=True, exist_ok=True)
    ov.save_model(quantised, arguments.out, compress_to_fp16=False)


if __name__ == "__main__":
    main()
