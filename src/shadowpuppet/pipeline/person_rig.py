"""Who is before several cameras, and what follows them: sizes from a file, from training motion or from a height, refined on the first
seconds; a motion prior; the tracker."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np

from shadowpuppet.body.anthropometry import AVERAGE_HEIGHT
from shadowpuppet.body.models import WHOLE, average_sizes, make_body
from shadowpuppet.body.sizes import BoneSizes
from shadowpuppet.errors import SettingsError, choices
from shadowpuppet.io.person import Person, read_person
from shadowpuppet.motion.motion import JointTable
from shadowpuppet.pipeline.footage_rig import Rig
from shadowpuppet.pipeline.learn_prior import familiar
from shadowpuppet.pipeline.look_rig import Opening
from shadowpuppet.pipeline.options import Options
from shadowpuppet.pipeline.track_rig import Puppet
from shadowpuppet.tracking.multiview.size_estimation import likely_height, measure, spread_of
from shadowpuppet.tracking.multiview.surface.visual_hull import VisualHull
from shadowpuppet.tracking.multiview.tracker import MultiviewTracker


def prepare_puppet(rng: np.random.Generator, rig: Rig, opening: Opening, options: Options, training: JointTable | None) -> Puppet:
    """Measure the person in the first seconds, and make the tracker. Raises a `ShadowPuppetError` where nobody is found, or a file does not
    fit."""
    settings = options.multiview
    if options.body not in (None, settings.body):
        raise SettingsError(f"body: found {options.body!r}, an upper body, for several cameras; expected one of {choices(WHOLE)}, "
                            "or one camera (--camera)")
    hull = VisualHull(rig.cameras, settings.hull)
    known = familiar(rng, options, training, settings.body, rig.rate / options.every)
    first = [(hull.points(masks), masks) for masks in opening.masks]
    height = options.height or rig.recording.subject.height
    if options.person is not None:
        sizes, source = read_person(options.person, settings.body).sizes, str(options.person)
        spread = np.zeros(len(sizes.names()))
    elif known.sizes is not None:
        sizes, source, spread = known.sizes, "training motion, and the hulls of the first seconds", spread_of(known.sizes, shown=True)
    else:
        seen = height or likely_height(rng, lambda tall: make_body(settings.body, average_sizes(settings.body, tall)), rig.cameras, first,
                                       settings) or AVERAGE_HEIGHT
        sizes = average_sizes(settings.body, seen)
        source = f"{'the height' if height else f'a height of {seen:.2f} m as seen'}, and the hulls of the first seconds"
        assert isinstance(sizes, BoneSizes)
        spread = spread_of(sizes, shown=False)
    library = known.poses if len(known.poses) else None
    person = measure(rng, partial(make_body, settings.body), sizes, spread, rig.cameras, first, settings, library)
    prior = known.prior if settings.method == "hybrid" else None
    tracker = MultiviewTracker(person.body, rig.cameras, settings, prior, library)
    told: dict[str, Any] = {"source": source, "overlap": round(person.overlap, 3), "residual": person.residual, "frames": person.frames,
                            "sizes": dict(zip(person.sizes.names(), map(float, person.sizes.to_array()), strict=True))}
    return Puppet(person.body, tracker, hull, told, (), Person(person.sizes, height, source))
