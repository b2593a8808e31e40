"""Writes the tiny networks on which the tests of the SuperGlue matcher run, of which the tests know the answer.

    python tests/make_tiny_superglue.py src/deepuav/matching/testdata

Similarity 20 <d0, d1> - 5 |k0 - k1|^2, and its dual softmax times both scores. Needs `onnx`.
"""

import pathlib
import sys

import onnx
from onnx import TensorProto, helper

DIMENSION = 8
DESCRIPTOR_FACTOR = 20.0
DISTANCE_FACTOR = 5.0
MASKED = -1e4


def scalar(name, value):
    return helper.make_tensor(name, TensorProto.FLOAT, [], [value])


def axes(name, values):
    return helper.make_tensor(name, TensorProto.INT64, [len(values)], values)


def similarity_nodes():
    node = helper.make_node
    return [
        node("Transpose", ["descriptors1"], ["columns1"], perm=[0, 2, 1]),
        node("MatMul", ["descriptors0", "columns1"], ["cosine"]),
        node("Mul", ["cosine", "descriptor_factor"], ["appearance"]),
        node("Unsqueeze", ["keypoints0", "axis2"], ["rows"]),
        node("Unsqueeze", ["keypoints1", "axis1"], ["columns"]),
        node("Sub", ["rows", "columns"], ["offset"]),
        node("Mul", ["offset", "offset"], ["squared_offset"]),
        node("ReduceSum", ["squared_offset", "last_axis"], ["squared_distance"], keepdims=0),
        node("Mul", ["squared_distance", "distance_factor"], ["penalty"]),
        node("Sub", ["appearance", "penalty"], ["similarity"]),
    ]


def mask_nodes():
    """Takes the padding out of both softmaxes."""
    node = helper.make_node
    return [
        node("Unsqueeze", ["mask0", "axis2"], ["mask_rows"]),
        node("Unsqueeze", ["mask1", "axis1"], ["mask_columns"]),
        node("Mul", ["mask_rows", "mask_columns"], ["mask"]),
        node("Sub", ["one", "mask"], ["padding"]),
        node("Mul", ["padding", "masked"], ["offset_of_padding"]),
        node("Add", ["similarity", "offset_of_padding"], ["masked_similarity"]),
    ]


def assignment_nodes(similarity, output):
    node = helper.make_node
    return [
        node("Softmax", [similarity], ["over_rows"], axis=1),
        node("Softmax", [similarity], ["over_columns"], axis=2),
        node("Mul", ["over_rows", "over_columns"], ["dual_softmax"]),
        node("Unsqueeze", ["scores0", "axis2"], ["score_rows"]),
        node("Unsqueeze", ["scores1", "axis1"], ["score_columns"]),
        node("Mul", ["dual_softmax", "score_rows"], ["half_weighted"]),
        node("Mul", ["half_weighted", "score_columns"], [output]),
    ]


def inputs(masked):
    for side, count in (("0", "n"), ("1", "m")):
        yield helper.make_tensor_value_info("keypoints" + side, TensorProto.FLOAT, [1, count, 2])
        yield helper.make_tensor_value_info("scores" + side, TensorProto.FLOAT, [1, count])
        yield helper.make_tensor_value_info("descriptors" + side, TensorProto.FLOAT, [1, count, DIMENSION])
        if masked:
            yield helper.make_tensor_value_info("mask" + side, TensorProto.FLOAT, [1, count])


def network(masked):
    """Masked: with masks, and logarithms as the output."""
    constants = [
        scalar("descriptor_factor", DESCRIPTOR_FACTOR),
        scalar("distance_factor", DISTANCE_FACTOR),
        axes("axis1", [1]),
        axes("axis2", [2]),
        axes("last_axis", [3]),
    ]
    nodes = similarity_nodes()
    output = "log_assignment" if masked else "assignment"
    if masked:
        constants += [scalar("one", 1.0), scalar("masked", MASKED)]
        nodes += mask_nodes() + assignment_nodes("masked_similarity", "probability")
        nodes += [helper.make_node("Log", ["probability"], [output])]
    else:
        nodes += assignment_nodes("similarity", output)
    outputs = [helper.make_tensor_value_info(output, TensorProto.FLOAT, [1, "n", "m"])]
    graph = helper.make_graph(nodes, "tiny_superglue", list(inputs(masked)), outputs, constants)
    model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", 17)], ir_version=8)
    onnx.checker.check_model(model)
    return model


def main():
    folder = pathlib.Path(sys.argv[1])
    folder.mkdir(parents=True, exist_ok=True)
    onnx.save(network(masked=False), folder / "tiny_superglue.onnx")
    onnx.save(network(masked=True), folder / "tiny_superglue_masked.onnx")


if __name__ == "__main__":
    main()
