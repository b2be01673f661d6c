"""Which files make one recording: the folder that `ros2 bag record` makes, and the files that it was split into."""

from __future__ import annotations

import re
from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path

from logs.mcap_io.reader import LogError

METADATA = "metadata.yaml"
SUFFIXES = (".mcap", ".db3", ".bag")
PACKED = ("", ".zstd", ".zst")
NUMBERED = re.compile(r"(?P<stem>.*?)(?:_(?P<number>\d{1,6}))?(?P<suffix>(?:\.mcap|\.db3|\.bag)(?:\.zstd|\.zst)?)")
MAX_METADATA_BYTES = 16 << 20


def files_of(folder: Path) -> tuple[list[Path], list[str]]:
    """(the files of a recording's folder in their order, names that metadata.yaml lists and that are not there).

    Raises LogError where the folder holds no recording, or several.
    """
    found = sorted((p for p in folder.iterdir() if NUMBERED.fullmatch(p.name) and p.is_file()), key=_number)
    if not found:
        raise LogError(f"{folder} is a folder without a recording: no .mcap, .db3 or .bag lies in it")
    listed = _listed(folder / METADATA)
    if listed:
        present = [path for name in listed if (path := _present(folder, name)) is not None]
        missing = [name for name in listed if _present(folder, name) is None]
        if present:
            return present, missing
    if len({_stem(path) for path in found}) > 1 or not _consecutive(found):
        names = ", ".join(path.name for path in found[:5])
        raise LogError(
            f"{folder} is a folder of several recordings ({names}{', ...' if len(found) > 5 else ''}): "
            "name the .mcap files that belong together"
        )
    return found, []


def split_sets(paths: Sequence[Path]) -> list[list[Path]]:
    """The paths, those that are numbered parts of one recording (walk_0.mcap, walk_1.mcap) together and in order."""
    sets: dict[tuple[Path, str, str], list[Path]] = {}
    for path in paths:
        matched = NUMBERED.fullmatch(path.name)
        key = (path.parent, *_stem(path)) if matched else (path.parent, path.name, "")
        sets.setdefault(key, []).append(path)
    runs: list[list[Path]] = []
    for members in sets.values():
        for path in sorted(set(members), key=_number):
            if runs and runs[-1][-1] in members and _follows(runs[-1][-1], path):
                runs[-1].append(path)
            else:
                runs.append([path])
    return runs


def _number(path: Path) -> tuple[str, int]:
    matched = NUMBERED.fullmatch(path.name)
    return (matched["stem"], int(matched["number"] or 0)) if matched else (path.name, 0)


def _stem(path: Path) -> tuple[str, str]:
    matched = NUMBERED.fullmatch(path.name)
    return (matched["stem"], matched["suffix"]) if matched else (path.name, "")


def _follows(before: Path, after: Path) -> bool:
    return _number(after)[1] == _number(before)[1] + 1


def _consecutive(paths: list[Path]) -> bool:
    return all(_follows(a, b) for a, b in pairwise(paths))


def _present(folder: Path, name: str) -> Path | None:
    """The file of that name in the folder, packed or not; what metadata.yaml says of other folders is not followed."""
    plain = Path(name).name.removesuffix(".zstd").removesuffix(".zst")
    for ending in PACKED:
        if plain.endswith(SUFFIXES) and (path := folder / f"{plain}{ending}").is_file():
            return path
    return None


def _listed(metadata: Path) -> list[str]:
    """relative_file_paths; empty where there is none, or none that can be read."""
    if not metadata.is_file() or metadata.stat().st_size > MAX_METADATA_BYTES:
        return []
    inside, names = False, []
    for line in metadata.read_text(encoding="utf-8", errors="replace").splitlines():
        word = line.strip()
        if word.startswith("relative_file_paths:"):
            inside = True
        elif inside and word.startswith("- "):
            names.append(word[2:].strip().strip("'\""))
        elif inside and word:
            break
    return names
