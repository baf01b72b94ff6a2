"""Timecodes put into films."""

from __future__ import annotations

from pathlib import Path

import av


def add_timecode(path: Path, timecode: str, suffix: str | None = None) -> Path:
    """Write the film again with a timecode, in the place of the old one or, with another `suffix`, beside it; returns its path."""
    target = path.with_suffix(suffix or path.suffix)
    beside = path.with_name(f"timecoded{target.suffix}")
    with av.open(str(path)) as old, av.open(str(beside), "w") as new:
        new.metadata["timecode"] = timecode
        stream = new.add_stream_from_template(old.streams.video[0])
        for packet in old.demux(video=0):
            if packet.dts is not None:
                packet.stream = stream
                new.mux(packet)
    beside.replace(target)
    return target
