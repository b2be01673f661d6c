"""JSON and TOML of strangers end in a document or in one sentence, whatever they hold."""

from __future__ import annotations

import pytest

from openbelief.documents import MAX_KEY_PARTS, from_json, from_toml


@pytest.mark.parametrize("text", ["[" * 100_000 + "]" * 100_000, '{"a":' * 50_000 + "1" + "}" * 50_000])
def test_json_nested_too_deeply_is_one_sentence(text: str) -> None:
    with pytest.raises(ValueError, match="nested too deeply"):
        from_json(text)


def test_json_longer_than_what_is_expected_is_not_parsed() -> None:
    with pytest.raises(ValueError, match="more than the 10 allowed"):
        from_json("[1, 2, 3, 4]", max_bytes=10)


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("value = " + "[" * 50_000 + "]" * 50_000, "nested too deeply"),
        ("a" + ".a" * 2 * MAX_KEY_PARTS + " = 1", "more than 100 parts"),
        ("[a" + " . a" * 2 * MAX_KEY_PARTS + "]", "more than 100 parts"),
        ("v = {a" + ".a" * 2 * MAX_KEY_PARTS + " = 1}", "more than 100 parts"),
        ("value = " + "9" * 10_000, "a number is too long"),
        ("value = ", "Invalid value"),
    ],
    ids=["lists", "key", "table", "inline table", "number", "nothing"],
)
def test_toml_that_would_exhaust_its_reader_is_one_sentence(text: str, why: str) -> None:
    with pytest.raises(ValueError, match=why) as refused:
        from_toml(text)
    assert "\n" not in str(refused.value) and len(str(refused.value)) < 200


def test_what_people_write_is_read() -> None:
    numbers = ", ".join(["0.5"] * 500)
    assert from_toml(f"a.b.c = 1\nlist = [{numbers}]\nurl = '1.2.3.4' # v1.2.3")["a"] == {"b": {"c": 1}}
    assert from_json('{"a": [1, {"b": null}]}') == {"a": [1, {"b": None}]}
    assert from_json('{"a": 1}', object_pairs_hook=list) == [("a", 1)]
