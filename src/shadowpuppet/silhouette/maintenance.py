"""Maintenance of the background: it follows what changes in the scene and stays, such as a chair that was moved or the sun on a wall.

Pixels that have looked alike for some seconds, unlike the background and away from the person, become background as they look now. Where
the person stands the background is held, and for longer where they stood, with one exception: pixels that look like the scene as learnt, or
as it would if it had changed there as it has beside it (light that wanders on). A film whose pixels beside the person all look like the
empty scene is segmented as if there were no maintenance.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from shadowpuppet.camera.mask import bounding_window
from shadowpuppet.silhouette.background import Image, smoothed, to_planes
from shadowpuppet.silhouette.classifiers import ChannelClassifier
from shadowpuppet.silhouette.cleanup import coarse_person
from shadowpuppet.silhouette.segmenter import Labelled, Segmented, Segmenter

INTERVAL = 0.5
"""Seconds from one look at the pixels beside the person to the next."""
LASTING, STOOD = 2.0, 10.0
"""Seconds for which a pixel must look alike to become background; the second where the person was, or may still be, until it has been
background once."""
MARGIN = 0.05
"""Distance to the person up to which pixels are held, over the height of the silhouette."""
GOES_ON = 0.6
"""Least overlap of the silhouettes of a frame and the last."""
MAX_SHARE = 0.4
"""Share of the picture that differs from the scene beside the person from which on nothing is followed: the camera, or all of the light,
has changed."""
AROUND = 5
"""Distance in pixels to which a change of the background tells how the pixels beside it may have changed."""
SPECKS = 2e-4
"""Least share of the picture that changes at once where nothing beside has changed before: fewer pixels are noise."""
BESIDE = 4
"""Pixels around a change whose assumed noise changes with it: smoothing and edges reach that far."""


class MaintainedSegmenter:
    """A segmenter with a background that follows lasting changes: `maintained(image, time)` is the mask of the next frame.

    Its state is what it has seen: frames are given in order, and the same frames at the same times have the same masks. Methods that do not
    compare channels (`averaging`, `mog2`, `knn`) keep their background.
    """

    def __init__(self, segmenter: Segmenter) -> None:
        """As learnt; nothing is followed yet."""
        self.segmenter = segmenter
        """With the background as it is now."""
        self.followed = 0
        """Number of pixels that have become background so far, each as often as it has."""
        self._next = -np.inf
        self._person: NDArray[np.uint8] | None = None
        shape = segmenter.background.shape
        self._age, self._before = np.zeros(shape, np.uint8), np.zeros(shape, np.uint8)
        self._learnt = segmenter
        self._shift = np.zeros((*shape, 3), np.float32)
        self._slow = np.zeros((*shape, 3), np.float32) if isinstance(segmenter.classifier, ChannelClassifier) else None

    def __call__(self, image: Image, time: float) -> NDArray[np.bool_]:
        """The person's mask (H, W) in a frame (H, W, 3) or (H, W) at `time` (s). Raises `SilhouetteError` for a frame that does not fit."""
        return self.segmented(image, time).mask

    def segmented(self, image: Image, time: float) -> Segmented:
        """The silhouette in a frame (H, W, 3) or (H, W) at `time` (s). Raises `SilhouetteError` for a frame that does not fit."""
        labelled = self.segmenter.labelled(image)
        found = self.segmenter.segmented(labelled)
        if self._slow is not None and self._goes_on(found.mask) and time >= self._next:
            self._next = time + INTERVAL - 1e-6
            self._look(labelled, found.mask, self._slow)
        return found

    def _goes_on(self, mask: NDArray[np.bool_]) -> bool:
        """Whether a frame's mask (H, W) is the last one's person. If it jumps, to a patch of light that is larger than the person for
        example, nothing is followed until it is back: the person may be what is beside it."""
        import cv2

        bits = mask.view(np.uint8)
        if self._person is not None:
            both = cv2.countNonZero(cv2.bitwise_and(bits, self._person))
            either = cv2.countNonZero(cv2.bitwise_or(bits, self._person))
            if both < GOES_ON * either:
                return False
        self._person = bits
        return True

    def _look(self, seen: Labelled, mask: NDArray[np.bool_], slow: NDArray[np.float32]) -> None:
        from shadowpuppet.silhouette._kernels import watch

        classifier = self.segmenter.classifier
        assert isinstance(classifier, ChannelClassifier)
        held = _held(mask.view(np.uint8) if self.segmenter.settings.cleaned else coarse_person(seen.label, self.segmenter.several))
        if np.count_nonzero(seen.label[held == 0]) > MAX_SHARE * held.size:
            self._age[:] = 0
            return
        due, ages = np.zeros(held.shape, np.uint8), (round(LASTING / INTERVAL), round(STOOD / INTERVAL))
        planes = smoothed(to_planes(seen.image), classifier.smoothing)
        assert isinstance(self._learnt.classifier, ChannelClassifier)
        found = watch(seen.label, held, planes, self._learnt.classifier.mean, self._shift, classifier.inverse_sigma,
                      np.float32(classifier.factor), ages, slow, self._age, self._before, due)
        if np.count_nonzero(due == 1) < SPECKS * due.size:
            due &= 2
        if found and due.any():
            self.followed += np.count_nonzero(due)
            self._follow(due, slow, classifier)

    def _follow(self, due: NDArray[np.uint8], slow: NDArray[np.float32], classifier: ChannelClassifier) -> None:
        """Make pixels (H, W) background as they look in `slow` (H, W, 3)."""
        mean = self.segmenter.background.mean.copy()
        mean[due > 0] = slow[due > 0]
        window = bounding_window(due, BESIDE)
        background = replace(self.segmenter.background, mean=mean)
        self.segmenter = replace(self.segmenter, background=background, classifier=classifier.with_scene(mean, window))
        beside = bounding_window(due, 2 * AROUND)
        around = bounding_window(due, AROUND)
        inner = tuple(slice(each.start - wide.start, each.stop - wide.start) for each, wide in zip(around, beside))
        self._shift[around] = _spread(mean[beside] - self._learnt.background.mean[beside])[inner]


def _held(person: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """2 for pixels (H, W) on a person (H, W), 1 for those near them, else 0."""
    import cv2

    side = 2 * max(2, round(MARGIN * cv2.boundingRect(person)[3])) + 1
    return np.asarray(cv2.dilate(person, np.ones((side, side), np.uint8)) + person, np.uint8)


def _spread(change: NDArray[np.float32]) -> NDArray[np.float32]:
    """Mean change (H, W, 3) of the changed pixels around each pixel; 0 where there are none."""
    import cv2

    changed = (np.abs(change).sum(axis=2) > 0).astype(np.float32)
    side = (2 * AROUND + 1,) * 2
    sums, number = cv2.boxFilter(change, -1, side, normalize=False), cv2.boxFilter(changed, -1, side, normalize=False)
    return np.asarray(sums / np.maximum(number, 1)[..., None], np.float32) * (number > 0.5)[..., None]
