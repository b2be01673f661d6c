"""The two pictures of a planned frame, decoded and of one size."""

from __future__ import annotations

from drivers.ros.calibration import described
from drivers.ros.images import color_image, depth_image, fitted_depth
from drivers.ros.messages import Message
from drivers.ros.refusals import ImageReason, ImageRefused
from logs.frames.pairing import PlannedFrame
from logs.frames.reasons import FrameReason, SkipFrame
from openbelief.arrays import Array
from openbelief.observation import RgbdFrame

SAME_LENS = 0.02  # by how much the scaled focal lengths of colour and depth may differ


class FrameDecoder:
    """scaled: what a person should know of depth that was not of colour's size, though it could be used."""

    def __init__(self) -> None:
        self.scaled: set[str] = set()

    def frame(self, planned: PlannedFrame, color: Message, depth: Message, recording: str) -> RgbdFrame:
        """Raises SkipFrame. color, depth: messages, their pictures not decoded. recording: its id."""
        try:
            pixels, depth_m = color_image(color), depth_image(depth)
        except ImageRefused as refused:
            raise SkipFrame(refused.reason, str(refused)) from refused
        camera = planned.intrinsics
        if depth_m.shape != pixels.shape[:2]:
            depth_m = self._scaled_depth(planned, depth_m, pixels.shape[:2])
        if pixels.shape[:2] != (camera.height, camera.width):
            sizes = f"colour {_size(pixels)}, depth {_size(depth_m)}, {described(planned.info)}"
            raise SkipFrame(ImageReason.SIZES, f"Width and height differ: {sizes}.")
        return RgbdFrame(planned.index, planned.stamp_ns, pixels, depth_m, camera, planned.T_map_camera, recording)

    def _scaled_depth(self, planned: PlannedFrame, depth_m: Array, shape: tuple[int, int]) -> Array:
        """Depth of colour's view, resampled to colour's size by the nearest pixel. Raises SkipFrame."""
        (height, width), (h, w) = shape, depth_m.shape
        try:
            fitted = fitted_depth(depth_m, shape)
        except ImageRefused as refused:
            raise SkipFrame(refused.reason, f"{refused} It has {described(planned.info)}.") from refused
        own, colors = planned.depth_info, planned.intrinsics
        if own is not None and abs(own.fx / own.width * colors.width / colors.fx - 1) > SAME_LENS:
            sizes = f"Colour has {width}x{height} pixels, depth {w}x{h}"
            raise SkipFrame(FrameReason.NOT_ALIGNED, f"{sizes}, and their camera infos are of two lenses.")
        self.scaled.add(f"depth of {w}x{h} is scaled to colour's {width}x{height}")
        return fitted


def _size(pixels: Array) -> str:
    return f"{pixels.shape[1]}x{pixels.shape[0]}"
