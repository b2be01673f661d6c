"""A microphone's fake body below the driver: `sounddevice` as it is to the driver, fed by what a test says."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Any

from robot_app.voice.audio import read_wav

BLOCK = 512  # bytes


class PortAudioError(Exception):
    pass


class FakeSounddevice(ModuleType):
    """says: the files that the next listenings hear, in their order. device: the only name there is."""

    PortAudioError = PortAudioError

    def __init__(self, device: str = "headset") -> None:
        super().__init__("sounddevice")
        self.device, self.says, self.lost = device, [], False  # type: ignore[var-annotated]
        self.opened: list[dict[str, Any]] = []

    def RawInputStream(self, *, callback: Callable[..., None], device: str | None, **options: Any) -> Stream:
        if device is not None and device not in self.device:
            raise ValueError(f"No input device matching {device!r}")
        self.opened.append(options)
        return Stream(self, callback)


class Stream:
    def __init__(self, module: FakeSounddevice, callback: Callable[..., None]) -> None:
        self._module, self._callback = module, callback

    def start(self) -> None:
        sound = read_wav(Path(self._module.says.pop(0))).pcm16()
        for at in range(0, len(sound), BLOCK):
            self._callback(memoryview(sound[at : at + BLOCK]), BLOCK // 2, None, None)

    def stop(self) -> None:
        if self._module.lost:
            raise PortAudioError("Unanticipated host error [PaErrorCode -9999]:\n 'No such device'")

    def close(self) -> None: ...
