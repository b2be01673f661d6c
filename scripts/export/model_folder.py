"""What both exports share: a network to ONNX, and model.json with the size and hash of every file."""

from __future__ import annotations

import hashlib
import json
import logging
import warnings
from pathlib import Path
from typing import Any

import onnx
import torch
from onnxruntime.transformers import float16
from torch import Tensor, nn

FORMAT = "openbelief.model/1"
EXTERNAL_FROM_BYTES = 1 << 30  # a protobuf holds 2 GB at most
IN_FLOAT32 = ("LayerNormalization", "ReduceMean", "ReduceL2")  # sums over a whole row


def to_onnx(
    network: nn.Module, inputs: dict[str, Tensor], outputs: list[str], path: Path, *, batched: tuple[str, ...] = ()
) -> None:
    """`network(*inputs)` to `path`; the first axis of the inputs named in `batched` may have any length."""
    warnings.filterwarnings("ignore", message="# The axis name")
    logging.getLogger("torch.onnx").setLevel(logging.ERROR)
    n = torch.export.Dim("n", min=1, max=4096)
    large = sum(p.numel() * p.element_size() for p in network.parameters()) > EXTERNAL_FROM_BYTES
    torch.onnx.export(
        network.eval(),
        tuple(inputs.values()),
        path,
        input_names=list(inputs),
        output_names=outputs,
        dynamic_shapes=tuple({0: n} if name in batched else None for name in inputs),
        dynamo=True,
        external_data=large,
        verbose=False,
    )
    without_traces(path)


def without_traces(path: Path) -> None:
    """The exporter writes a Python stack trace into every node: megabytes, and this machine's paths."""
    model = onnx.load(path, load_external_data=False)
    for node in [*model.graph.node, *(node for function in model.functions for node in function.node)]:
        del node.metadata_props[:]
        node.doc_string = ""
    for value in [*model.graph.value_info, *model.graph.input, *model.graph.output, *model.graph.initializer]:
        del value.metadata_props[:]
        value.doc_string = ""
    del model.graph.value_info[:]
    onnx.save(model, path)


def halve(path: Path) -> None:
    """float32 to float16 in place; inputs, outputs and IN_FLOAT32 stay as they are."""
    model = float16.convert_float_to_float16(
        str(path), keep_io_types=True, op_block_list=[*float16.DEFAULT_OP_BLOCK_LIST, *IN_FLOAT32]
    )
    for left in (path, path.with_name(f"{path.name}.data")):
        left.unlink(missing_ok=True)
    del model.graph.value_info[:]
    save(model, path)


def save(model: onnx.ModelProto, path: Path) -> None:
    """Weights beside it where a protobuf cannot hold them."""
    large = model.ByteSize() > EXTERNAL_FROM_BYTES
    onnx.save(model, path, save_as_external_data=large, location=f"{path.name}.data")


def weights_sha256(network: nn.Module) -> str:
    """Of the weights alone: the same whatever exporter wrote the graph around them."""
    digest = hashlib.sha256()
    for name, value in sorted(network.state_dict().items()):
        digest.update(f"{name} {value.dtype} {tuple(value.shape)}".encode())
        digest.update(value.detach().cpu().contiguous().view(-1).view(torch.uint8).numpy().tobytes())
    return digest.hexdigest()


def finish(folder: Path, **about: Any) -> None:
    """Write model.json for what lies in the folder."""
    files = {path.name: described(path) for path in sorted(folder.iterdir()) if path.name != "model.json"}
    text = json.dumps({"format": FORMAT, **about, "files": files}, indent=1, ensure_ascii=False)
    (folder / "model.json").write_text(text + "\n", encoding="utf-8")


def described(path: Path) -> dict[str, Any]:
    with path.open("rb") as file:
        return {"bytes": path.stat().st_size, "sha256": hashlib.file_digest(file, "sha256").hexdigest()}


def empty_folder(path: Path) -> Path:
    path.mkdir(parents=True, exist_ok=True)
    if any(path.iterdir()):
        raise SystemExit(f"{path} is not empty: name a new folder.")
    return path


def scatter(network: nn.Module, gain: float = 1.0) -> None:
    """Random weights whose outputs differ from input to input; the usual initialisation gives nearly constant ones."""
    with torch.no_grad():
        for parameter in network.parameters():
            if parameter.dim() > 1:
                parameter.normal_(std=gain / parameter[0].numel() ** 0.5)
