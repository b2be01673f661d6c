"""Any open_clip architecture to ONNX: image encoder and text encoder with unit rows, tokenizer, model.json.

    .venv-export/bin/python scripts/export/clip.py MobileCLIP2-S4 WEIGHTS -o models/mobileclip2-s4
    .venv-export/bin/python scripts/export/clip.py ViT-B-32 --random 0 -o /tmp/vit-b-32

WEIGHTS is a local checkpoint: fetch it first, under its own licence.
"""

from __future__ import annotations

import argparse
import copy
from pathlib import Path
from typing import Any

import open_clip
import torch
from clip_vocabulary import clip_tokenizer
from model_folder import empty_folder, finish, halve, scatter, to_onnx, weights_sha256
from timm.utils import reparameterize_model
from tokenizers import Tokenizer
from torch import Tensor, nn
from torchvision import transforms

PRECISIONS = ("fp32", "fp16")


class Encoder(nn.Module):
    """`encode` of the model; unit rows out."""

    def __init__(self, model: nn.Module, modality: str) -> None:
        super().__init__()
        self.encode = getattr(model, f"encode_{modality}")
        self.model = model

    def forward(self, value: Tensor) -> Tensor:
        return nn.functional.normalize(self.encode(value), dim=-1)


def random_model(architecture: str, seed: int) -> tuple[nn.Module, Any]:
    """The real architecture at random weights, and its pre-processing."""
    torch.manual_seed(seed)
    model, _, transform = open_clip.create_model_and_transforms(architecture, pretrained_hf=False)
    settle(model.eval(), picture(transform)["size"], context_length(architecture))
    return model, transform


def settle(model: nn.Module, size: int, length: int) -> None:
    """Random weights as well-conditioned as trained ones: rows that differ from input to input, numbers of moderate
    size in between.

    As initialised, MobileCLIP2 gives every picture the same row (cosine 0.999998): its residual branches are scaled by
    1e-5. With those scattered like all weights, its activations double from block to block, to 1e13 in S4's 46, because
    batch normalisation with the mean 0 and variance 1 that it begins with normalises nothing. So its statistics are
    taken from a batch, as training would have. A text tower without it bears, and needs, larger weights: in S0's, two
    texts have a mean cosine of 0.99 as initialised and 0.93 so.
    """
    scatter(model.visual)
    scatter(model.text if hasattr(model, "text") else model.transformer, gain=1.4)
    norms = [module for module in model.modules() if isinstance(module, nn.modules.batchnorm._BatchNorm)]
    if not norms:
        return
    for norm in norms:
        norm.reset_running_stats()
        norm.momentum = None  # the batch's own mean and variance, not a tenth of them
        norm.train()
    with torch.no_grad():
        model.encode_image(clouds(size))
        model.encode_text(torch.randint(1, 1000, (8, length)))
    model.eval()


def clouds(size: int, count: int = 6) -> Tensor:
    """(count, 3, size, size) of random blots, coarse to fine, about as bright and varied as normalised pictures."""
    grains = [torch.randn(count, 3, n, n) for n in (4, 16, 64)]
    return sum(nn.functional.interpolate(grain, size=(size, size), mode="bilinear") for grain in grains) / 2


def export(
    architecture: str,
    model: nn.Module,
    transform: Any,
    tokenizer: Tokenizer,
    folder: Path,
    precision: str = "fp32",
) -> None:
    """image.onnx, text.onnx, tokenizer.json and model.json into an empty folder."""
    config = open_clip.get_model_config(architecture)
    picture_about = picture(transform)
    length = context_length(architecture)
    digest = weights_sha256(model)
    lean = reparameterize_model(copy.deepcopy(model)).eval()
    image = torch.zeros((3, 3, picture_about["size"], picture_about["size"]))  # 3: no other axis is taken for n
    ids = torch.ones((3, length), dtype=torch.long)
    for name, key, example in (("image", "pixel_values", image), ("text", "input_ids", ids)):
        to_onnx(Encoder(lean, name), {key: example}, ["rows"], folder / f"{name}.onnx", batched=(key,))
        if precision == "fp16":
            halve(folder / f"{name}.onnx")
    tokenizer.save(str(folder / "tokenizer.json"), pretty=False)
    finish(
        folder,
        kind="clip",
        architecture=architecture,
        precision=precision,
        weights_sha256=digest,
        dim=config["embed_dim"],
        picture=picture_about,
        cleaning=cleaning(config["text_cfg"]),
    )


def cleaning(text_config: dict[str, Any]) -> str:
    """open_clip's cleaning of a text before its tokenizer."""
    default = "whitespace" if "hf_tokenizer_name" in text_config else "lower"
    return str(text_config.get("tokenizer_kwargs", {}).get("clean", default))


def context_length(architecture: str) -> int:
    return int(open_clip.get_model_config(architecture)["text_cfg"].get("context_length", 77))


def tokenizer_of(architecture: str) -> Tokenizer:
    """open_clip's tokenizer, which also cuts and fills. One of the hub has to lie in the hub's local cache."""
    reference, length = open_clip.get_tokenizer(architecture), context_length(architecture)
    if isinstance(reference, open_clip.SimpleTokenizer):
        return clip_tokenizer(length)
    if reference.strip_sep_token or reference.tokenizer_mode:
        raise SystemExit(f"{architecture}: this kind of tokenizer is not supported.")
    fast = reference.tokenizer
    fast.backend_tokenizer.enable_truncation(length)
    fast.backend_tokenizer.enable_padding(length=length, pad_id=fast.pad_token_id, pad_token=fast.pad_token)
    return fast.backend_tokenizer


def picture(transform: Any) -> dict[str, Any]:
    """The pre-processing's numbers, read from its steps; raises SystemExit on a step that the runtime has not."""
    steps = {type(step): step for step in transform.transforms}
    resize, normalize = steps[transforms.Resize], steps[transforms.Normalize]
    squash = not isinstance(resize.size, int) and len(resize.size) == 2
    if squash == (transforms.CenterCrop in steps):
        raise SystemExit(f"This pre-processing is not supported: {transform}")
    size = resize.size if isinstance(resize.size, int) else resize.size[0]
    return {
        "size": size,
        "mode": "squash" if squash else "shortest",
        "interpolation": resize.interpolation.value,
        "mean": [float(x) for x in normalize.mean],
        "std": [float(x) for x in normalize.std],
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("architecture", help="as open_clip names it")
    parser.add_argument("weights", nargs="?", type=Path, help="a checkpoint that open_clip can load")
    parser.add_argument("--random", type=int, metavar="SEED", help="random weights instead")
    parser.add_argument("--fp16", action="store_true", help="half precision: half the memory, for GPUs")
    parser.add_argument("-o", "--out", type=Path, required=True, help="a new folder")
    options = parser.parse_args()
    if (options.weights is None) == (options.random is None):
        parser.error("give WEIGHTS or --random SEED")
    if options.weights:
        model, _, transform = open_clip.create_model_and_transforms(
            options.architecture, pretrained=str(options.weights)
        )
    else:
        model, transform = random_model(options.architecture, options.random)
    folder = empty_folder(options.out)
    tokenizer = tokenizer_of(options.architecture)
    export(options.architecture, model.eval(), transform, tokenizer, folder, "fp16" if options.fp16 else "fp32")
    print(f"{folder}: {options.architecture} for `openbelief map --perception paper`")


if __name__ == "__main__":
    main()
