"""The learned marker detector of TPHYolo-MLS and MM-MLS.

It is built after TPH-YOLOv5 (Zhu, Lyu, Wang and Zhao 2021, "TPH-YOLOv5: Improved YOLOv5 Based
on Transformer Prediction Head for Object Detection on Drone-captured Scenarios") from that
paper's description; no code of it is used.

Reproduced, a hundred times smaller: a YOLOv5-like backbone of residual blocks; a transformer
encoder at the end of the backbone and in the heads of the coarse scales; the additional head at
stride 4 for small objects, four heads in all; CBAM before the heads; a neck that mixes the scales
upwards and downwards; CIoU and objectness losses; non-maximum suppression; and the second stage,
a classifier that is trained on cut-outs of the objects.

Different: that classifier alone tells ids apart.  Class logits in the heads, as TPH-YOLOv5 has
them, were tried first and stayed at chance after 1,750 steps: which of 4 codes of 25 bits, turned
by any angle, is too much for a cell of so small a network.  The classifier sees cut-outs at the
one scale that the altimeter tells.  Frames from low down are shrunk likewise.

Not reproduced: anchor boxes (one prediction per cell, free of anchors); SPP, mosaic, mix-up;
ensembles and tests at several scales; transformer blocks and CBAM at stride 4, which the time
that a frame may take forbids.  A confidence is a calibrated probability (``calibration.py``).

To fly needs ``detector.py``, ``decoding.py``, ``patches.py`` and ``weights.py``, hence OpenCV and
NumPy.  To train needs PyTorch, onnx and the simulator's renderer: see ``train.py``.
"""
