"""Words to the token ids of a text encoder, as its reference implementation cleans and cuts them."""

from __future__ import annotations

import html
import re
import string
import unicodedata
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from openbelief.arrays import Array

# What open_clip's text repair does to single characters: straight quotes, plain ligatures, full-width forms, no
# invisible controls. Its guessing of wrongly decoded text ("Ã©" for "é") is left out: our text is UTF-8 throughout.
_QUOTES = {**dict.fromkeys("\u02bc‘’‚‛", "'"), **dict.fromkeys("“”„‟", '"')}
_LIGATURES = {c: unicodedata.normalize("NFKC", c).replace("\u02bc", "'") for c in "ĲĳŉǄǅǆǇǈǉǊǋǌǱǲǳﬀﬁﬂﬃﬄﬅﬆ"}
_WIDTHS = {chr(i): unicodedata.normalize("NFKC", chr(i)) for i in [0x3000, *range(0xFF01, 0xFFF0)]}
_CONTROLS = [*range(0x09), 0x0B, *range(0x0E, 0x20), 0x7F, *range(0x206A, 0x2070), 0xFEFF, *range(0xFFF9, 0xFFFD)]
_CHARACTERS = str.maketrans({**_QUOTES, **_LIGATURES, **_WIDTHS, **{chr(i): "" for i in _CONTROLS}})
_PUNCTUATION = str.maketrans("_", " ", string.punctuation.replace("_", ""))


def repaired(text: str) -> str:
    """HTML entities resolved twice, characters as in `_CHARACTERS`, NFC, single spaces."""
    text = re.sub(r"\x1b\[[0-9;]*[a-zA-Z]", "", text).translate(_CHARACTERS)
    text = html.unescape(html.unescape(unicodedata.normalize("NFC", text)))
    return " ".join(text.split())


# The cleaning that model.json names -> what it does.
CLEANINGS: dict[str, Callable[[str], str]] = {
    "none": lambda text: text,  # the tokenizer file normalises itself (SAM 3)
    "whitespace": repaired,
    "lower": lambda text: repaired(text).lower(),  # CLIP
    "canonicalize": lambda text: " ".join(repaired(text).translate(_PUNCTUATION).lower().split()),  # SigLIP
}


class PromptTokens:
    """tokenizer.json, which also says where to cut and how to fill, behind a cleaning. A phrase is data: words that
    spell a special token stay words."""

    def __init__(self, tokenizer_file: Path, cleaning: str) -> None:
        from tokenizers import Tokenizer

        self._tokenizer = Tokenizer.from_file(str(tokenizer_file))
        self._tokenizer.encode_special_tokens = True
        self._clean = CLEANINGS[cleaning]

    def __call__(self, texts: Sequence[str]) -> tuple[Array, Array]:
        """(n, length) int64 token ids and (n, length) int64 attention mask."""
        encodings = self._tokenizer.encode_batch([self._clean(text) for text in texts])
        ids = np.array([e.ids for e in encodings], dtype=np.int64)
        return ids, np.array([e.attention_mask for e in encodings], dtype=np.int64)
