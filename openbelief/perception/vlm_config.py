"""How a vision-language model server is asked. The same limits hold for a profile's file and for code."""

from __future__ import annotations

from typing import Annotated, Literal
from urllib.parse import urlsplit

from pydantic import AfterValidator, Field
from pydantic.dataclasses import dataclass

from openbelief.settings import CHECKED, Number, Positive, Whole, in_one_line


def _http(endpoint: str) -> str:
    parts = urlsplit(endpoint)
    if parts.scheme not in ("http", "https") or not parts.hostname:
        raise ValueError(f"should be http(s)://HOST[:PORT]/v1, got {endpoint!r}")
    return endpoint


def _named(model: str) -> str:
    if not model.strip():
        raise ValueError("should name what the endpoint serves")
    return model


Endpoint = Annotated[str, AfterValidator(_http)]
Model = Annotated[str, AfterValidator(_named)]
Patience = Annotated[Number, Field(ge=0)]
Concurrency = Annotated[Whole, Field(ge=1, le=64)]
PictureKind = Literal["jpeg", "png"]
Side = Annotated[Whole, Field(ge=32, le=8192)]


@in_one_line("Picture")
@dataclass(frozen=True, config=CHECKED)
class PictureFormat:
    """max_side_px: larger images are shrunk; Qwen-VL makes a token of 32 x 32 pixels, so this bounds the time.

    Raises ValueError.
    """

    kind: PictureKind = "jpeg"
    max_side_px: Side = 1024
    jpeg_quality: Annotated[Whole, Field(ge=1, le=100)] = 90

    def __str__(self) -> str:
        kind = f"jpeg q{self.jpeg_quality}" if self.kind == "jpeg" else "png"
        return f"{kind} <= {self.max_side_px} px"


@in_one_line("Model server's")
@dataclass(frozen=True, config=CHECKED)
class VlmConfig:
    """endpoint: up to and with /v1. timeout_s: for one answer. patience_s: how long a lost server is waited for.

    concurrency: requests under way at once. requests_per_minute: None = as fast as they come. Raises ValueError.
    """

    endpoint: Endpoint
    model: Model
    api_key: str | None = Field(default=None, repr=False)
    timeout_s: Positive = 60.0
    patience_s: Patience = 300.0
    concurrency: Concurrency = 4
    requests_per_minute: Positive | None = None
    picture: PictureFormat = PictureFormat()
