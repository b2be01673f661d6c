"""The tiny networks of tests/openbelief/perception/fixtures, at random weights, with what the reference makes of them.

    make export-fixtures

The tests that read them need no torch.
"""

from __future__ import annotations

import gzip
import json
import shutil
import tempfile
from pathlib import Path

import clip as clip_export
import cv2
import numpy as np
import open_clip
import sam3 as sam3_export
import torch
from clip_vocabulary import clip_tokenizer, merges
from model_folder import scatter
from photographs import photographs
from phrases import phrases
from PIL import Image

FIXTURES = Path(__file__).resolve().parents[2] / "tests" / "openbelief" / "perception" / "fixtures"
MERGES = 300
SEED = 22  # of forty, the one whose random SAM 3 finds some things, not all, in every photograph
PHOTOS = ("coffee.png", "astronaut.png", "chelsea.png")
PROMPTS = ["red chair", "the lamp", "cup of tea"]
TEXTS = [text for text in phrases(400) if "\u0345" not in text][:150]
CLIP_CONFIG = {
    "embed_dim": 16,
    "vision_cfg": {"image_size": 32, "layers": 1, "width": 32, "head_width": 16, "patch_size": 8},
    "text_cfg": {"context_length": 16, "vocab_size": 512 + MERGES + 2, "width": 32, "heads": 2, "layers": 1},
}


def small_photographs() -> list[np.ndarray]:
    """Wide, tall, and smaller than the networks' input."""
    found, sizes = photographs(), ((160, 120), (72, 96), (48, 30))
    return [cv2.resize(found[name], size) for name, size in zip(PHOTOS, sizes, strict=True)]


def half_fixture(folder: Path) -> None:
    """The same network in half precision; what to expect of it lies with the other."""
    model, transform = small_clip()
    clip_export.export("small-random", model, transform, clip_tokenizer(16, MERGES), folder, "fp16")


def clip_fixture(folder: Path) -> None:
    model, transform = small_clip()
    clip_export.export("small-random", model, transform, clip_tokenizer(16, MERGES), folder)
    photos, tokenize = small_photographs(), small_reference_tokenizer()
    with torch.inference_mode():
        pixels = torch.stack([transform(Image.fromarray(photo)) for photo in photos])
        images = model.encode_image(pixels, normalize=True)
        plain, sentence = (
            model.encode_text(tokenize([template.replace("{}", text) for text in PROMPTS]), normalize=True)
            for template in ("{}", "There is the {} in the scene.")
        )
    np.savez_compressed(
        folder / "expected.npz",
        **{f"photo_{i}": photo for i, photo in enumerate(photos)},
        pixels=pixels.numpy(),
        images=images.numpy(),
        prompts=PROMPTS,
        prompt_rows=torch.nn.functional.normalize((plain + sentence) / 2, dim=-1).numpy(),
        texts=TEXTS,
        ids=tokenize(TEXTS).numpy(),
    )


def small_clip() -> tuple[torch.nn.Module, object]:
    torch.manual_seed(0)
    with tempfile.TemporaryDirectory() as folder:
        config = Path(folder) / "small-random.json"
        config.write_text(json.dumps(CLIP_CONFIG))
        open_clip.add_model_config(config)
    model, _, transform = open_clip.create_model_and_transforms("small-random")
    scatter(model, gain=1.5)
    return model.eval(), transform


def small_reference_tokenizer() -> open_clip.SimpleTokenizer:
    """open_clip's own, over the first merges."""
    with tempfile.NamedTemporaryFile(suffix=".gz") as file:
        lines = ["#version", *(" ".join(pair) for pair in merges(MERGES))]
        Path(file.name).write_bytes(gzip.compress("\n".join(lines).encode()))
        return open_clip.SimpleTokenizer(file.name, context_length=16)


def sam3_fixture(folder: Path) -> None:
    model, processor = sam3_export.small(SEED, MERGES)
    sam3_export.export(model, processor, folder, "SAM3-small-random")
    expected: dict[str, np.ndarray] = {"prompts": np.array(PROMPTS)}
    for index, photo in enumerate(small_photographs()):
        inputs = processor(images=Image.fromarray(photo), text=PROMPTS, return_tensors="pt")
        with torch.inference_mode():
            raw = [
                model(pixel_values=inputs["pixel_values"], input_ids=ids[None], attention_mask=mask[None])
                for ids, mask in zip(inputs["input_ids"], inputs["attention_mask"], strict=True)
            ]
        sizes = [photo.shape[:2]]
        found = [processor.image_processor.post_process_instance_segmentation(one, 0.5, 0.5, sizes)[0] for one in raw]
        expected |= {
            f"photo_{index}": photo,
            f"levels_{index}": (255 * (inputs["pixel_values"][0] + 1) / 2).round().numpy().astype(np.uint8),
            f"ids_{index}": inputs["input_ids"].numpy(),
            f"logits_{index}": torch.cat([one.pred_logits for one in raw]).numpy(),
            f"prompt_{index}": np.concatenate([[p] * len(one["scores"]) for p, one in enumerate(found)]).astype(int),
            f"scores_{index}": torch.cat([one["scores"] for one in found]).numpy(),
            f"boxes_{index}": torch.cat([one["boxes"] for one in found]).numpy(),
            f"masks_{index}": torch.cat([one["masks"] for one in found]).numpy().astype(bool),
        }
        print(index, len(expected[f"scores_{index}"]), "instances")
    np.savez_compressed(folder / "expected.npz", **expected)


def main() -> None:
    for name, make in {"clip": clip_fixture, "clip-fp16": half_fixture, "sam3": sam3_fixture}.items():
        shutil.rmtree(FIXTURES / name, ignore_errors=True)
        (FIXTURES / name).mkdir(parents=True)
        torch.set_num_threads(1)
        make(FIXTURES / name)


if __name__ == "__main__":
    main()
