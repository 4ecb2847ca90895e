"""Exports trained networks to the ONNX files that the landing system uses."""

from __future__ import annotations

import logging
import warnings

import torch
from torch import nn

from lab.train_detector.model import fused

OPSET = 18


def onnx_bytes(model: nn.Module, shape: tuple[int, ...]) -> bytes:
    """Return the content of an ONNX file with a network, for inputs of one shape."""
    # The exporter warns of optional packages and of its own deprecations.
    logging.getLogger("torch.onnx").setLevel(logging.ERROR)
    with warnings.catch_warnings(), torch.no_grad():
        warnings.simplefilter("ignore")
        program = torch.onnx.export(
            fused(model),
            (torch.zeros(shape),),
            dynamo=True,
            opset_version=OPSET,
            input_names=["image"],
            output_names=["answer"],
            verbose=False,
        )
    if program is None:
        raise RuntimeError("torch.onnx.export returned no program")
    for node in program.model.graph:
        # Remove references to the source files of this machine: the file is published.
        node.metadata_props.clear()
        node.doc_string = None
    content: bytes = program.model_proto.SerializeToString()
    return content
