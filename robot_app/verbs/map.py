"""Build a memory from a recording: colour, depth, camera_info and /tf, in MCAP, a rosbag2 folder, .db3 or ROS 1 .bag.

Perception is played back (recorded:FILE.jsonl), simulated (scripted:SCENE.json), done by small networks on a CPU
(detector:FOLDER) or by the paper's (paper[:PROFILE.toml]); see docs/perception.md. Without --perception,
WALK.perception.jsonl beside WALK.mcap is used. A mapping that was interrupted goes on where it stopped when the same
command is given again. Images that cannot be used are skipped, counted and named.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

from robot_app import arguments
from robot_app.cli import Failure, print_json
from robot_app.perceptions import FORMS, text_encoder_of
from robot_app.room_files import FORM, read_rooms

if TYPE_CHECKING:
    from logs.frames.reader import ReadOptions
    from openbelief.parameters import Parameters

# Two masks of one thing (points that overlap by tau_g, of one noun) on the kitchen recording: 42 % of the pairs have a
# cosine of MobileNetV2's features of 0.85, 75 % one of 0.75; of two nouns 17 % and 27 %. 60 nodes become 44.
MOBILENET_TAU_V = 0.75
EXAMPLE = "openbelief map demo-out/walk.mcap --perception scripted:flat -o flat.belief"


SEVERAL = "where several could be meant"
# names of an option -> what argparse is told of it
OPTIONS: dict[str, dict[str, Any]] = {
    "recordings": {
        "nargs": "+",
        "type": Path,
        "metavar": "WALK.mcap",
        "help": "recordings in one map frame: files, or folders that ros2 bag record made",
    },
    "-o --out": {"required": True, "type": Path, "metavar": "SITE.belief", "help": "the memory to write"},
    "--perception": {
        "action": "append",
        "type": arguments.perception,
        "metavar": "KIND:ARGUMENT",
        "help": f"{FORMS}; once, or once for each recording",
    },
    "--rooms": {"type": Path, "metavar": "ROOMS.json", "help": f"where things stand: {FORM}"},
    "--stride": {"type": arguments.from_one, "default": 1, "metavar": "N", "help": "use every Nth frame (default 1)"},
    "--jobs": {
        "type": arguments.from_one,
        "metavar": "N",
        "help": "frames acquired at once (default: as many as there are cores, fewer for a short walk)",
    },
    "--parameters": {"type": Path, "metavar": "FILE.toml", "help": "parameters unlike the paper's defaults"},
    "--color-topic": {"metavar": "TOPIC", "help": SEVERAL},
    "--depth-topic": {"metavar": "TOPIC", "help": SEVERAL},
    "--camera-info-topic": {"metavar": "TOPIC", "help": SEVERAL},
    "--map-frame": {"default": "map", "metavar": "FRAME", "help": "the frame of the memory (default map)"},
    "--pair-tolerance-s": {
        "type": arguments.seconds,
        "metavar": "S",
        "help": "how far depth may be from its colour image in time (default 0.005)",
    },
    "--depth-offset-s": {
        "type": arguments.signed_seconds,
        "metavar": "S",
        "help": "by how much the depth camera's stamps are late (default 0; with a minus sign: --depth-offset-s=-0.02)",
    },
    "--max-tf-gap-s": {
        "type": arguments.seconds,
        "metavar": "S",
        "help": "the longest time between two transforms that is interpolated (default 0.25)",
    },
    "--depth-is-aligned": {
        "action": "store_true",
        "help": "depth is aligned to colour, whatever its frame_id says",
    },
    "--force": {"action": "store_true", "help": "replace SITE.belief where it exists"},
}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    for names, told in OPTIONS.items():
        parser.add_argument(*names.split(), **told)


def run(options: argparse.Namespace) -> int:
    from robot_app.mapping.job import MapJob
    from robot_app.mapping.report import report_of, text_of
    from robot_app.mapping.run import require_recordings, run_map
    from robot_app.outputs import require_replaceable
    from robot_app.progress import progress

    require_recordings(options.recordings)
    job = MapJob(
        recordings=options.recordings,
        out=options.out,
        perceptions=options.perception or [_beside(path) for path in options.recordings],
        parameters=_parameters(options.parameters, options.perception or []),
        read=_read_options(options),
        force=options.force,
        rooms=read_rooms(options.rooms) if options.rooms else (),
        jobs=options.jobs,
    )
    if job.force:
        read = [*job.recordings, *(Path(spec.partition(":")[2]) for spec in job.perceptions)]
        require_replaceable(job.out, [*read, *filter(None, (options.rooms, options.parameters))])
    if not job.out.parent.is_dir():
        raise Failure(f"The folder {job.out.parent} does not exist: create it, or choose another -o.")
    with progress() as shown:
        result = run_map(job, text_encoder_of(job.perceptions[0]), shown)
    report = report_of(options.out, result)
    if options.json:
        print_json(report)
    else:
        print(text_of(report))
    return 0


def _read_options(options: argparse.Namespace) -> ReadOptions:
    from logs.frames.reader import ReadOptions, RecordingTopics

    asked = {name: getattr(options, name) for name in ("pair_tolerance_s", "depth_offset_s", "max_tf_gap_s")}
    return ReadOptions(
        topics=RecordingTopics(options.color_topic, options.depth_topic, options.camera_info_topic),
        map_frame=options.map_frame,
        stride=options.stride,
        depth_is_aligned=options.depth_is_aligned,
        **{name: value for name, value in asked.items() if value is not None},
    )


def _beside(recording: Path) -> str:
    """The recorded perception that lies beside a recording; raises Failure where there is none."""
    plain = recording.with_suffix("") if recording.suffix in (".zstd", ".zst") else recording
    path = plain.with_suffix(".perception.jsonl")
    if not path.is_file():
        raise Failure(f"{path} does not exist: say who looks at the frames with --perception {FORMS}.")
    return f"recorded:{path}"


def _parameters(path: Path | None, perceptions: list[str]) -> Parameters:
    """tau_v is of the feature space: what the file does not say is that of the perception's own features."""
    from openbelief.documents import from_toml
    from openbelief.parameters import Parameters

    own = {"tau_v": MOBILENET_TAU_V} if perceptions and all(p.startswith("detector:") for p in perceptions) else {}
    if path is None:
        return Parameters.from_dict(own)
    try:
        return Parameters.from_dict(own | from_toml(path.read_text(encoding="utf-8")))
    except (OSError, ValueError, TypeError) as error:
        raise Failure(f"--parameters {path}: {error}") from error
