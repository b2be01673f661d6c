"""A folder with an exported network: its ONNX files, its tokenizer, and model.json that says what they are.

`scripts/export` writes such folders. A missing, truncated or changed file is refused by name.
"""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

from openbelief.documents import from_json
from openbelief.perception.onnx_session import ModelFileError, OnnxModel, Provider

FORMAT = "openbelief.model/1"
MANIFEST = "model.json"
# What `device` asks for -> the execution provider that has to run the graph.
DEVICES = {
    "cpu": "CPUExecutionProvider",
    "cuda": "CUDAExecutionProvider",
    "tensorrt": "TensorrtExecutionProvider",  # builds an engine at the first run: minutes, then cached in the folder
}
PREFERRED = ("cuda", "cpu")


class ModelFolderError(RuntimeError):
    """The folder, one of its files or the device cannot be used; the message is one line naming it."""


@dataclass(frozen=True)
class ModelFolder:
    """kind: what the caller expects, "clip" or "sam3". device: a row of DEVICES, or "auto" (CUDA where it can run)."""

    path: Path
    kind: str
    device: str = "auto"

    @cached_property
    def about(self) -> dict[str, Any]:
        """model.json; raises ModelFolderError."""
        manifest = self.path / MANIFEST
        try:
            about = from_json(manifest.read_text(encoding="utf-8"))
        except FileNotFoundError:
            raise ModelFolderError(
                f"{manifest} is missing: make the folder with scripts/export (docs/perception.md)."
            ) from None
        except (OSError, ValueError) as error:
            raise ModelFolderError(f"{manifest} cannot be read: {error}") from error
        found = (about.get("format"), about.get("kind")) if isinstance(about, dict) else None
        if found != (FORMAT, self.kind):
            raise ModelFolderError(f"{manifest} should say {(FORMAT, self.kind)}, it says {found}.")
        return dict(about)

    @property
    def id(self) -> str:
        """Architecture, the hash of its weights, and their precision."""
        return f"{self.about['architecture']}@{self.about['weights_sha256'][:12]}-{self.about['precision']}"

    def file(self, name: str) -> Path:
        """The checked file; raises ModelFolderError where it is not the one that was exported."""
        path, expected = self.path / name, self.about["files"].get(name)
        if expected is None:
            raise ModelFolderError(f"{self.path / MANIFEST} names no file {name}; export the model again.")
        if not path.is_file():
            raise ModelFolderError(f"{path} is missing.")
        if (size := path.stat().st_size) != expected["bytes"]:
            raise ModelFolderError(f"{path} has {size} bytes instead of {expected['bytes']}: copy it again.")
        with path.open("rb") as file:
            if hashlib.file_digest(file, "sha256").hexdigest() != expected["sha256"]:
                raise ModelFolderError(
                    f"{path} is not the file that was exported (its SHA-256 differs): copy it again."
                )
        return path

    def network(self, name: str) -> OnnxModel:
        """NAME.onnx, its weights checked too, on the device; raises ModelFolderError."""
        import onnxruntime

        graph = self.file(f"{name}.onnx")
        if (weights := f"{name}.onnx.data") in self.about["files"]:
            self.file(weights)
        provider = DEVICES[self._device(onnxruntime.get_available_providers())]
        options = {"trt_engine_cache_enable": True, "trt_engine_cache_path": str(self.path / "tensorrt")}
        first: Provider = (provider, options) if provider == DEVICES["tensorrt"] else provider
        rest = [] if provider == DEVICES["cpu"] else [DEVICES["cpu"]]  # for what the device has no kernel for
        try:
            network = OnnxModel(graph, providers=[first, *rest])
        except ModelFileError as error:
            raise ModelFolderError(str(error)) from error
        if network.providers[0] != provider:  # onnxruntime falls back to the CPU with a log line only
            raise ModelFolderError(f"{graph} cannot run with {provider}: the driver or its libraries are missing.")
        return network

    def _device(self, available: list[str]) -> str:
        if self.device == "auto":
            return next(device for device in PREFERRED if DEVICES[device] in available)
        if self.device not in DEVICES:
            raise ModelFolderError(f"device should be auto or one of {', '.join(DEVICES)}, got {self.device!r}.")
        if DEVICES[self.device] not in available:
            raise ModelFolderError(
                f"device {self.device}: this onnxruntime has {', '.join(available)} only; "
                "install the build for your GPU (docs/perception.md)."
            )
        return self.device
