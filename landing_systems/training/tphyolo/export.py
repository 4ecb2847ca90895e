"""From trained networks to the ONNX files that fly."""

from __future__ import annotations

import logging
import warnings

import torch
from torch import nn

from landing_systems.training.tphyolo.model import fused

OPSET = 18


def onnx_bytes(model: nn.Module, shape: tuple[int, ...]) -> bytes:
    """Return a network as ONNX, for inputs of one shape."""
    # The exporter remarks on packages that it would like to have and on its own future.
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
        raise RuntimeError("torch.onnx.export gave no program")
    for node in program.model.graph:
        # Traces of the exporter's source files have no place in a shipped file.
        node.metadata_props.clear()
        node.doc_string = None
    content: bytes = program.model_proto.SerializeToString()
    return content
