"""Fig. 3 and 4: a picture and its silhouette; a drawn model, a silhouette, and the pixels in which they differ."""

from __future__ import annotations

import numpy as np

from papers.common.experiment import Experiment, Outcome, Request, Table
from papers.liu2011.material import Case, cases
from papers.liu2011.repeats import repeat
from papers.liu2011.shown import stem, told
from shadowpuppet.camera.captions import WHITE, strip
from shadowpuppet.camera.drawing import in_colour
from shadowpuppet.camera.mask import Mask
from shadowpuppet.pipeline.footage import take_sample
from shadowpuppet.silhouette import SilhouetteSettings, learn_background
from shadowpuppet.video import Image

SCALE, GREYS = 1.4, 8


def make(request: Request) -> Outcome:
    """Both figures, of a frame in the middle of the second motion."""
    outcome = Outcome()
    for case in cases(request):
        run = repeat(request, case, case.tracker, runs=1)
        part = case.parts[min(1, len(case.parts) - 1)]
        n = int(np.abs(case.times - (part.start + 0.45 * (part.end - part.start))).argmin())
        model, mask = case.picture.mask(run.poses[0, n]), case.masks[n]
        counted = ~case.picture.legs(run.poses[0, n]) | ~mask
        image = case.frames([n])[0]
        tiles = {"observation": calm(image), "by eq. 1 alone": white(plain(case, image)), "as `track` makes it": white(mask)}
        outcome.pictures[stem("figure_3", request, case)] = row({k: v for k, v in tiles.items() if v is not None})
        outcome.pictures[stem("figure_4", request, case)] = row({"model h": white(model), "silhouette f": white(mask),
                                                                 "h xor f": white((model ^ mask) & counted)})
        counts = [int(each.sum()) for each in (model, mask, (model ^ mask) & counted)]
        outcome.tables[stem("figure_4", request, case)] = Table(("frame", "model_px", "silhouette_px", "cost_px"), [[n, *counts]])
        outcome.said.append(f"Fig. 4, frame {n}: the model has {counts[0]} pixels, the silhouette {counts[1]}, including the legs; "
                            f"{counts[2]} differ, which is the cost of eq. 2. The visible part of the legs, which the "
                            "model lacks, is not counted.")
        outcome.settings |= told(case)
    return outcome


def plain(case: Case, image: Image) -> Mask | None:
    """A frame's mask by eq. 1 alone; None where there is no film of the empty scene to learn deviations from."""
    footage = case.footage
    if footage.view.background is None:
        return None
    empty, film = footage.pictures(footage.view.background, "the empty scene"), [frame.image for frame in take_sample(footage).frames]
    return learn_background(empty, SilhouetteSettings(method="averaging"), film=film).raw(image)


def calm(image: Image) -> Image:
    """A picture without its noise, which would not compress."""
    import cv2

    return np.asarray(cv2.bilateralFilter(in_colour(image), 7, 30, 3) // GREYS * GREYS, np.uint8)


def white(mask: Mask | None) -> Image | None:
    """A mask, white on black."""
    return None if mask is None else np.repeat(np.uint8(255) * np.asarray(mask, np.uint8)[..., None], 3, axis=2)


def row(tiles: dict[str, Image | None]) -> Image:
    """Pictures side by side, each with its name."""
    import cv2

    out = []
    for name, tile in tiles.items():
        assert tile is not None
        size = round(tile.shape[1] * SCALE), round(tile.shape[0] * SCALE)
        large = np.asarray(cv2.resize(tile, size, interpolation=cv2.INTER_NEAREST), np.uint8)
        large = np.concatenate([strip(size[0], [[(name, WHITE)]]), large])
        out.append(np.pad(large, ((0, 0), (0, 4), (0, 0)), constant_values=128))
    return np.concatenate(out, axis=1)


EXPERIMENT = Experiment("figure_3_4", "Fig. 3, 4: segmentation, and silhouette matching", "some seconds", make)
