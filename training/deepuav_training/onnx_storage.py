"""How networks lie in ONNX files: large weights in 16 bits, and which values are whose parameter."""

import copy
import json
from typing import TYPE_CHECKING

import numpy as np
import onnx
from onnx import TensorProto, helper, numpy_helper

from deepuav_training.errors import TrainingError

if TYPE_CHECKING:  # quantisation runs where there is no torch
    from torch import nn

_STORED = "_16"  # ending of the names of what is stored in 16 bits
LEAST_VALUES = 1024  # of a tensor that is worth it
_DESCRIPTORS = "descriptors"  # SuperPoint's output
_NOTE = "parameters"  # key of the file's metadata


def halve(model: onnx.ModelProto) -> onnx.ModelProto:
    """The model with its large constants in 16 bits, which it converts to 32 when it is loaded."""
    model = copy.deepcopy(model)
    casts = []
    for tensor in model.graph.initializer:
        if tensor.data_type != TensorProto.FLOAT or np.prod(tensor.dims) < LEAST_VALUES:
            continue
        name, values = tensor.name, numpy_helper.to_array(tensor).astype(np.float16)
        tensor.CopyFrom(numpy_helper.from_array(values, name + _STORED))
        casts.append(helper.make_node("Cast", [name + _STORED], [name], to=TensorProto.FLOAT))
    nodes = casts + list(model.graph.node)
    del model.graph.node[:]
    model.graph.node.extend(nodes)
    return model


def expand(model: onnx.ModelProto) -> onnx.ModelProto:
    """The model with all its constants in 32 bits: what `halve` took, but for the rounding."""
    model = copy.deepcopy(model)
    stored = {tensor.name: tensor for tensor in model.graph.initializer
              if tensor.name.endswith(_STORED) and tensor.data_type == TensorProto.FLOAT16}
    nodes = []
    for node in model.graph.node:
        if node.op_type != "Cast" or node.input[0] not in stored:
            nodes.append(node)
            continue
        tensor = stored[node.input[0]]
        values = numpy_helper.to_array(tensor).astype(np.float32)
        tensor.CopyFrom(numpy_helper.from_array(values, node.output[0]))
    del model.graph.node[:]
    model.graph.node.extend(nodes)
    return model


def without_norm(model: onnx.ModelProto) -> onnx.ModelProto:
    """The model without the division that ends in `descriptors`, which the program does cheaper.

    A model that ends otherwise stays as it is.
    """
    model = copy.deepcopy(model)
    graph = model.graph
    makers = {name: node for node in graph.node for name in node.output}
    division = makers.get(_DESCRIPTORS)
    if division is None or division.op_type != "Div":
        return model
    raw = division.input[0]
    graph.node.remove(division)
    makers[raw].output[list(makers[raw].output).index(raw)] = _DESCRIPTORS
    for node in graph.node:
        for i, name in enumerate(node.input):
            if name == raw:
                node.input[i] = _DESCRIPTORS
    _remove_unused(graph)
    return model


def _remove_unused(graph: onnx.GraphProto) -> None:
    """Takes out nodes of which nothing goes on, until none is left."""
    while True:
        used = {name for node in graph.node for name in node.input}
        used |= {output.name for output in graph.output}
        unused = [node for node in graph.node if used.isdisjoint(node.output)]
        if not unused:
            break
        for node in unused:
            graph.node.remove(node)
    kept = [tensor for tensor in graph.initializer if tensor.name in used]
    del graph.initializer[:]
    graph.initializer.extend(kept)


def constants(model: onnx.ModelProto) -> dict[str, np.ndarray]:
    """The model's constants by name, in 32 bits; those that are equal are kept once by export."""
    graph = expand(model).graph
    values = {tensor.name: numpy_helper.to_array(tensor) for tensor in graph.initializer}
    for node in graph.node:
        if node.op_type == "Identity" and node.input[0] in values:
            values[node.output[0]] = values[node.input[0]]
    return values


def note_parameters(model: onnx.ModelProto, network: "nn.Module") -> None:
    """Writes into the model's metadata which constant is which parameter, or its transpose.

    Raises:
        TrainingError: the model has no constant that equals a parameter.
    """
    values, note = constants(model), {}
    for name, parameter in network.state_dict().items():
        wanted = parameter.detach().numpy()
        found = [(constant, turned) for constant, value in values.items() for turned in (0, 1)
                 if np.array_equal(value.T if turned else value, wanted)]
        if not found:
            raise TrainingError(f"{name}: found no constant of these values in the exported file")
        note[name] = found[0]
    helper.set_model_props(model, {_NOTE: json.dumps(note)})


def noted_parameters(model: onnx.ModelProto, where: str) -> dict[str, np.ndarray]:
    """The parameters that `note_parameters` noted, by name."""
    notes = [entry.value for entry in model.metadata_props if entry.key == _NOTE]
    if not notes:
        raise TrainingError(f"{where}: found no note of its parameters, expected an exported network")
    values = constants(model)
    return {name: (values[constant].T if turned else values[constant]).copy()
            for name, (constant, turned) in json.loads(notes[0]).items()}


def read_onnx(path: object) -> onnx.ModelProto:
    """Reads an ONNX file; raises TrainingError where it is none."""
    try:
        return onnx.load(str(path))
    except Exception as error:  # protobuf's own class of error is not public
        raise TrainingError(f"{path}: found no ONNX file: {error}") from error
