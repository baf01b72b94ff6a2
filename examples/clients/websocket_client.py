"""Prints where a joint is, from `shadowpuppet live --websocket 8601`; needs `pip install websockets`.

    python examples/clients/websocket_client.py [--address ws://127.0.0.1:8601] [--joint left_hand]

Metres in the calibration's world: right-handed, Z up. The age is the time from a picture's capture until its frame was sent.
"""

import argparse
import contextlib
import json
import sys

from websockets.sync.client import connect

parser = argparse.ArgumentParser()
parser.add_argument("--address", default="ws://127.0.0.1:8601")
parser.add_argument("--joint", default="left_hand")
args = parser.parse_args()

try:
    session = connect(args.address)
except OSError as error:
    sys.exit(f"nothing at {args.address} ({error}): start `shadowpuppet live ... --websocket 8601` or `play RUN --websocket 8601`")
with session, contextlib.suppress(KeyboardInterrupt, BrokenPipeError):
    for message in map(json.loads, session):
        if message["type"] == "begin":
            if args.joint not in message["joints"]:
                sys.exit(f"--joint: found {args.joint!r}, expected one of {', '.join(message['joints'])}")
            number = message["joints"].index(args.joint)
        elif message["joints"] is not None:
            x, y, z = message["joints"][number]
            age = 1000 * (message["age"] or 0.0)
            print(f"{message['time']:.3f} s: {args.joint} at {x:.3f} {y:.3f} {z:.3f} m, {age:.0f} ms old", flush=True)
        else:
            print(f"{message['time']:.3f} s: {message['status']}", flush=True)
