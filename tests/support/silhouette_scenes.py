"""A synthetic scene for the tests of silhouettes: a person in front of a softly textured wall."""

from __future__ import annotations

import cv2
import numpy as np

CLEANED = ("auto", "brightness", "colour", "both", "mog2")
METHODS = (*CLEANED, "averaging")
SIZE = (120, 160)
WALL, SHIRT, SKIN = (150, 130, 110), (120, 45, 40), (110, 140, 190)  # blue green red


def figure() -> np.ndarray:
    """An upper body (H, W), with a hand on the hip, which leaves a gap, and a finger of two pixels."""
    mask = np.zeros(SIZE, np.uint8)
    cv2.ellipse(mask, (80, 25), (9, 12), 0, 0, 360, 1, -1)
    cv2.rectangle(mask, (76, 35), (84, 45), 1, -1)
    cv2.rectangle(mask, (64, 42), (96, 119), 1, -1)
    cv2.line(mask, (66, 47), (40, 70), 1, 7)
    cv2.line(mask, (40, 70), (66, 95), 1, 7)
    cv2.line(mask, (94, 47), (135, 40), 1, 7)
    cv2.rectangle(mask, (135, 39), (148, 40), 1, -1)
    return mask > 0


def scene(rng: np.random.Generator, colour=WALL) -> np.ndarray:
    """A softly textured wall (H, W, 3), without noise."""
    texture = cv2.GaussianBlur(rng.normal(0, 40, SIZE), (0, 0), 6)
    return np.clip(np.array(colour, float) + texture[..., None], 0, 255)


def shot(rng: np.random.Generator, picture: np.ndarray, noise=1.5) -> np.ndarray:
    """An image with camera noise."""
    return np.clip(np.rint(picture + rng.normal(0, noise, picture.shape)), 0, 255).astype(np.uint8)


def empty_shots(rng: np.random.Generator, wall: np.ndarray, count=12) -> list[np.ndarray]:
    return [shot(rng, wall) for _ in range(count)]


def dressed(wall: np.ndarray, mask: np.ndarray, shirt=SHIRT, skin=SKIN) -> np.ndarray:
    """Image of the person in front of the wall: shirt below, skin above and at the ends of the arms."""
    picture = wall.copy()
    picture[mask] = shirt
    bare = mask.copy()
    bare[40:, :125] = False
    picture[bare] = skin
    return picture


def overlap(a: np.ndarray, b: np.ndarray) -> float:
    return np.count_nonzero(a & b) / max(np.count_nonzero(a | b), 1)


def grey(image: np.ndarray) -> np.ndarray:
    return np.asarray(cv2.cvtColor(image, cv2.COLOR_BGR2GRAY), np.uint8)
