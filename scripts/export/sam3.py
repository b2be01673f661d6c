"""SAM 3 to ONNX: vision encoder, text encoder and decoder, so that phrases share one encoding of an image.

    .venv-export/bin/python scripts/export/sam3.py CHECKPOINT -o models/sam3    # a folder that save_pretrained wrote
    .venv-export/bin/python scripts/export/sam3.py --random 0 -o /tmp/sam3      # the real size at random weights
    .venv-export/bin/python scripts/export/sam3.py --small 0 -o /tmp/sam3       # the same parts, small, for tests

The checkpoint is a local folder: fetch it first, under its own licence.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from types import SimpleNamespace

import torch
from clip_vocabulary import MERGES, merges, vocabulary
from model_folder import empty_folder, finish, scatter, to_onnx, weights_sha256
from torch import Tensor, nn
from transformers import CLIPTokenizer, Sam3Config, Sam3Model, Sam3Processor
from transformers.models.sam3.image_processing_sam3 import Sam3ImageProcessor
from transformers.models.sam3.modeling_sam3 import Sam3VisionEncoderOutput

PROMPT_TOKENS = 32


class VisionEncoder(nn.Module):
    """(1, 3, s, s) -> the three feature maps that the decoder reads, finest first."""

    def __init__(self, model: Sam3Model) -> None:
        super().__init__()
        self.encoder = model.vision_encoder

    def forward(self, pixel_values: Tensor) -> tuple[Tensor, ...]:
        return tuple(self.encoder(pixel_values).fpn_hidden_states[:3])


class TextEncoder(nn.Module):
    """(n, 32) token ids and mask -> (n, 32, d) prompt features."""

    def __init__(self, model: Sam3Model) -> None:
        super().__init__()
        self.model = model

    def forward(self, input_ids: Tensor, attention_mask: Tensor) -> Tensor:
        return self.model.get_text_features(input_ids=input_ids, attention_mask=attention_mask).pooler_output


class Decoder(nn.Module):
    """One image's maps, n prompts -> logits (n, q), presence (n, 1), boxes (n, q, 4), masks (n, q, h, w) as logits.

    Boxes are xyxy in [0, 1].

    The position encoding and the coordinate grid depend on the image size alone, so they are constants of the graph.
    """

    def __init__(self, model: Sam3Model, maps: tuple[Tensor, ...], position: Tensor) -> None:
        super().__init__()
        self.model = model
        self.register_buffer("position", position, persistent=False)
        height, width = maps[2].shape[-2:]
        rows, columns = torch.arange(height) / height, torch.arange(width) / width
        model.detr_decoder._get_coords = lambda *_, **__: (rows, columns)

    def forward(
        self, map_0: Tensor, map_1: Tensor, map_2: Tensor, text_features: Tensor, attention_mask: Tensor
    ) -> tuple[Tensor, ...]:
        n = text_features.shape[0]
        maps = [m.expand(n, -1, -1, -1) for m in (map_0, map_1, map_2)]
        position = self.position.expand(n, -1, -1, -1)
        found = self.model(
            vision_embeds=Sam3VisionEncoderOutput(
                fpn_hidden_states=(*maps, None), fpn_position_encoding=(None, None, position, None)
            ),
            text_embeds=SimpleNamespace(pooler_output=text_features),
            attention_mask=attention_mask,
        )
        return found.pred_logits, found.presence_logits, found.pred_boxes, found.pred_masks


def small_model(seed: int, vocabulary_size: int) -> Sam3Model:
    """Every part of SAM 3, few of each, at random weights."""
    torch.manual_seed(seed)
    narrow = {"hidden_size": 16, "num_attention_heads": 2, "intermediate_size": 16}
    config = Sam3Config(
        vision_config={
            "backbone_config": {
                "model_type": "sam3_vit_model",
                "num_hidden_layers": 2,
                "image_size": 112,
                "pretrain_image_size": 56,
                "window_size": 4,
                "global_attn_indexes": [1],
                **narrow,
            },
            "fpn_hidden_size": 16,
            "backbone_feature_sizes": [[32, 32], [16, 16], [8, 8]],
        },
        text_config={
            "model_type": "clip_text_model",
            "vocab_size": vocabulary_size,
            "num_hidden_layers": 2,
            "max_position_embeddings": PROMPT_TOKENS,
            "projection_dim": 16,
            "hidden_act": "gelu",
            "eos_token_id": vocabulary_size - 1,
            **narrow,
        },
        geometry_encoder_config={"num_layers": 1, **narrow},
        detr_encoder_config={"num_layers": 2, **narrow},
        detr_decoder_config={"num_layers": 2, "num_queries": 12, **narrow},
        mask_decoder_config={"hidden_size": 16, "num_attention_heads": 2},
    )
    model = Sam3Model(config).eval()
    scatter(model)
    with torch.no_grad():  # scores on both sides of 0.5
        model.detr_decoder.presence_head.layer2.bias += 8.0
    return model


def small_processor(size: int, merge_count: int) -> Sam3Processor:
    """SAM 3's own pre-processing for a small image, with the first merges of CLIP's vocabulary."""
    special = ("<|startoftext|>", "<|endoftext|>")
    tokenizer = CLIPTokenizer(vocab=vocabulary(merge_count, special), merges=merges(merge_count))
    pictures = Sam3ImageProcessor(size={"height": size, "width": size})
    return Sam3Processor(image_processor=pictures, tokenizer=tokenizer)


def small(seed: int, merge_count: int = MERGES) -> tuple[Sam3Model, Sam3Processor]:
    return small_model(seed, len(vocabulary(merge_count))), small_processor(112, merge_count)


def full(seed: int) -> tuple[Sam3Model, Sam3Processor]:
    """The real configuration at random weights: to measure time and memory, not to see anything."""
    torch.manual_seed(seed)
    model = Sam3Model(Sam3Config()).eval()
    scatter(model)
    return model, small_processor(model.config.image_size, MERGES)


def export(model: Sam3Model, processor: Sam3Processor, folder: Path, architecture: str) -> None:
    """The three networks, tokenizer.json and model.json into an empty folder."""
    model.set_attn_implementation("eager")  # torch's fused attention does not decompose with a bias and a free n
    size = model.config.image_size
    ids = torch.ones((3, PROMPT_TOKENS), dtype=torch.long)  # 3 is no other axis of the networks
    prompts = {"input_ids": ids, "attention_mask": ids.clone()}
    image = torch.zeros((1, 3, size, size))
    with torch.no_grad():
        encoded = model.vision_encoder(image)
        maps = tuple(encoded.fpn_hidden_states[:3])
        features = TextEncoder(model)(**prompts)
    decoder = Decoder(model, maps, encoded.fpn_position_encoding[2])
    names = ["map_0", "map_1", "map_2"]
    to_onnx(VisionEncoder(model), {"pixel_values": image}, names, folder / "vision.onnx")
    to_onnx(TextEncoder(model), prompts, ["text_features"], folder / "text.onnx", batched=tuple(prompts))
    to_onnx(
        decoder,
        {**dict(zip(names, maps, strict=True)), "text_features": features, "attention_mask": prompts["attention_mask"]},
        ["logits", "presence", "boxes", "masks"],
        folder / "decoder.onnx",
        batched=("text_features", "attention_mask"),
    )
    write_tokenizer(processor, folder / "tokenizer.json")
    finish(
        folder,
        kind="sam3",
        architecture=architecture,
        precision="fp32",
        weights_sha256=weights_sha256(model),
        picture=picture(processor, size),
        cleaning="none",
    )


def write_tokenizer(processor: Sam3Processor, path: Path) -> None:
    tokenizer = processor.tokenizer.backend_tokenizer
    tokenizer.enable_truncation(PROMPT_TOKENS)  # the reference lets a longer prompt fail in the network
    tokenizer.enable_padding(
        length=PROMPT_TOKENS, pad_id=processor.tokenizer.pad_token_id, pad_token=processor.tokenizer.pad_token
    )
    tokenizer.save(str(path), pretty=False)


def picture(processor: Sam3Processor, size: int) -> dict[str, object]:
    pictures = processor.image_processor
    return {
        "size": size,
        "mode": "squash",
        "interpolation": "bilinear",
        "mean": list(pictures.image_mean),
        "std": list(pictures.image_std),
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    source = parser.add_mutually_exclusive_group(required=True)
    source.add_argument("checkpoint", nargs="?", type=Path, help="folder with config.json, weights and tokenizer")
    source.add_argument("--random", type=int, metavar="SEED", help="random weights, the real configuration")
    source.add_argument("--small", type=int, metavar="SEED", help="random weights, a small configuration")
    parser.add_argument("-o", "--out", type=Path, required=True, help="a new folder")
    options = parser.parse_args()
    if options.checkpoint:
        model = Sam3Model.from_pretrained(options.checkpoint, local_files_only=True).eval()
        processor = Sam3Processor.from_pretrained(options.checkpoint, local_files_only=True)
        export(model, processor, empty_folder(options.out), "SAM3")
    elif options.random is not None:
        export(*full(options.random), empty_folder(options.out), "SAM3-random")
    else:
        export(*small(options.small), empty_folder(options.out), "SAM3-small-random")
    print(f"{options.out}: SAM 3 for `openbelief map --perception paper`")


if __name__ == "__main__":
    main()
