"""Networks of a convolution or so, as ONNX files, in place of learned ones."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import onnx
from onnx import TensorProto, helper, numpy_helper


def network(path: Path, inputs: Sequence[tuple[str, Sequence[Any]]], nodes: Sequence[Any], weights: Any = ()) -> Path:
    """Write a network with these inputs and nodes, the last of which gives ``out``."""
    given = [helper.make_tensor_value_info(name, TensorProto.FLOAT, shape) for name, shape in inputs]
    out = helper.make_tensor_value_info("out", TensorProto.FLOAT, None)
    graph = helper.make_graph(nodes, "small", given, [out], [numpy_helper.from_array(w, n) for n, w in weights])
    onnx.save(helper.make_model(graph, opset_imports=[helper.make_opsetid("", 17)], ir_version=8), path)
    return path


def convolution(path: Path, kernel: Any, shape: Sequence[Any] = ("b", "c", "y", "x")) -> Path:
    """A network of one convolution without padding: its output is smaller than its input."""
    node = helper.make_node("Conv", ["views", "kernel"], ["out"])
    return network(path, [("views", shape)], [node], [("kernel", np.asarray(kernel, np.float32))])
