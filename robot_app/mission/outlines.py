"""Masks as lines: what a page draws over a picture of any size."""

from __future__ import annotations

import numpy as np

from openbelief.arrays import Array

SIMPLER_PX = 1.0  # corners that lie this near to the line between others go
LEAST_PX = 12.0  # smaller specks are not drawn


def outlines(pixels: Array) -> list[list[list[float]]]:
    """(h, w) bool -> closed lines of [x, y] corners, shares of the picture's width and height, the largest first."""
    import cv2

    height, width = pixels.shape
    lines, _ = cv2.findContours(pixels.astype(np.uint8), cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_SIMPLE)
    large = sorted((line for line in lines if cv2.contourArea(line) >= LEAST_PX), key=cv2.contourArea, reverse=True)
    simple = (cv2.approxPolyDP(line, SIMPLER_PX, True)[:, 0, :] for line in large)
    return [[[round(float(x) / width, 4), round(float(y) / height, 4)] for x, y in line] for line in simple]
