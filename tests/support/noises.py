"""What several microphones hear of one room: steps, voices and claps, each with its own noise, echoes, loudness and way of the sound."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from scipy.signal import fftconvolve

SPEED_OF_SOUND = 343.0


def events(rng: np.random.Generator, seconds: float, rate: int, kinds: Sequence[str] = ("steps", "voice", "claps")) -> np.ndarray:
    """Sound of the room without echoes, (N,)."""
    sound, t = np.zeros(round(seconds * rate)), np.arange(round(0.3 * rate)) / rate
    times = {"steps": np.cumsum(rng.normal(0.55, 0.03, 200)), "voice": np.cumsum(rng.exponential(0.4, 200)),
             "claps": seconds * np.array([0.2, 0.33, 0.62]) + rng.uniform(0, 0.5, 3)}
    for kind in kinds:
        for time in times[kind][times[kind] < seconds - 0.4]:
            decay, tone = {"steps": (0.03, 120.0), "voice": (0.15, rng.uniform(150, 900)), "claps": (0.01, 0.0)}[kind]
            body = rng.standard_normal(len(t)) if kind != "voice" else sum(np.sin(2 * np.pi * tone * k * t) / k for k in range(1, 6))
            n = round(time * rate)
            sound[n : n + len(t)] += {"steps": 0.3, "voice": 0.3, "claps": 1.5}[kind] * np.exp(-t / decay) * body * rng.uniform(0.5, 1.5)
    return sound


def heard(rng: np.random.Generator, sound: np.ndarray, rate: int, late: float, *, way: float = 0.0, noise: float = 0.02,
          loudness: float = 0.3) -> np.ndarray:
    """What one microphone records: `late` seconds of silence of its own first (negative: it began later), `way` metres off."""
    echoes = np.zeros(round(0.4 * rate))
    echoes[0] = 1.0
    for _ in range(40):
        at = rng.uniform(0.003, 0.35)
        echoes[round(at * rate)] += 0.3 * rng.standard_normal() * np.exp(-at / 0.12)
    n = round((late + way / SPEED_OF_SOUND) * rate)
    room = fftconvolve(sound, echoes)[: len(sound)]
    moved = np.concatenate([np.zeros(max(n, 0)), room[max(-n, 0) :]])
    return (loudness * (moved + noise * rng.standard_normal(len(moved)))).clip(-1, 1)


def add_sound(film: Path, samples: np.ndarray, rate: int, codec: str = "aac", late: float = 0.0) -> None:
    """Put a sound (N,) beside a film's pictures, which are copied; it begins `late` seconds after them (negative: before)."""
    import av

    out = film.with_stem(f"{film.stem}-with-sound")
    with av.open(film) as source, av.open(out, "w") as target:
        pictures = source.streams.video[0]
        copied = target.add_stream_from_template(pictures)
        sound = target.add_stream(codec, rate=rate, layout="mono")
        for packet in source.demux(pictures):
            if packet.dts is not None:
                packet.stream = copied
                for name in ("pts", "dts"):
                    setattr(packet, name, getattr(packet, name) + round(max(-late, 0) / packet.time_base))
                target.mux(packet)
        block = sound.codec_context.frame_size or 1024
        for n in range(0, len(samples) - block, block):
            frame = av.AudioFrame.from_ndarray(samples[None, n : n + block].astype(np.float32), "fltp", "mono")
            frame.sample_rate, frame.pts = rate, n + round(max(late, 0) * rate)
            target.mux(sound.encode(frame))
        target.mux(sound.encode(None))
    out.replace(film)
