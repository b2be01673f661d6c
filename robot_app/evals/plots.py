"""The curves of evaluations, as pictures."""

from __future__ import annotations

from pathlib import Path
from typing import Any


def plot_doubt(result: dict[str, Any], path: Path) -> None:
    """Kept of the findable and refused of the absent nouns, over the level from which a thing counts as found."""
    from matplotlib.figure import Figure

    doubt, absent = result["doubt"], result.get("absent_nouns")
    levels = [point["found_at"] for point in doubt["curve"]]
    figure = Figure(figsize=(7, 4.2), layout="constrained")
    axes = figure.subplots()
    axes.plot(levels, [point["kept"] for point in doubt["curve"]], color="#1b7f4b", label="kept of the findable")
    if absent:
        refused = [point["refused"] for point in doubt["curve"]]
        axes.plot(levels, refused, color="#b03a2e", label=f"refused of {absent['queries']} absent nouns")
    axes.axvline(doubt["found_at"], color="#555555", linestyle="--", linewidth=1, label="in use")
    axes.set(xlabel="found at: least likeness H of the best candidate", ylabel="share", ylim=(0, 1.03))
    axes.set_title(f"{Path(result['truth']).name}: {result['queries']} findable queries", loc="left", fontsize=10)
    axes.grid(alpha=0.3)
    axes.legend(loc="lower left", frameon=False)
    figure.savefig(path, dpi=130)
