"""What the vision-language model is asked, and how it decodes: versioned, because the evidence depends on it."""

from __future__ import annotations

import hashlib
from typing import Any

# Raised whenever the prompt, the decoding or the reading of replies changes.
VERSION = 2
PROMPT = "List the distinct physical objects you can see, as short noun phrases, one per line."
MAX_PHRASES = 20
DECODING: dict[str, Any] = {"temperature": 0, "max_tokens": 512}


def prompt_id() -> str:
    """ "prompt 2 (3f2a9c01)": the version, and a hash that changes with any word or number."""
    text = repr((PROMPT, MAX_PHRASES, sorted(DECODING.items())))
    return f"prompt {VERSION} ({hashlib.sha256(text.encode()).hexdigest()[:8]})"


def messages(data_url: str) -> list[dict[str, Any]]:
    """One user message: the picture, then the question."""
    picture = {"type": "image_url", "image_url": {"url": data_url}}
    return [{"role": "user", "content": [picture, {"type": "text", "text": PROMPT}]}]
