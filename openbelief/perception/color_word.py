"""The colour that a person would call a thing by, where it has one."""

from __future__ import annotations

import cv2
import numpy as np

from openbelief.arrays import Array

# (first hue of OpenCV's 0 to 179, word); red closes the circle.
HUES = ((0, "red"), (10, "orange"), (22, "yellow"), (34, "green"), (85, "blue"), (130, "purple"), (150, "pink"))
RED_AGAIN = 170
BLACK_BELOW, WHITE_ABOVE, GREY_BELOW, BROWN_BELOW = 45, 150, 45, 170
# Of the pixels: a patchwork has no colour, and a wrong word is worse than none. Neighbours on the circle of hues, or
# on the way from black to white, speak for a word as well: a lime seat is 61 % yellow, and the rest green.
AGREEING, AGREEING_WITH_NEIGHBOURS = 0.5, 0.8
NEIGHBOURS = {
    "red": ("orange", "pink", "brown"),
    "orange": ("red", "yellow", "brown"),
    "yellow": ("orange", "green", "brown"),
    "green": ("yellow", "blue"),
    "blue": ("green", "purple"),
    "purple": ("blue", "pink"),
    "pink": ("purple", "red"),
    "brown": ("orange", "yellow", "red", "black"),
    "black": ("grey", "brown"),
    "grey": ("black", "white"),
    "white": ("grey",),
}


def color_word(color: Array, pixels: Array) -> str | None:
    """The word for the median of the masked pixels' HSV; None where too few of them are of that word, or near it."""
    rgb = color[pixels]
    if not len(rgb):
        return None
    hsv = cv2.cvtColor(np.ascontiguousarray(rgb[None]), cv2.COLOR_RGB2HSV)[0]
    word = _words(_median(hsv))[0]
    words = _words(hsv)
    near = np.isin(words, (word, *NEIGHBOURS[str(word)]))
    agreed = np.mean(words == word) >= AGREEING and np.mean(near) >= AGREEING_WITH_NEIGHBOURS
    return str(word) if agreed else None


def _median(hsv: Array) -> Array:
    """(1, 3). Hue is a circle: it is turned so that red lies in its middle, where things of wood and red paint are."""
    turned = (hsv[:, 0].astype(int) + 90) % 180
    hue = (int(np.median(turned)) - 90) % 180
    return np.array([[hue, *np.median(hsv[:, 1:], axis=0)]], dtype=int)


def _words(hsv: Array) -> Array:
    """(n,) words of (n, 3) HSV rows."""
    hue, saturation, value = hsv.astype(int).T
    starts, names = np.array([first for first, _ in HUES]), np.array([name for _, name in HUES])
    words = np.where(hue >= RED_AGAIN, "red", names[np.searchsorted(starts, hue, side="right") - 1]).astype("<U6")
    words[((words == "orange") | (words == "yellow")) & (value < BROWN_BELOW)] = "brown"
    words[saturation < GREY_BELOW] = "grey"
    words[(saturation < GREY_BELOW) & (value >= WHITE_ABOVE)] = "white"
    words[value < BLACK_BELOW] = "black"
    return words
