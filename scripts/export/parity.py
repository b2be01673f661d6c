"""Our runtime against the reference implementations, at random weights: what differs at most, and what may.

    make parity                                       SAM 3, the paper's encoder and two free ones: ten minutes, 11 GB
    make parity ARCHITECTURES=MobileCLIP2-S0          another open_clip architecture

Exit status 1 where a difference is larger than its limit.
"""

from __future__ import annotations

import argparse
import logging
import sys
import tempfile
import warnings
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import clip as clip_export
import numpy as np
import open_clip
import sam3 as sam3_export
import torch
from clip_vocabulary import clip_tokenizer
from fixtures import MERGES, SEED
from photographs import photographs
from phrases import phrases
from PIL import Image

from openbelief.perception.clip import TEMPLATES, Clip
from openbelief.perception.prompt_tokens import PromptTokens
from openbelief.perception.sam3 import Sam3Segmenter

SAM3 = "SAM3-small"
ARCHITECTURES = (SAM3, "MobileCLIP2-S4", "ViT-B-32", "ViT-B-32-SigLIP2-256")
PROMPTS = ("red chair", "lamp", "fire extinguisher", "cup of tea", "astronaut", "cat")
LIMITS = {"fp32": 1e-4, "fp16": 1e-2}  # of a row's numbers: another order of sums; half precision against single


@dataclass(frozen=True)
class Row:
    """One comparison. value: the largest difference (or what `what` says); it may be at most `limit`."""

    subject: str
    what: str
    value: float
    limit: float

    def __str__(self) -> str:
        verdict = "ok" if self.value <= self.limit else "TOO LARGE"
        return f"{self.subject:28} {self.what:58} {self.value:11.3g} <= {self.limit:<7.3g} {verdict}"


def largest(ours: Any, reference: Any) -> float:
    return float(np.abs(np.asarray(ours, dtype=np.float64) - np.asarray(reference, dtype=np.float64)).max(initial=0.0))


def cosine_gap(ours: np.ndarray, reference: np.ndarray) -> float:
    """1 - the smallest cosine of corresponding rows."""
    return float(1.0 - (ours.astype(np.float64) * reference.astype(np.float64)).sum(axis=1).min())


def differing(ours: np.ndarray, reference: np.ndarray) -> int:
    return int((ours != reference).any(axis=1).sum())


# --- open_clip ---------------------------------------------------------------


def clip_rows(architecture: str, folder: Path) -> Iterator[Row]:
    """The export in single and in half precision, against open_clip in single precision."""
    model, transform = clip_export.random_model(architecture, seed=0)
    hub = "hf_tokenizer_name" in open_clip.get_model_config(architecture)["text_cfg"]
    tokenizer = (
        clip_tokenizer(clip_export.context_length(architecture)) if hub else clip_export.tokenizer_of(architecture)
    )
    clips = {}
    for precision in LIMITS:
        (folder / precision).mkdir()
        clip_export.export(architecture, model, transform, tokenizer, folder / precision, precision)
        clips[precision] = Clip(folder / precision, device="cpu")
    ours, photos, texts = clips["fp32"], photographs(), phrases(200)[40:]
    if not hub:
        every = phrases()
        ids, reference_ids = ours.text._tokens(every)[0], open_clip.get_tokenizer(architecture)(every).numpy()
        yield Row(architecture, f"texts of {len(every)} with other token ids", differing(ids, reference_ids), 20)
    pixels = [(ours.images._transform(photo), transform(Image.fromarray(photo)).numpy()) for photo in photos.values()]
    yield Row(architecture, f"pre-processing, {len(photos)} photographs", max(largest(a, b) for a, b in pixels), 1e-5)
    with torch.inference_mode():
        images = torch.cat([model.encode_image(torch.from_numpy(b)[None], normalize=True) for _, b in pixels]).numpy()
        sentences = np.stack([reference_text(model, ours, text) for text in texts])
    pictures, words = f"image rows, {len(photos)} photographs", f"text rows, {len(texts)} texts"
    words += ", own token ids" if hub else ", both templates"
    for name, want in ((pictures, images), (words, sentences)):
        yield Row(architecture, f"{name}, cosine between two of them", spread(want), 0.999)
    for precision, clip in clips.items():
        subject, limit = f"{architecture} {precision}", LIMITS[precision]
        got = {pictures: clip.images.encode(list(photos.values())), words: clip.text.encode(texts)}
        for name, want in ((pictures, images), (words, sentences)):
            yield Row(subject, name, largest(got[name], want), limit)
            yield Row(subject, f"{name}, 1 - cosine", cosine_gap(got[name], want), limit / 10)


def reference_text(model: Any, ours: Clip, text: str) -> np.ndarray:
    """open_clip's networks on our ids (which are compared with open_clip's above), HOV-SG's mean of the templates."""
    ids = ours.text._tokens([template.replace("{}", text) for template in TEMPLATES])[0]
    row = model.encode_text(torch.from_numpy(ids), normalize=True).numpy().mean(axis=0)
    return row / np.linalg.norm(row)


def spread(rows: np.ndarray) -> float:
    """Mean cosine of different rows: near 1, a comparison would show nothing."""
    cosines = rows @ rows.T
    return float(cosines[~np.eye(len(rows), dtype=bool)].mean())


# --- SAM 3 -------------------------------------------------------------------


def sam3_rows(folder: Path) -> Iterator[Row]:
    model, processor = sam3_export.small(SEED, MERGES)
    sam3_export.export(model, processor, folder, f"{SAM3}-random")
    ours, photos, subject = Sam3Segmenter(folder, device="cpu"), photographs(), "SAM 3, small fp32"
    yield sam3_tokens(subject, folder / "full.json")
    parts: dict[str, list[float]] = {}
    for photo in photos.values():
        for what, value in sam3_differences(model, processor, ours, photo):
            parts.setdefault(what, []).append(value)
    limits = {
        "pre-processing (levels of 255)": 1.01,
        "mask pixels that differ, share": 5e-3,
        "boxes in the image (px)": 1.0,
    }
    for what, values in parts.items():
        yield Row(subject, f"{what}, {len(photos)} photographs", max(values), limits.get(what, 1e-3))
    kept = sum(len(found) for photo in photos.values() for found in ours.instances(photo, PROMPTS))
    queries = len(photos) * len(PROMPTS) * model.config.detr_decoder_config.num_queries
    yield Row(subject, f"instances above the threshold: share of {queries} queries", kept / queries, 0.9)


def sam3_tokens(subject: str, file: Path) -> Row:
    """With the whole vocabulary; the small network has the first merges only."""
    processor, every = sam3_export.small_processor(112, sam3_export.MERGES), phrases()
    reference = processor.tokenizer(every, padding="max_length", max_length=32, truncation=True)["input_ids"]
    sam3_export.write_tokenizer(processor, file)
    ids = PromptTokens(file, "none")(every)[0]
    return Row(subject, f"texts of {len(every)} with other token ids", differing(ids, reference), 0)


def sam3_differences(model: Any, processor: Any, ours: Sam3Segmenter, photo: np.ndarray) -> Iterator[tuple[str, float]]:
    """Step by step, each on the reference's input; then the whole pipeline from the photograph on."""
    want = processor(images=Image.fromarray(photo), text=list(PROMPTS), return_tensors="pt")
    pixels = want["pixel_values"].numpy()
    yield "pre-processing (levels of 255)", largest(ours._transform(photo)[None], pixels) * 127.5
    with torch.inference_mode():
        vision = model.get_vision_features(torch.from_numpy(pixels))
        texts = model.get_text_features(want["input_ids"], want["attention_mask"]).pooler_output.numpy()
        found = [
            model(vision_embeds=vision, input_ids=ids[None], attention_mask=mask[None])
            for ids, mask in zip(want["input_ids"], want["attention_mask"], strict=True)
        ]
    maps = ours._vision.run({"pixel_values": pixels})
    yield "image features", max(largest(a, b.numpy()) for a, b in zip(maps, vision.fpn_hidden_states, strict=False))
    prompts = ours.encode_prompts(PROMPTS)
    yield "prompt features", largest(prompts["text_features"], texts)
    raw = ours._decoder.run({**dict(zip(("map_0", "map_1", "map_2"), maps, strict=True)), **prompts})
    for what, got, key in zip(
        ("logits", "presence", "boxes", "mask logits"),
        raw,
        ("pred_logits", "presence_logits", "pred_boxes", "pred_masks"),
        strict=True,
    ):
        yield what, largest(got, torch.cat([getattr(one, key) for one in found]).numpy())
    yield from sam3_outcomes(processor, ours, photo, found)


def sam3_outcomes(
    processor: Any, ours: Sam3Segmenter, photo: np.ndarray, found: list[Any]
) -> Iterator[tuple[str, float]]:
    """From the photograph to instances in the image, each side with its own pre-processing."""
    got = ours.instances(photo, PROMPTS)
    for one, mine in zip(found, got, strict=True):
        [want] = processor.image_processor.post_process_instance_segmentation(one, 0.5, 0.5, [photo.shape[:2]])
        yield "instances more or fewer", abs(len(mine) - len(want["scores"]))
        if len(mine) != len(want["scores"]) or not mine:
            continue
        yield "scores", largest([instance.score for instance in mine], want["scores"])
        yield "boxes in the image (px)", largest([instance.box for instance in mine], want["boxes"])
        masks = np.stack([instance.pixels for instance in mine])
        yield "mask pixels that differ, share", float((masks != want["masks"].numpy().astype(bool)).mean())


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("architectures", nargs="*", help=f"of open_clip, or {SAM3}; default {', '.join(ARCHITECTURES)}")
    chosen = parser.parse_args().architectures
    torch.set_num_threads(1)  # several threads wait for each other on a busy machine, ten times as long
    warnings.filterwarnings("ignore")
    logging.disable(logging.WARNING)
    print(f"torch {torch.__version__}, open_clip {open_clip.__version__}, random weights, on the CPU")
    rows = []
    for name in chosen or ARCHITECTURES:
        with tempfile.TemporaryDirectory() as folder:
            for row in sam3_rows(Path(folder)) if name == SAM3 else clip_rows(name, Path(folder)):
                print(row, flush=True)
                rows.append(row)
    return int(any(row.value > row.limit for row in rows))


if __name__ == "__main__":
    sys.exit(main())
