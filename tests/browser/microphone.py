"""Chromium's fake microphone: each time a page opens it, it plays the file from its beginning, once."""

from __future__ import annotations

import shutil
from pathlib import Path

from playwright.sync_api import Browser, Playwright

from robot_app.voice.audio import AudioClip

AFTER_S = 0.4  # a person lets go of the button a moment after the last word
# Every sound that the page plays, while the talk button is not held and while it is.
SOUNDS = """
window.sounds = [];
const start = AudioBufferSourceNode.prototype.start;
AudioBufferSourceNode.prototype.start = function () {
  const samples = this.buffer.getChannelData(0), sound = {seconds: this.buffer.duration, began: performance.now()};
  sound.peak = samples.reduce((most, each) => Math.max(most, Math.abs(each)), 0);
  sound.listening = document.getElementById("talk").textContent === "Listening";
  this.addEventListener("ended", () => { sound.lasted = (performance.now() - sound.began) / 1000; });
  window.sounds.push(sound);
  return start.call(this);
};
"""


class Microphone:
    """What is said into it is chosen before the talk button is pressed."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self.seconds = 0.0

    def open(self, playwright: Playwright, chromium: str) -> Browser:
        arguments = ["--no-sandbox", "--use-fake-device-for-media-stream", "--use-fake-ui-for-media-stream"]
        arguments.append(f"--use-file-for-fake-audio-capture={self._path}%noloop")
        return playwright.chromium.launch(executable_path=chromium, args=arguments)

    def hears(self, sound: Path | AudioClip) -> None:
        from robot_app.voice.audio import read_wav

        clip = read_wav(sound) if isinstance(sound, Path) else sound
        self._path.write_bytes(clip.wav())
        self.seconds = clip.seconds


def chromium_here() -> str:
    path = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
    assert path, "no chromium here: apt-get install chromium"
    return path
