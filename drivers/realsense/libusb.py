"""libusb before Open3D or librealsense: both need it at import, and a slim system has none."""

from __future__ import annotations

import ctypes


def ensure_libusb() -> None:
    """Call before importing open3d or pyrealsense2. The system's library where there is one, else the wheel's."""
    try:
        ctypes.CDLL("libusb-1.0.so.0", mode=ctypes.RTLD_GLOBAL)
    except OSError:
        import libusb_package

        ctypes.CDLL(str(libusb_package.get_library_path()), mode=ctypes.RTLD_GLOBAL)
