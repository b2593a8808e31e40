"""Quantises a SuperPoint to int8 with NNCF, calibrated on training photographs alone.

    python -m deepuav_training.quantise models/superpoint_small.onnx --labels configs/labels.yaml \\
        --out superpoint_small_int8.onnx

Needs a virtual environment with requirements-quantise.txt. Convolutions become int8, those whose
names --keep-float describes stay as they are. What it costs, `evaluate` and `evaluate_poses` tell.
"""

import argparse
import copy
from pathlib import Path

import nncf
import numpy as np
import onnx

from deepuav_training.calibration import calibration_images
from deepuav_training.config import load_config
from deepuav_training.errors import telling_errors
from deepuav_training.label import LabelConfig
from deepuav_training.onnx_storage import expand, read_onnx


def quantise(model: onnx.ModelProto, images: list[np.ndarray], keep_float: list[str]
             ) -> onnx.ModelProto:
    """The model in int8; `keep_float` are regular expressions of names of nodes that stay."""
    name = model.graph.input[0].name
    ignored = nncf.IgnoredScope(patterns=keep_float, validate=True) if keep_float else None
    return nncf.quantize(copy.deepcopy(model), nncf.Dataset(images, lambda image: {name: image}),
                         preset=nncf.QuantizationPreset.MIXED, subset_size=len(images),
                         fast_bias_correction=True, ignored_scope=ignored)


@telling_errors
def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("model", type=Path, help="SuperPoint as ONNX")
    parser.add_argument("--labels", required=True, help="configuration that says which places are "
                        "held out")
    parser.add_argument("--out", type=Path, required=True, help="the ONNX file to write")
    parser.add_argument("--images", type=int, default=200, help="to calibrate on (%(default)s)")
    parser.add_argument("--width", type=int, default=640, help="of the images, px (%(default)s)")
    parser.add_argument("--height", type=int, default=480, help="of the images, px (%(default)s)")
    parser.add_argument("--keep-float", nargs="*", default=[], metavar="PATTERN",
                        help="regular expressions of nodes not to quantise")
    arguments = parser.parse_args()
    if arguments.width % 8 or arguments.height % 8:
        parser.error("--width and --height must be multiples of 8")
    model = expand(read_onnx(arguments.model))
    images = calibration_images(load_config(LabelConfig, arguments.labels), arguments.images,
                                arguments.width, arguments.height)
    quantised = quantise(model, images, arguments.keep_float)
    onnx.checker.check_model(quantised)
    arguments.out.parent.mkdir(parents=True, exist_ok=True)
    onnx.save(quantised, str(arguments.out))
    print(f"{arguments.out}: {arguments.out.stat().st_size / 1e6:.2f} MB")


if __name__ == "__main__":
    main()
