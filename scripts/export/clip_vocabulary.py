"""CLIP's byte-pair vocabulary, which open_clip carries, as a file for the `tokenizers` library."""

from __future__ import annotations

import gzip
from pathlib import Path

import open_clip
from tokenizers import Regex, Tokenizer, models, pre_tokenizers, processors

SPECIAL = ("<start_of_text>", "<end_of_text>")
MERGES = 49152 - 256 - 2  # of those in the file
WORDS = r"(?i)'s|'t|'re|'ve|'m|'ll|'d|[\p{L}]+|[\p{N}]|[^\s\p{L}\p{N}]+"


def merges_file() -> Path:
    return Path(open_clip.__file__).parent / "bpe_simple_vocab_16e6.txt.gz"


def merges(count: int = MERGES) -> list[tuple[str, str]]:
    """The first `count` merges, by rank."""
    lines = gzip.decompress(merges_file().read_bytes()).decode().split("\n")[1 : count + 1]
    return [(left, right) for left, right in (line.split() for line in lines)]


def vocabulary(count: int = MERGES, special: tuple[str, str] = SPECIAL) -> dict[str, int]:
    """Token -> id: the bytes, the bytes that end a word, the merges, the special tokens."""
    alphabet = list(open_clip.tokenizer.bytes_to_unicode().values())
    tokens = [*alphabet, *(c + "</w>" for c in alphabet), *(left + right for left, right in merges(count)), *special]
    return {token: index for index, token in enumerate(tokens)}


def clip_tokenizer(context_length: int, count: int = MERGES) -> Tokenizer:
    """As open_clip's SimpleTokenizer on cleaned text: start, words, end; cut to the length, filled with 0."""
    words = vocabulary(count)
    tokenizer = Tokenizer(models.BPE(vocab=words, merges=merges(count), end_of_word_suffix="</w>"))
    tokenizer.pre_tokenizer = pre_tokenizers.Sequence(
        [
            pre_tokenizers.Split(Regex(WORDS), behavior="removed", invert=True),
            pre_tokenizers.ByteLevel(add_prefix_space=False, use_regex=False),
        ]
    )
    start, end = SPECIAL
    tokenizer.post_processor = processors.TemplateProcessing(
        single=f"{start} $A {end}", special_tokens=[(start, words[start]), (end, words[end])]
    )
    tokenizer.enable_truncation(context_length)
    tokenizer.enable_padding(length=context_length, pad_id=0, pad_token="!")
    return tokenizer
