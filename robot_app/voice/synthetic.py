"""Synthetic speech from espeak-ng or flite, as programs of their own: to speak back, and to test listening with."""

from __future__ import annotations

import shutil
import subprocess

from robot_app.voice.audio import AudioClip, AudioError, clip_of_wav

SPEAK_S = 20.0
HOW_TO_ADD = "sudo apt-get install {program}"
# program -> its command; "--" and "-t" keep a text from being read as an option.
COMMANDS = {
    "espeak-ng": ("espeak-ng", "--stdout", "-v", "{voice}", "-s", "{words_a_minute}", "--", "{text}"),
    "flite": (
        "flite",
        "-voice",
        "{voice}",
        "--setf",
        "duration_stretch={slow}",
        "-o",
        "/dev/stdout",
        "-t",
        "{text}",
    ),
}
USUAL = 175  # words a minute


def installed(program: str) -> bool:
    return shutil.which(program) is not None


def spoken(text: str, program: str = "espeak-ng", voice: str = "en", words_a_minute: int = USUAL) -> AudioClip:
    """The text as sound. Raises AudioError: the program is missing (with the apt line), or said nothing."""
    if not installed(program):
        raise AudioError(f"{program} is not installed: {HOW_TO_ADD.format(program=program)}")
    values = {
        "text": text,
        "voice": voice,
        "words_a_minute": words_a_minute,
        "slow": round(USUAL / words_a_minute, 3),
    }
    command = [part.format(**values) for part in COMMANDS[program]]
    try:
        made = subprocess.run(command, stdin=subprocess.DEVNULL, capture_output=True, timeout=SPEAK_S, check=True)
    except (subprocess.SubprocessError, OSError) as error:
        raise AudioError(f"{program} could not speak: {error}") from error
    return clip_of_wav(_with_length(made.stdout), program)


def _with_length(wav: bytes) -> bytes:
    """A WAV file written to a pipe does not know its length (espeak-ng says 2 GB): told from what came."""
    at = wav.find(b"data", 12)
    if at < 0:
        return wav
    size = len(wav) - at - 8
    return wav[:4] + (len(wav) - 8).to_bytes(4, "little") + wav[8 : at + 4] + size.to_bytes(4, "little") + wav[at + 8 :]
