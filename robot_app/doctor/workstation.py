"""The doctor's checks that need no robot: disk, memory, models, GPU, certificates."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from datetime import UTC, datetime

from logs.record.disk import DiskBudget, DiskRoom
from robot_app.app import mission_perception, mission_text_encoder
from robot_app.cli import Failure
from robot_app.config import Config
from robot_app.doctor.finding import Finding, Level

EXPIRY_WARN_DAYS = 14


def check_memory(config: Config, _now_ns: int) -> Iterator[Finding]:
    from openbelief.memory import ObjectMemory

    if config.memory is None:
        yield Finding("memory", Level.WARN, "none is named", 'say memory = "site.belief" (openbelief map makes one)')
        return
    try:
        memory = ObjectMemory.open(config.memory)
    except (OSError, ValueError) as error:
        yield Finding("memory", Level.FAIL, str(error), "name a file that openbelief map has finished")
        return
    yield Finding("memory", Level.OK, f"{len(memory.objects)} objects in {config.memory.name}")
    try:
        encoder = mission_text_encoder(config)
    except Failure as error:
        yield Finding("text encoder", Level.FAIL, str(error), "mend [perception] profile")
        return
    same = (encoder.id, encoder.dim) == (memory.text_encoder_id, memory.text_dim)
    said = f"{encoder.id} here, {memory.text_encoder_id} in the memory"
    yield Finding(
        "text encoder",
        Level.OK if same else Level.FAIL,
        said,
        "" if same else "take the perception profile that the memory was mapped with, or map again",
    )


def check_models(config: Config, _now_ns: int) -> Iterator[Finding]:
    """Opened as a mission would open them: files, sizes, and the model server where there is one."""
    try:
        mission_perception(config, mission_text_encoder(config))
    except Failure as error:
        yield Finding("perception", Level.FAIL, str(error), "mend [perception] profile, or what it names")
        return
    yield Finding("perception", Level.OK, config.perception.profile)


def check_gpu(config: Config, _now_ns: int) -> Iterator[Finding]:
    import onnxruntime

    if "CUDAExecutionProvider" in onnxruntime.get_available_providers():
        yield Finding("gpu", Level.OK, "onnxruntime can use CUDA")
    elif config.perception.profile.startswith("paper"):
        remedy = "install a GPU build of onnxruntime and its CUDA libraries, or expect seconds for every look"
        yield Finding("gpu", Level.WARN, "none that onnxruntime can use", remedy)
    else:
        yield Finding("gpu", Level.OK, f"none, and {config.perception.profile} needs none")


def check_disk(config: Config, _now_ns: int) -> Iterator[Finding]:
    folder = next(folder for folder in (config.trials, *config.trials.resolve().parents) if folder.is_dir())
    budget = DiskBudget(config.recording.warn_bytes, config.recording.stop_bytes)
    room, sentence = budget.room(folder)
    level = {DiskRoom.OK: Level.OK, DiskRoom.LOW: Level.WARN, DiskRoom.FULL: Level.FAIL}[room]
    yield Finding("disk", level, sentence, "" if room == DiskRoom.OK else f"make room on the disk of {folder}")


def check_certificates(config: Config, now_ns: int) -> Iterator[Finding]:
    """Readable, and valid now and for a while."""
    from cryptography import x509

    for path in (config.zenoh.ca, config.zenoh.certificate):
        if path is None or not config.ports.uses("ros"):
            continue
        try:
            end = x509.load_pem_x509_certificate(path.read_bytes()).not_valid_after_utc
        except (OSError, ValueError) as error:
            yield Finding(
                f"certificate {path.name}", Level.FAIL, str(error), "make its network's keys with openbelief certs"
            )
            continue
        days = (end - datetime.fromtimestamp(now_ns // 10**9, UTC)).days
        level = Level.FAIL if days < 0 else Level.WARN if days < EXPIRY_WARN_DAYS else Level.OK
        remedy = "" if level == Level.OK else "make new ones with openbelief certs, and copy them to every machine"
        yield Finding(f"certificate {path.name}", level, f"valid until {end:%Y-%m-%d}", remedy)


def check_voice(config: Config, _now_ns: int) -> Iterator[Finding]:
    """The recogniser that [voice] names can be opened; without the extra everything but voice works."""
    from robot_app.voice.recogniser import HOW_TO_ADD
    from robot_app.voice.recognisers import open_recogniser

    try:
        recogniser = open_recogniser(config.voice.recogniser, config.voice.language)
    except Failure as error:
        missing = str(error) == HOW_TO_ADD
        yield Finding("voice", Level.OK if missing else Level.FAIL, str(error), "" if missing else "mend [voice]")
        return
    yield Finding("voice", Level.OK, f"{recogniser.id} ({recogniser.language})")


WORKSTATION_CHECKS: tuple[Callable[[Config, int], Iterator[Finding]], ...] = (
    check_disk,
    check_memory,
    check_models,
    check_gpu,
    check_certificates,
    check_voice,
)
