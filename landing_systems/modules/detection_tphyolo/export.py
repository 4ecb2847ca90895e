"""From a trained network to the ONNX file that flies."""

from __future__ import annotations

import io
import logging
import warnings

import torch
from torch import nn

from landing_systems.modules.detection_tphyolo.decoding import NETWORK_SIZE
from landing_systems.modules.detection_tphyolo.model import fused

OPSET = 18


def onnx_bytes(model: nn.Module) -> bytes:
    """Return the network as ONNX, for one picture of the network's size at a time."""
    width, height = NETWORK_SIZE
    picture = torch.zeros(1, 3, height, width)
    # The exporter remarks on packages that it would like to have and on its own future.
    logging.getLogger("torch.onnx").setLevel(logging.ERROR)
    with warnings.catch_warnings(), torch.no_grad():
        warnings.simplefilter("ignore")
        program = torch.onnx.export(
            fused(model).to(memory_format=torch.contiguous_format),
            (picture,),
            dynamo=True,
            opset_version=OPSET,
            input_names=["image"],
            output_names=["cells"],
            verbose=False,
        )
    if program is None:
        raise RuntimeError("torch.onnx.export gave no program")
    for node in program.model.graph:
        # Traces of the exporter's source files have no place in a shipped file.
        node.metadata_props.clear()
        node.doc_string = None
    buffer = io.BytesIO()
    program.save(buffer)
    return buffer.getvalue()
