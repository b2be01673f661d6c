"""What a newcomer's first command does, in which order."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]


def test_a_missing_system_library_is_told_before_anything_is_installed(tmp_path: Path) -> None:
    """On a bare Debian the apt line came after half a minute of installing."""
    for name in ("Makefile", "pyproject.toml"):
        shutil.copy(ROOT / name, tmp_path)
    shutil.copytree(ROOT / "requirements", tmp_path / "requirements")
    (tmp_path / "scripts").mkdir()
    check = tmp_path / "scripts" / "check_system.py"
    check.write_text("import sys\nprint('Missing system libraries: libGL.so.1.', file=sys.stderr)\nsys.exit(1)\n")
    done = subprocess.run(["make", "setup"], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode != 0 and "libGL.so.1" in done.stderr
    assert not (tmp_path / ".venv").exists()
