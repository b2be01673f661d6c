"""Networks: list what is known of them, pull their files, export them to ONNX, check what lies in a folder.

A file whose sha256 is not in the table is trusted when it is first pulled, and recorded in models.lock.json; from then
on it has to stay the same. A wrong or truncated file is refused by name.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from robot_app.cli import Failure, print_json
from robot_app.tables import add_wide

if TYPE_CHECKING:
    from robot_app.models.check import Checked
    from robot_app.models.table import ModelEntry

EXAMPLE = "openbelief models list"
EXPORT_PYTHON = Path(".venv-export/bin/python")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    deeds = parser.add_subparsers(dest="deed", required=True, metavar="list|pull|export|check")
    listed = deeds.add_parser("list", help="every network: role, source, licence, what is known of its files")
    add_wide(listed)
    pull = deeds.add_parser("pull", help="fetch a network's files from the hub, resumed and checked")
    pull.add_argument("name", metavar="NAME", help="a row of the list")
    pull.add_argument("--endpoint", metavar="URL", help="a mirror of the hub (default: the hub, or HF_ENDPOINT)")
    export = deeds.add_parser("export", help="the command that turns pulled files into ONNX")
    export.add_argument("name", metavar="NAME", help="a row of the list")
    export.add_argument("--run", dest="execute", action="store_true", help="run it, too")
    check = deeds.add_parser("check", help="run each network once: providers, latency, memory")
    check.add_argument("--device", choices=("auto", "cpu", "cuda", "tensorrt"), default="auto")
    check.add_argument("--threads", type=int, metavar="N", help="of one run (default: one per core)")
    for deed in (pull, export, check):
        deed.add_argument("--folder", type=Path, default=Path("models"), help="where models lie (default models)")
    for deed in deeds.choices.values():
        deed.add_argument("--json", action="store_true", default=argparse.SUPPRESS, help="machine-readable result")


def run(options: argparse.Namespace) -> int:
    return DEEDS[options.deed](options)


def _list(options: argparse.Namespace) -> int:
    from robot_app.models.table import table

    models = table()
    if options.json:
        print_json({name: model.model_dump() for name, model in models.items()})
    else:
        _show_models(models, wide=options.wide)
    return 0


def _pull(options: argparse.Namespace) -> int:
    from robot_app.models.pull import pull
    from robot_app.models.table import row

    model = row(options.name)
    print(f"{options.name}: {model.licence}", file=sys.stderr)
    paths = pull(
        options.name,
        model,
        options.folder,
        endpoint=options.endpoint,
        tell=lambda sentence: print(sentence, file=sys.stderr),
    )
    if options.json:
        print_json({"files": [str(path) for path in paths]})
    return 0


def _export(options: argparse.Namespace) -> int:
    import shlex
    import subprocess

    from robot_app.models.table import row

    command = export_command(options.name, row(options.name), options.folder)
    if options.json:
        print_json({"command": command})
    else:
        print(shlex.join(command))
    if not options.execute:
        return 0
    if not EXPORT_PYTHON.exists():
        raise Failure(f"{EXPORT_PYTHON} is missing: make it with requirements/export.txt (docs/perception.md).")
    if subprocess.run(command, stdout=sys.stderr, check=False).returncode:
        raise Failure(f"The export of {options.name} failed; its own words are above.")
    return 0


def export_command(name: str, model: ModelEntry, folder: Path) -> list[str]:
    """What makes FOLDER/NAME of FOLDER/checkpoints/NAME; raises Failure where there is nothing to export."""
    from robot_app.models.table import CHECKPOINTS

    if model.export is None:
        raise Failure(f"{name} needs no export.")
    places = {"checkpoint": str(folder / CHECKPOINTS / name), "out": str(folder / name)}
    return [str(EXPORT_PYTHON), *(part.format(**places) for part in model.export)]


def _check(options: argparse.Namespace) -> int:
    from robot_app.models.check import check_folder

    checked = check_folder(options.folder, options.device, options.threads)
    if options.json:
        print_json({"files": [each.as_json() for each in checked]})
    else:
        _show_checked(checked)
    if wrong := [each for each in checked if each.wrong]:
        raise Failure("; ".join(f"{each.file} {each.wrong}" for each in wrong))
    return 0


FITTING = ("name", "role", "source", "licence", "size")


def _show_models(models: dict[str, ModelEntry], *, wide: bool) -> None:
    from rich.table import Table

    from robot_app.tables import cell, chosen, show

    shown = Table("name", "role", "source", "repository", "revision", "licence", "files", "size", "sha256")
    for name, model in models.items():
        revision = model.revision if model.source == "hub" else "-"
        texts = (name, model.role, model.source, model.repository, revision, model.licence, str(len(model.files)))
        shown.add_row(*(cell(text) for text in (*texts, _size(model), _hashes(model))))
    show(chosen(shown, FITTING, wide=wide), wide=wide)


def _size(model: ModelEntry) -> str:
    """Of all its files, where every one of them is known."""
    sizes = [facts.bytes for facts in model.files.values() if facts.bytes is not None]
    if not model.files:
        return "-"
    return f"{sum(sizes) / 2**20:.1f} MiB" if len(sizes) == len(model.files) else "unknown"


def _hashes(model: ModelEntry) -> str:
    known = sum(facts.sha256 is not None for facts in model.files.values())
    return f"{known} of {len(model.files)} known" if model.files else "-"


def _show_checked(checked: Sequence[Checked]) -> None:
    from rich.table import Table

    from robot_app.tables import cell, number, show

    shown = Table("file", "sha256", "in table", "providers", "first ms", "then ms", "MiB")
    for each in checked:
        if not each.wrong:
            texts = (each.file, (each.sha256 or "")[:12], "yes" if each.known else "no", ", ".join(each.providers))
            numbers = (number(value, 1) for value in (each.first_ms, each.again_ms, each.memory_mib))
            shown.add_row(*(cell(text) for text in texts), *numbers)
    show(shown)


DEEDS = {"list": _list, "pull": _pull, "export": _export, "check": _check}
