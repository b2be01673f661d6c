"""The demo's folder: what lies where, and whose it is. Nothing is removed that a demo did not write."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from openbelief.documents import from_json, from_toml
from robot_app.cli import Failure

MARKER = ".openbelief-demo"  # a folder with it is a demo's: a demo makes its own names in it anew
SAYS = "Made by `openbelief demo`, which makes its own files here anew; files of other names stay.\n"
CONFIG_HEAD = "# Made by `openbelief demo`, which makes it anew: keep your own under another name.\n"


@dataclass(frozen=True)
class Files:
    """The demo's folder."""

    folder: Path

    @property
    def marker(self) -> Path:
        return self.folder / MARKER

    @property
    def walk(self) -> Path:
        return self.folder / "walk.mcap"

    @property
    def truth(self) -> Path:
        return self.folder / "walk.truth.json"

    @property
    def memory(self) -> Path:
        return self.folder / "site.belief"

    @property
    def config(self) -> Path:
        return self.folder / "robot.toml"

    @property
    def trial(self) -> Path:
        return self.folder / "trial.mcap"

    @property
    def log(self) -> Path:
        return self.folder / "log.jsonl"

    @property
    def pictures(self) -> Path:
        return self.folder / "pictures"

    def here(self) -> list[Path]:
        """What lies here under the names that a demo writes, unfinished files and caches too."""
        made = [self.walk, self.truth, self.memory, self.config, self.trial, self.log, self.pictures / "top_view.png"]
        unfinished = [path.with_name(path.name + ".partial") for path in (self.walk, self.memory, self.trial)]
        events = [path.with_suffix(".events.jsonl") for path in (self.walk, self.trial)]
        caches = self.folder.glob("site.belief.walk-????????.perception.jsonl")
        arrivals = self.pictures.glob("arrival_[0-9].png")
        return [path for path in [*made, *unfinished, *events, *caches, *arrivals] if path.is_file()]

    def claim(self) -> None:
        """Make the folder ready: an earlier demo's files go. Raises Failure where a file is somebody else's."""
        if not (self.marker.is_file() or self._is_an_unmarked_demo()):
            for path in self.here():
                raise Failure(
                    f"{path} is there, and no demo made {self.folder}: choose a new folder with --out, "
                    "for the demo would write over it."
                )
        if self.folder.exists() and not self.folder.is_dir():
            raise Failure(f"{self.folder} is a file: choose a folder with --out.")
        self.folder.mkdir(parents=True, exist_ok=True)
        self.marker.write_text(SAYS, encoding="utf-8")
        for path in self.here():
            path.unlink()

    def _is_an_unmarked_demo(self) -> bool:
        """Demos once left no marker: the truth about a scene, and a configuration that is simulated throughout."""
        try:
            truth = from_json(self.truth.read_text(encoding="utf-8"))
            config = from_toml(self.config.read_text(encoding="utf-8"))
        except (OSError, ValueError):
            return False
        bodies = {body for port, body in config.get("ports", {}).items() if port != "battery"}
        simulated = bodies == {"sim"} and (config.get("memory"), config.get("trials")) == ("site.belief", ".")
        return simulated and isinstance(truth, dict) and truth.get("format") == "openbelief.truth/1"
