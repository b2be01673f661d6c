"""Real photographs for parity: those that scikit-image carries, and the kitchen recording where it is at hand."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import skimage

KITCHEN = Path(__file__).resolve().parents[2].parent / "shared" / "recordings" / "kitchen.mcap"
NAMES = ("astronaut.png", "chelsea.png", "coffee.png", "motorcycle_left.png", "rocket.jpg", "hubble_deep_field.jpg")


def photographs() -> dict[str, np.ndarray]:
    """Name -> (h, w, 3) uint8 RGB, of several sizes and aspect ratios."""
    folder = Path(skimage.__file__).parent / "data"
    found = {name: cv2.imread(str(folder / name))[..., ::-1] for name in NAMES}
    found["astronaut.png 1280x720"] = cv2.resize(found["astronaut.png"], (1280, 720))
    found["chelsea.png 200x150"] = cv2.resize(found["chelsea.png"], (200, 150))
    return {name: np.ascontiguousarray(color) for name, color in (found | kitchen()).items()}


def kitchen(stride: int = 25) -> dict[str, np.ndarray]:
    """Every `stride`-th colour image of the recording; {} and a line where it is missing."""
    if not KITCHEN.is_file():
        print(f"skipped: {KITCHEN.name} is not at hand")
        return {}
    from mcap.reader import make_reader
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS2_HUMBLE)
    with KITCHEN.open("rb") as file:
        messages = make_reader(file).iter_messages(topics=["/camera/color/image_raw/compressed"])
        images = [store.deserialize_cdr(m.data, "sensor_msgs/msg/CompressedImage").data for _, _, m in messages]
    return {
        f"kitchen.mcap {i}": cv2.imdecode(image, cv2.IMREAD_COLOR)[..., ::-1]
        for i, image in list(enumerate(images))[::stride]
    }
