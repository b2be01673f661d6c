"""The RealSense driver against a simulated D435i inside the real librealsense: images/s, CPU, age, losses.

Aligned and filtered RGB-D at 30 Hz for each colour size. The camera process makes the simulated images too, so a real
camera costs it less. Fails where an image is lost.
"""

from __future__ import annotations

import argparse
import multiprocessing
import os
import time
from dataclasses import replace
from functools import partial
from pathlib import Path
from statistics import median
from typing import TYPE_CHECKING, Any

from robot_app import arguments
from robot_app.cli import Failure, print_json

if TYPE_CHECKING:
    from drivers.realsense.camera import RealSenseCamera

SETTLE_S, POLL_S = 3.0, 0.1


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--seconds", type=arguments.bench_seconds, default=20.0, help="how long each colour size runs (default 20)"
    )


def run(options: argparse.Namespace) -> None:
    from drivers.realsense.messages import COLOR_SIZES

    rows = [_measured(size, options.seconds) for size in COLOR_SIZES]
    if options.json:
        print_json({"seconds": options.seconds, "sizes": rows})
    else:
        print("\n".join(map(_line, rows)))
    if lost := sum(row["lost"] + row["no_slot"] for row in rows):
        raise Failure(f"{lost} images were lost: the machine is busy, or too slow for this size")


def _measured(size: tuple[int, int], seconds: float) -> dict[str, Any]:
    from drivers.clock import SystemClock
    from drivers.realsense.camera import RealSenseCamera
    from drivers.realsense.messages import RealSenseSettings
    from sim_fakes.sensors.realsense_bus import open_twin
    from sim_fakes.sensors.realsense_faults import TwinState
    from sim_fakes.sensors.realsense_software import COLOR_LENS, TwinSpec, box_images

    wider = size[0] / COLOR_LENS.width
    lens = replace(
        COLOR_LENS,
        width=size[0],
        height=size[1],
        fx=COLOR_LENS.fx * wider,
        fy=COLOR_LENS.fy * wider,
        cx=(size[0] - 1) / 2,
        cy=(size[1] - 1) / 2,
    )
    twin = partial(open_twin, box_images, TwinSpec(color=lens), TwinState())
    with RealSenseCamera(RealSenseSettings(color_size=size), SystemClock(), open_device=twin) as camera:
        return {"color_size": list(size), **_watched(camera, seconds)}


def _watched(camera: RealSenseCamera, seconds: float) -> dict[str, Any]:
    """What comes in that time, taken as a recorder would take it."""
    time.sleep(SETTLE_S)
    camera.take_frames()
    [pid] = [child.pid for child in multiprocessing.active_children() if child.name == "realsense"]
    before, camera_s, ours_s, begin_s = camera.health().counts, _cpu_s(pid), time.process_time(), time.monotonic()
    images, ages_s = 0, []
    while time.monotonic() - begin_s < seconds:
        time.sleep(POLL_S)
        now_ns, frames = time.time_ns(), camera.take_frames()
        images += len(frames)
        ages_s += [(now_ns - frame.stamp_ns) / 1e9 for frame in frames[-1:]]
    took_s, counts = time.monotonic() - begin_s, camera.health().counts
    return {
        "images_per_s": round(images / took_s, 1),
        "camera_cpu_share": round((_cpu_s(pid) - camera_s) / took_s, 3),
        "our_cpu_share": round((time.process_time() - ours_s) / took_s, 3),
        "newest_age_s": round(median(ages_s), 3) if ages_s else None,
        "lost": counts.lost - before.lost,
        "no_slot": counts.no_slot - before.no_slot,
    }


def _cpu_s(pid: int | None) -> float:
    """User and system time of a process so far (proc(5): stat, fields 14 and 15)."""
    fields = Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def _line(row: dict[str, Any]) -> str:
    width, height = row["color_size"]
    age = "no image came" if row["newest_age_s"] is None else f"newest {row['newest_age_s']:.3f} s old (median)"
    return (
        f"{width}x{height}: {row['images_per_s']:.1f} images/s, {age}; "
        f"camera process {row['camera_cpu_share']:.0%} of a core, ours {row['our_cpu_share']:.1%}; "
        f"lost: {row['lost']} by the camera, {row['no_slot']} without a slot"
    )
