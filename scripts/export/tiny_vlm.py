"""A Qwen3-VL at random weights, a few hundred kB, in a folder that stands in for the hub's local cache.

    .venv-export/bin/python scripts/export/tiny_vlm.py CACHE
    HF_HUB_CACHE=CACHE HF_HUB_OFFLINE=1 .venv-export/bin/transformers serve --device cpu --port 8000

Every part of the real architecture is there (vision tower with deep stack, interleaved positions, chat template), so
that a real server treats it like the real one. What it answers means nothing.
"""

from __future__ import annotations

import argparse
import json
import re
from pathlib import Path

import torch
from model_folder import scatter
from phrases import phrases
from tokenizers import Tokenizer, decoders, models, pre_tokenizers, trainers
from transformers import Qwen2Tokenizer, Qwen3VLConfig, Qwen3VLForConditionalGeneration, Qwen3VLProcessor
from transformers.models.qwen2_vl.image_processing_qwen2_vl import Qwen2VLImageProcessor
from transformers.models.qwen3_vl.video_processing_qwen3_vl import Qwen3VLVideoProcessor

NAME = "random/tiny-qwen3-vl"
COMMIT = "0" * 40
SPECIAL = ("<|endoftext|>", "<|im_start|>", "<|im_end|>", "<|vision_start|>", "<|vision_end|>", "<|image_pad|>")
SPECIAL += ("<|video_pad|>",)
WORDS = 400
PATCH = 16
SEED = 9  # of twelve, the one that breaks lines
CHAT = (
    "{% for message in messages %}<|im_start|>{{ message.role }}\n{% for part in message.content %}"
    "{% if part.type == 'image' %}<|vision_start|><|image_pad|><|vision_end|>{% else %}{{ part.text }}{% endif %}"
    "{% endfor %}<|im_end|>\n{% endfor %}{% if add_generation_prompt %}<|im_start|>assistant\n{% endif %}"
)


def tokenizer() -> Qwen2Tokenizer:
    """Byte-level like Qwen's, with the most frequent pieces of our own phrases."""
    trained = Tokenizer(models.BPE())
    trained.pre_tokenizer = pre_tokenizers.ByteLevel(add_prefix_space=False)
    trained.decoder = decoders.ByteLevel()
    alphabet = pre_tokenizers.ByteLevel.alphabet()
    trainer = trainers.BpeTrainer(vocab_size=256 + WORDS, initial_alphabet=alphabet, show_progress=False)
    trained.train_from_iterator(phrases(1000), trainer)
    pieces = trained.get_vocab()
    merges = [tuple(pair) for pair in json.loads(trained.to_str())["model"]["merges"]]
    made = Qwen2Tokenizer(vocab=pieces, merges=merges, eos_token="<|im_end|>", model_max_length=4096)
    made.add_special_tokens({"additional_special_tokens": list(SPECIAL)})
    return made


def processor() -> Qwen3VLProcessor:
    sizes = {"patch_size": PATCH, "size": {"shortest_edge": 4 * PATCH * PATCH, "longest_edge": 400 * PATCH * PATCH}}
    return Qwen3VLProcessor(
        image_processor=Qwen2VLImageProcessor(**sizes),
        tokenizer=tokenizer(),
        video_processor=Qwen3VLVideoProcessor(patch_size=PATCH),
        chat_template=CHAT,
    )


def model(words: Qwen2Tokenizer) -> Qwen3VLForConditionalGeneration:
    torch.manual_seed(SEED)
    ids = {name: words.convert_tokens_to_ids(f"<|{name}|>") for name in ("image_pad", "video_pad")}
    starts = {f"{name}_token_id": words.convert_tokens_to_ids(f"<|{name}|>") for name in ("vision_start", "vision_end")}
    narrow = {"hidden_size": 32, "intermediate_size": 64}
    config = Qwen3VLConfig(
        vision_config={
            "depth": 2,
            "num_heads": 2,
            "out_hidden_size": 32,
            "num_position_embeddings": 16,
            "deepstack_visual_indexes": [0],
            "patch_size": PATCH,
            **narrow,
        },
        text_config={
            "vocab_size": len(words),
            "num_hidden_layers": 2,
            "num_attention_heads": 2,
            "num_key_value_heads": 1,
            "head_dim": 16,
            "max_position_embeddings": 4096,
            "rope_parameters": {
                "rope_type": "default",
                "rope_theta": 10000.0,
                "mrope_section": [4, 2, 2],
                "mrope_interleaved": True,
            },
            **narrow,
        },
        image_token_id=ids["image_pad"],
        video_token_id=ids["video_pad"],
        **starts,
    )
    made = Qwen3VLForConditionalGeneration(config).eval()
    scatter(made)
    speak(made, words)
    return made


def speak(made: Qwen3VLForConditionalGeneration, words: Qwen2Tokenizer) -> None:
    """Whole words and new lines only, seldom the same twice: a reply that can be read as phrases."""
    spoken = re.compile(r"Ġ[a-z]{3,}|Ċ|<\|im_end\|>")
    settings = made.generation_config
    settings.suppress_tokens = [index for token, index in words.get_vocab().items() if not spoken.fullmatch(token)]
    settings.repetition_penalty = 1.3
    settings.eos_token_id = words.convert_tokens_to_ids("<|im_end|>")
    settings.pad_token_id = words.convert_tokens_to_ids("<|endoftext|>")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("cache", type=Path, help="a new folder")
    home = parser.parse_args().cache / f"models--{NAME.replace('/', '--')}"
    snapshot = home / "snapshots" / COMMIT
    snapshot.mkdir(parents=True)
    (home / "refs").mkdir()
    (home / "refs" / "main").write_text(COMMIT)
    parts = processor()
    parts.save_pretrained(snapshot)
    model(parts.tokenizer).save_pretrained(snapshot)
    print(NAME)


if __name__ == "__main__":
    main()
