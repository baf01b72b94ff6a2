"""Motion blur of a film from what limbs cover between two frames."""

import numpy as np
import pytest

from shadowpuppet.silhouette.correction.condition import BLURRED
from shadowpuppet.silhouette.correction.motion_blur import LEAST_PIXELS, blurred_share


def film(span, step=10, frames=4):
    """Pictures (H, W, 3) of a bar that moves `step` pixels a frame, each averaged over `span` frames, and its masks."""
    images, masks = [], []
    for n in range(frames):
        shots = []
        for part in range(span):
            one = np.full((40, 120, 3), 60, np.uint8)
            left = 20 + step * (n + part)
            one[5:35, left : left + 40] = 180
            shots.append(one)
        images.append(np.mean(shots, 0).astype(np.uint8))
        masks.append(images[-1][..., 0] > 90)
    return [images], [masks]


def test_a_short_exposure_has_few_mixtures_and_a_long_one_many():
    sharp, blurred = (blurred_share(*film(span)) for span in (1, 2))
    assert sharp is not None
    assert blurred is not None
    assert sharp < 0.2 < BLURRED < blurred


def test_slow_or_no_movement_tells_nothing():
    assert blurred_share(*film(1, step=0)) is None
    assert blurred_share(*film(1, step=2)) is None
    assert LEAST_PIXELS > 0


def test_what_is_far_from_the_person_plays_no_part(rng):
    (images,), (masks,) = film(2)
    wide = [rng.integers(0, 255, (160, 240, 3)).astype(np.uint8) for _ in images]
    for one, image in zip(wide, images):
        one[60:100, 60:180] = image
    around = [np.pad(mask, [(60, 60), (60, 60)]) for mask in masks]
    assert blurred_share([wide], [around]) == blurred_share([images], [masks])


@pytest.mark.parametrize("frames", [0, 1, 2])
def test_runs_of_fewer_than_three_frames_tell_nothing(frames):
    assert blurred_share(*film(1, frames=frames)) is None
