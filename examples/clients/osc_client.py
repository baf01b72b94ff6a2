"""Prints where a hand is, from `shadowpuppet live --osc 39539`; needs `pip install python-osc scipy`.

    python examples/clients/osc_client.py [--port 39539] [--side left]

Bones come relative to their parents (Virtual Motion Capture protocol) and are put together from the hips on. Metres in Unity's axes: X
right, Y up, Z forward, left-handed. The age is the time from a picture's capture until its frame was sent.
"""

import argparse
import contextlib

import numpy as np
from pythonosc.dispatcher import Dispatcher
from pythonosc.osc_server import BlockingOSCUDPServer
from scipy.spatial.transform import Rotation

parser = argparse.ArgumentParser()
parser.add_argument("--port", type=int, default=39539)
parser.add_argument("--side", choices=("left", "right"), default="left")
args = parser.parse_args()
CHAIN = ("Hips", "Spine", *(args.side.title() + bone for bone in ("UpperArm", "LowerArm", "Hand")))
bones = {}


def show(_, seconds):
    """Print the hand at the last message of a frame, and start the next one. Without bones the person is lost or absent."""
    place, turn = np.zeros(3), Rotation.identity()
    for bone in filter(bones.get, CHAIN):
        place, turn = place + turn.apply(bones[bone][:3]), turn * Rotation.from_quat(bones[bone][3:])
    if "Hips" in bones:
        x, y, z = place
        print(f"{seconds:.3f} s: {args.side} hand at {x:.3f} {y:.3f} {z:.3f} m, {1000 * bones.get('age', 0.0):.0f} ms old", flush=True)
    else:
        print(f"{seconds:.3f} s: nobody", flush=True)
    bones.clear()


dispatcher = Dispatcher()
dispatcher.map("/VMC/Ext/Bone/Pos", lambda _, name, *values: bones.update({name: values}))
dispatcher.map("/shadowpuppet/age", lambda _, age: bones.update(age=age))
dispatcher.map("/VMC/Ext/T", show)
with contextlib.suppress(KeyboardInterrupt):
    BlockingOSCUDPServer(("127.0.0.1", args.port), dispatcher).serve_forever()
