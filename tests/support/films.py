"""Films as other programs write them, of pictures that all differ."""

from __future__ import annotations

from fractions import Fraction

import numpy as np

RATE = 10


def pictures(n=12, size=(32, 24), grey=False, seed=1):
    """A moving noise picture: every frame differs from every other."""
    shape = (size[1], size[0]) if grey else (size[1], size[0], 3)
    base = np.random.default_rng(seed).integers(0, 256, shape, np.uint8)
    return [np.roll(base, i, 1) for i in range(n)]


def encoded(path, images, *, codec="libx264", pixels="yuv420p", stamps=None, base=Fraction(1, 1000), container=None,
            pixel=None, **settings):
    """A film as other programs write it: any codec, pixel format and times (in units of `base`); `pixel`: width of a pixel over height."""
    import av

    with av.open(str(path), "w", options=container or {}) as output:
        stream = output.add_stream(codec, rate=RATE, options=settings)
        stream.width, stream.height, stream.pix_fmt = images[0].shape[1], images[0].shape[0], pixels
        stream.codec_context.time_base = base
        if pixel is not None:
            stream.codec_context.sample_aspect_ratio = pixel
        for i, image in enumerate(images):
            frame = av.VideoFrame.from_ndarray(image, format="bgr24" if image.ndim == 3 else "gray")
            frame.pts, frame.time_base = (stamps[i] if stamps else round(i / RATE / base)), base
            output.mux(stream.encode(frame))
        output.mux(stream.encode(None))
    return path


def packets(path):
    """Where each frame's data begin and end in the file."""
    import av

    with av.open(str(path)) as container:
        header = 8 if path.suffix == ".avi" else 0  # of the chunk, which PyAV's place includes
        return [(p.pos, p.pos + header + p.size) for p in container.demux(video=0) if p.size]
