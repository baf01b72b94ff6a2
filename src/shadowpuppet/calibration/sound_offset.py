"""Time offsets between films from their sound: a clap, steps, voices and the room's noise are heard by all microphones.

What two microphones share are onsets: moments at which the sound of a band of frequencies grows. The shift at which the onsets of two films
are most alike is their offset. Levels, distance and echoes change an onset's strength more than its moment.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations

import numpy as np
from numpy.typing import NDArray
from scipy.fft import next_fast_len
from scipy.signal import ShortTimeFFT, windows

from shadowpuppet.calibration.clock_offset import ClockOffsets, PairOffset, offsets_of_pairs
from shadowpuppet.geometry import Array

RATE = 8000
"""Samples/s that suffice."""
WINDOW, HOP = 128, 20
"""Samples of a spectrum, 16 ms, and from one to the next, 2.5 ms."""
EDGE = WINDOW // HOP + 2
"""Spectra at either end that are in part before the beginning or after the end."""
BANDS = ((100, 300), (300, 600), (600, 1000), (1000, 1500), (1500, 2200), (2200, 3000), (3000, 3900))
"""Limits of the bands, Hz."""
LOUDEST = 25.0
"""Onsets over this number of standard deviations count as much as that: one bang does not decide alone. With a lower limit a clap's echoes
would count as much as the clap."""
MIN_OVERLAP = 2.0
"""Least time, seconds, that two films have in common."""
LEAST_RATIO, RIVAL = 1.6, 0.1
"""The best shift's likeness, over the median of all, must be this ratio of that of the best shift farther away than `RIVAL` seconds: steps
and music repeat themselves, and what is not shared has several shifts that are alike."""
MOMENT, CONFIRMED = 0.3, 5.0
"""Half the length (s) of a moment, with its echoes; and robust standard deviations by which the likeness without the moment that counts
most must still exceed the median of all shifts: 0 to 2 where nothing else is shared, 8 and more where something is."""
SPEED_OF_SOUND = 343.0
PRECISION = 0.002
"""Standard deviation of an offset without echoes, seconds."""


def sound_offsets(names: Sequence[str], sounds: Sequence[Array | NDArray[np.float32] | None], begins: Sequence[float],
                  centres: Array) -> ClockOffsets:
    """Offsets of films from their sound.

    Args:
        names: of the cameras.
        sounds: samples (N,) at `RATE`; None for films without sound.
        begins: time of each film's first sample on the clock of its pictures, seconds.
        centres: places of the cameras, (C, 3), metres; microphones are taken to be there.
    """
    onsets = [None if sound is None else onset_strengths(sound) for sound in sounds]
    pairs = []
    for i, j in combinations(range(len(names)), 2):
        first, second = onsets[i], onsets[j]
        shift = None if first is None or second is None else best_shift(first, second)
        if shift is not None:
            way = float(np.linalg.norm(centres[i] - centres[j])) / SPEED_OF_SOUND / np.sqrt(3)  # it comes from anywhere between the two
            pairs.append(PairOffset(i, j, shift + begins[j] - begins[i], float(np.hypot(PRECISION, way))))
    return offsets_of_pairs(names, pairs)


def onset_strengths(samples: Array | NDArray[np.float32]) -> Array:
    """Growth of the sound in each band, (B, F), a column every `HOP` samples: zero mean, standard deviation one, cut at `LOUDEST`."""
    spectrum = ShortTimeFFT(windows.hann(WINDOW), HOP, RATE)
    power = np.abs(spectrum.stft(np.asarray(samples, float), p0=0, p1=max(1, len(samples) // HOP))) ** 2
    bands = np.array([power[(spectrum.f >= low) & (spectrum.f < high)].sum(0) for low, high in BANDS])
    levels = np.log(bands + 1e-3 * bands.mean(1, keepdims=True) + 1e-12)
    growth = np.maximum(np.diff(levels, axis=1, prepend=levels[:, :1]), 0)
    growth[:, :EDGE] = growth[:, -EDGE:] = 0  # where a recording begins and ends is no onset
    growth -= growth.mean(1, keepdims=True)
    deviation = growth.std(1, keepdims=True)
    return np.minimum(growth / np.where(deviation > 1e-9, deviation, np.inf), LOUDEST)


def best_shift(first: Array, second: Array) -> float | None:
    """Seconds by which the onsets (B, F) come later in the second sound; None if no shift stands out, or one moment alone tells it: two
    films of different bangs are as alike at the shift that lays one on the other as two films of the same."""
    found = _likenesses(first, second)
    if found is None:
        return None
    lags, likeness = found
    middle = float(np.median(likeness))
    best = int(np.argmax(likeness))
    rivals = likeness[np.abs(lags - lags[best]) * HOP > RIVAL * RATE]
    height = likeness[best] - middle
    if height <= 0 or height < LEAST_RATIO * (rivals.max() - middle) or not _is_confirmed(first, second, int(lags[best])):
        return None
    return float(lags[best] + _summit(likeness, best)) * HOP / RATE


def _likenesses(first: Array, second: Array) -> tuple[NDArray[np.int64], Array] | None:
    """Shifts (L,) of onsets (B, F), in spectra, and how alike both are at each, per root of what they have in common; None if too few."""
    n, m = first.shape[1], second.shape[1]
    size = next_fast_len(n + m)
    likeness = np.fft.irfft((np.conj(np.fft.rfft(first, size)) * np.fft.rfft(second, size)).sum(0), size)
    lags = np.arange(-n + 1, m)  # second[k + lag] beside first[k]
    common = np.minimum(n, m - lags) - np.maximum(0, -lags)
    enough = common * HOP >= MIN_OVERLAP * RATE
    return (lags[enough], likeness[lags[enough]] / np.sqrt(common[enough])) if enough.sum() >= 100 else None


def _is_confirmed(first: Array, second: Array, lag: int) -> bool:
    """Whether the onsets (B, F) are alike at a shift also without the moment that counts most there."""
    begin, end = max(0, -lag), min(first.shape[1], second.shape[1] - lag)
    shared = (first[:, begin:end] * second[:, begin + lag : end + lag]).sum(0)
    moment, reach = begin + int(np.argmax(shared)), round(MOMENT * RATE / HOP)
    rest = first.copy()
    rest[:, max(moment - reach, 0) : moment + reach] = 0
    found = _likenesses(rest, second)
    assert found is not None
    lags, likeness = found
    above = likeness - np.median(likeness)
    return bool(above[np.abs(lags - lag) <= 2].max() > CONFIRMED * 1.4826 * np.median(np.abs(above)))


def _summit(values: Array, k: int) -> float:
    """Place of the parabola's summit through a greatest value and its neighbours, from that value."""
    if not 0 < k < len(values) - 1:
        return 0.0
    before, at, after = values[k - 1 : k + 2]
    bend = before - 2 * at + after
    return float(0.5 * (before - after) / bend) if bend < 0 else 0.0
