"""One self-contained page: nothing is loaded, and only the styles and the script written here may run.

The policy names both by their hashes, so markup that a model or a person smuggled into a phrase could not run either;
all words are escaped all the same.
"""

from __future__ import annotations

import base64
import hashlib
import html
import json
from pathlib import Path
from typing import Any

from openbelief.phrase import printable
from robot_app.outputs import writing

ASSETS = Path(__file__).parent
WORDS_MAX = 200


def document(title: str, body: str, *, script: str | None = None, data: Any = None) -> str:
    """A page. body: markup, its words escaped by `text`. data: JSON that the script finds in #data."""
    style = (ASSETS / "page.css").read_text(encoding="utf-8")
    policy = f"default-src 'none'; img-src data:; style-src '{_hash(style)}'; base-uri 'none'; form-action 'none'"
    policy += f"; script-src '{_hash(script)}'" if script else ""
    parts = [
        "<!doctype html>",
        '<html lang="en"><head><meta charset="utf-8">',
        f'<meta http-equiv="Content-Security-Policy" content="{policy}">',
        '<meta name="viewport" content="width=device-width, initial-scale=1">',
        '<meta name="referrer" content="no-referrer">',
        f"<title>{text(title)}</title><style>{style}</style></head><body>",
        body,
    ]
    if data is not None:
        parts.append(f'<script type="application/json" id="data">{_json(data)}</script>')
    if script:
        parts.append(f"<script>{script}</script>")
    return "\n".join([*parts, "</body></html>"])


def write(path: Path, page: str) -> None:
    """Raises Failure where it cannot be written."""
    with writing(path):
        path.write_text(page, encoding="utf-8")


def text(words: Any) -> str:
    """Words of unknown origin, for markup: one line, escaped."""
    return html.escape(printable(str(words), WORDS_MAX), quote=True)


def data_uri(image: bytes | None, kind: str = "jpeg") -> str | None:
    return None if image is None else f"data:image/{kind};base64,{base64.b64encode(image).decode()}"


def _json(data: Any) -> str:
    """JSON that cannot end its element or begin a comment."""
    said = json.dumps(data, allow_nan=False, ensure_ascii=True, separators=(",", ":"))
    return said.replace("<", "\\u003c").replace(">", "\\u003e").replace("&", "\\u0026")


def _hash(content: str) -> str:
    return "sha256-" + base64.b64encode(hashlib.sha256(content.encode()).digest()).decode()
