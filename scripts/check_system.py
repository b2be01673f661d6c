"""Say, in one apt line, which system libraries the pinned wheels miss here (open3d links several)."""

from __future__ import annotations

import ctypes
import sys

APT_PACKAGE = {
    "libGL.so.1": "libgl1",
    "libEGL.so.1": "libegl1",
    "libX11.so.6": "libx11-6",
    "libudev.so.1": "libudev1",
    "libidn2.so.0": "libidn2-0",
    "libgomp.so.1": "libgomp1",
}


def missing_libraries() -> list[str]:
    missing = []
    for library in APT_PACKAGE:
        try:
            ctypes.CDLL(library)
        except OSError:
            missing.append(library)
    return missing


def main() -> int:
    """--packages: only the names of the packages to install, for a script that may."""
    missing = missing_libraries()
    packages = " ".join(sorted(APT_PACKAGE[library] for library in missing))
    if "--packages" in sys.argv:
        print(packages)
        return 0
    if not missing:
        return 0
    print(
        f"Missing system libraries: {', '.join(missing)}. Mend it with:\n    sudo apt-get install -y {packages}",
        file=sys.stderr,
    )
    return 1


if __name__ == "__main__":
    sys.exit(main())
