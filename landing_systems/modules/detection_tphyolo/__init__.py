"""The learned marker detector of TPHYolo-MLS and MM-MLS.

It is built after TPH-YOLOv5 (Zhu, Lyu, Wang and Zhao 2021, "TPH-YOLOv5: Improved YOLOv5 Based
on Transformer Prediction Heads for Object Detection on Drone-captured Scenarios") from that
paper's description; no code of it is used.

Reproduced, much smaller (265 thousand numbers instead of some 60 million): a YOLOv5-like
backbone of residual blocks; a transformer encoder at the end of the backbone and in the heads
of the coarse scales; the additional head at stride 4 for small objects, four heads in all;
CBAM before the heads; a neck that mixes the scales upwards and downwards; CIoU, objectness and
class losses; non-maximum suppression.

Not reproduced: anchor boxes (one prediction per cell, free of anchors); SPP, mosaic, mix-up,
ensembles of models, tests at several scales and the additional classifier; transformer blocks
and CBAM at stride 4, which the time that a frame may take forbids; multiplication of class and
objectness without calibration (a confidence here is a probability, see ``calibration.py``).

To fly needs ``detector.py``, ``decoding.py`` and ``weights.py``, hence OpenCV and NumPy.  To
train needs PyTorch, onnx and the simulator's renderer: see ``train.py``.
"""
