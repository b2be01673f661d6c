"""Opening a network: an ONNX file, the providers this machine has, bounded threads; a bad file is refused by name."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Mapping, Sequence
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

from openbelief.arrays import Array
from openbelief.perception.composed import BadModelOutput
from openbelief.perception.ports import PerceptionFailed
from openbelief.phrase import printable

if TYPE_CHECKING:
    import onnxruntime

# Fastest first. TensorRT is used only where it is asked for: it builds for minutes at the first run of every shape.
PROVIDERS = ("CUDAExecutionProvider", "CPUExecutionProvider")
TENSORRT = ("TensorrtExecutionProvider", *PROVIDERS)

Shape: TypeAlias = tuple[int | None, ...]  # None = any size
Provider: TypeAlias = str | tuple[str, Mapping[str, Any]]  # with options for it
DTYPES = {
    "tensor(float)": np.float32,
    "tensor(float16)": np.float16,
    "tensor(double)": np.float64,
    "tensor(int64)": np.int64,
    "tensor(int32)": np.int32,
    "tensor(uint8)": np.uint8,
    "tensor(bool)": np.bool_,
}
# onnxruntime 1.32 dies of it (SIGSEGV while opening) on a half-precision text encoder on the CPU. Leaving it out cost
# nothing measurable in single precision.
LEFT_OUT = ("MatmulTransposeFusion",)
NOT_MODELS = (
    (b"version https://git-lfs", "it is a Git LFS pointer, not the model: fetch the model itself"),
    (b"<", "it is a web page or an XML file, not a model: fetch the model again"),
)


class ModelFileError(PerceptionFailed):
    """A model file is missing, truncated, or another network than was asked for; the message names it."""


class OnnxModel:
    """A network that is ready to run. Threads may share it.

    inputs, outputs: the names that it must have, each with the shape that it must fit (None = any size; () = any
    shape). threads: of one run; by default one per core. Raises ModelFileError naming the file and the remedy.
    """

    def __init__(
        self,
        path: str | os.PathLike[str],
        *,
        inputs: Mapping[str, Shape] | None = None,
        outputs: Mapping[str, Shape] | None = None,
        providers: Sequence[Provider] = PROVIDERS,
        threads: int | None = None,
    ) -> None:
        self.path = Path(path)
        self._session = _opened(self.path, providers, threads)
        self.input_shapes = {node.name: _shape(node) for node in self._session.get_inputs()}
        self.output_shapes = {node.name: _shape(node) for node in self._session.get_outputs()}
        self._dtypes = {node.name: DTYPES.get(node.type) for node in self._session.get_inputs()}
        self._require(inputs or {}, self.input_shapes, "input")
        self._require(outputs or {}, self.output_shapes, "output")

    @cached_property
    def id(self) -> str:
        """The file's name and the start of its hash, weights beside it included."""
        return f"{self.path.name}@{content_hash(self.path)[:12]}"

    @property
    def providers(self) -> list[str]:
        """What really runs it, first choice first: a provider whose libraries are missing is not among them."""
        return list(self._session.get_providers())

    @property
    def metadata(self) -> dict[str, str]:
        """What its exporter wrote into the file."""
        return dict(self._session.get_modelmeta().custom_metadata_map)

    def dtype(self, name: str) -> Any:
        """The numpy type of an input."""
        return self._dtypes[name]

    def run(self, feeds: Mapping[str, Array], outputs: Sequence[str] | None = None) -> list[Array]:
        """The named outputs, or all in their order. Feeds are cast to what the network declares; half precision comes
        back as float32, so that nobody computes on in it.

        Raises BadModelOutput naming the file where the run itself fails.
        """
        typed = {name: np.asarray(array, dtype=self._dtypes[name]) for name, array in feeds.items()}
        try:
            return [_widened(array) for array in self._session.run(None if outputs is None else list(outputs), typed)]
        except _failures() as error:
            raise BadModelOutput(f"{self.path} failed while it ran: {printable(str(error), 300)}.") from error

    def _require(self, wanted: Mapping[str, Shape], there: Mapping[str, Shape], kind: str) -> None:
        for name, shape in wanted.items():
            if name not in there:
                raise ModelFileError(
                    f"{self.path} is another network than is asked for here: it should have an {kind} "
                    f"{name!r} and has {', '.join(map(repr, there))}."
                )
            if not _fits(there[name], shape):
                raise ModelFileError(
                    f"{self.path} is another network than is asked for here: its {kind} {name!r} should be "
                    f"{_text(shape)} and is {_text(there[name])}."
                )


def content_hash(path: Path) -> str:
    """sha256 of the file, followed by the weights that exporters put beside large models (NAME.data, NAME_data)."""
    digest = hashlib.sha256()
    for part in [path, *(path.with_name(path.name + suffix) for suffix in (".data", "_data"))]:
        if part.is_file():
            with part.open("rb") as file:
                while block := file.read(1 << 20):
                    digest.update(block)
    return digest.hexdigest()


def _opened(path: Path, providers: Sequence[Provider], threads: int | None) -> onnxruntime.InferenceSession:
    import onnxruntime

    _require_model_file(path)
    options = onnxruntime.SessionOptions()
    options.log_severity_level = 3  # errors; what is wrong with a file is said below
    options.intra_op_num_threads = threads or os.cpu_count() or 1
    # Idle threads of one network would otherwise take the cores from the next one's.
    options.add_session_config_entry("session.intra_op.allow_spinning", "0")
    available = onnxruntime.get_available_providers()
    usable = [each for each in providers if (each if isinstance(each, str) else each[0]) in available]
    try:
        return onnxruntime.InferenceSession(
            os.fspath(path), options, providers=usable or ["CPUExecutionProvider"], disabled_optimizers=LEFT_OUT
        )
    except _failures() as error:
        raise ModelFileError(
            f"{path} ({path.stat().st_size} bytes) cannot be opened as a network: {_reason(error, path)}. It is "
            "truncated or damaged, or weights that belong beside it are missing: fetch it again."
        ) from error


def _require_model_file(path: Path) -> None:
    try:
        with path.open("rb") as file:
            head = file.read(64)
    except OSError as error:
        raise ModelFileError(f"{path} cannot be read: {error.strerror}.") from error
    if not head:
        raise ModelFileError(f"{path} is empty: fetch it again.")
    for mark, words in NOT_MODELS:
        if head.startswith(mark):
            raise ModelFileError(f"{path} cannot be used: {words}.")


def _failures() -> tuple[type[Exception], ...]:
    """Every exception that onnxruntime raises; they have no common class."""
    from onnxruntime.capi import onnxruntime_pybind11_state as state

    kinds = (value for value in vars(state).values() if isinstance(value, type) and issubclass(value, Exception))
    return (*kinds, ValueError, RuntimeError)


def _widened(array: Array) -> Array:
    return array.astype(np.float32) if array.dtype == np.float16 else array


def _reason(error: Exception, path: Path) -> str:
    """onnxruntime's own words, without its code and the path."""
    return printable(str(error).rsplit(f"{path} failed:", maxsplit=1)[-1], 300).rstrip(".")


def _shape(node: Any) -> Shape:
    return tuple(size if isinstance(size, int) else None for size in node.shape)


def _fits(there: Shape, wanted: Shape) -> bool:
    if not wanted:
        return True
    return len(there) == len(wanted) and all(
        a is None or b is None or a == b for a, b in zip(there, wanted, strict=True)
    )


def _text(shape: Shape) -> str:
    return "[" + ", ".join("?" if size is None else str(size) for size in shape) + "]"
