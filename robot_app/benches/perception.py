"""SAM 3 and CLIP on this machine: frames/s and memory of every stage, for each image size.

What decoding, the vision-language model and back-projection take is not in it. Random pixels do: the networks' work
does not depend on what they see.
"""

from __future__ import annotations

import argparse
import os
import resource
import shutil
import subprocess
import time
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from robot_app.cli import Failure, print_json

if TYPE_CHECKING:
    from openbelief.arrays import Array

PHRASES = ("chair", "table", "door", "lamp", "cup", "screen", "cabinet", "plant")
MASKS = 12  # crops per frame: two for each, and the frame
COLUMNS = ("size", "stage", "ms", "per_s", "host_mib", "gpu_mib")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--sam3", type=Path, help="a folder that scripts/export/sam3.py wrote")
    parser.add_argument("--clip", type=Path, help="a folder that scripts/export/clip.py wrote")
    parser.add_argument("--device", default="auto", choices=("auto", "cuda", "tensorrt", "cpu"))
    parser.add_argument("--sizes", nargs="+", type=_size, default=[(640, 480), (1280, 720)], metavar="WxH")
    parser.add_argument("--repeat", type=int, default=10, help="runs of each stage; the median counts (default 10)")


def run(options: argparse.Namespace) -> None:
    from openbelief.perception.model_folder import ModelFolderError

    if not options.sam3 and not options.clip:
        raise Failure("name a folder: --sam3 DIR, --clip DIR or both")
    try:
        rows = [row for size in options.sizes for row in _measure(size, options)]
    except ModelFolderError as error:
        raise Failure(str(error)) from error
    if options.json:
        print_json({"device": options.device, "phrases": len(PHRASES), "masks": MASKS, "stages": rows})
    else:
        print(
            "\n".join(
                "  ".join(f"{row[column]!s:>22}" for column in COLUMNS)
                for row in [dict(zip(COLUMNS, COLUMNS, strict=True)), *rows]
            )
        )


def _measure(size: tuple[int, int], options: argparse.Namespace) -> list[dict[str, Any]]:
    import numpy as np

    width, height = size
    color = np.random.default_rng(0).integers(0, 256, (height, width, 3), dtype=np.uint8)
    stages = (_sam3_stages(options, color) if options.sam3 else {}) | (
        _clip_stages(options, color) if options.clip else {}
    )
    return [
        {"size": f"{width}x{height}", "stage": name, **_timed(stage, options.repeat)} for name, stage in stages.items()
    ]


def _sam3_stages(options: argparse.Namespace, color: Array) -> dict[str, Callable[[], object]]:
    from openbelief.perception.sam3 import Sam3Segmenter

    sam3 = Sam3Segmenter(options.sam3, device=options.device)
    return {
        "SAM 3 image": lambda: sam3.encode_image(color),
        f"SAM 3 {len(PHRASES)} prompts": lambda: sam3.encode_prompts(PHRASES),
        "SAM 3 whole": lambda: sam3.instances(color, PHRASES),
    }


def _clip_stages(options: argparse.Namespace, color: Array) -> dict[str, Callable[[], object]]:
    from openbelief.perception.clip import Clip

    images = Clip(options.clip, device=options.device).images
    half = color[: color.shape[0] // 2, : color.shape[1] // 2]
    return {f"CLIP frame, {2 * MASKS} crops": lambda: images.encode([color, *[half] * (2 * MASKS)])}


def _timed(stage: Callable[[], object], repeat: int) -> dict[str, Any]:
    """Median time after one run to warm up; the process's largest memory so far."""
    stage()
    seconds = sorted(_seconds(stage) for _ in range(repeat))[repeat // 2]
    host_mib = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    return {
        "ms": round(1e3 * seconds, 1),
        "per_s": round(1 / seconds, 2),
        "host_mib": round(host_mib),
        "gpu_mib": _gpu_mib(),
    }


def _seconds(stage: Callable[[], object]) -> float:
    start = time.perf_counter()
    stage()
    return time.perf_counter() - start


def _gpu_mib() -> int | None:
    """What the driver says that this process holds; None without a GPU."""
    if not shutil.which("nvidia-smi"):
        return None
    command = ["nvidia-smi", "--query-compute-apps=pid,used_memory", "--format=csv,noheader,nounits"]
    lines = subprocess.run(command, capture_output=True, text=True, timeout=10, check=False).stdout.splitlines()
    held = [int(memory) for pid, memory in (line.split(",") for line in lines) if int(pid) == os.getpid()]
    return sum(held) if held else None


def _size(text: str) -> tuple[int, int]:
    width, _, height = text.partition("x")
    if not (width.isdecimal() and height.isdecimal() and int(width) > 0 and int(height) > 0):
        raise argparse.ArgumentTypeError(f"a size should be WIDTHxHEIGHT, such as 640x480, got '{text}'")
    return int(width), int(height)
