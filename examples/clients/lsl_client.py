"""Prints where a joint is, from `shadowpuppet live --lsl puppet`; needs `pip install pylsl`.

    python examples/clients/lsl_client.py [--stream puppet] [--joint left_hand]

Metres in the calibration's world: right-handed, Z up; NaN without a pose. A sample is stamped with its picture's capture.
"""

import argparse

from pylsl import StreamInlet, local_clock, resolve_byprop

parser = argparse.ArgumentParser()
parser.add_argument("--stream", default="puppet")
parser.add_argument("--joint", default="left_hand")
args = parser.parse_args()

while not (found := resolve_byprop("name", args.stream, timeout=1.0)):
    pass  # the stream is announced when the person was measured
inlet = StreamInlet(found[0])
first = inlet.info().get_channel_labels().index(f"{args.joint}_PositionX")
while True:
    sample, stamp = inlet.pull_sample()
    x, y, z = sample[first : first + 3]
    age = local_clock() - stamp - inlet.time_correction()
    print(f"{args.joint} at {x:.3f} {y:.3f} {z:.3f} m, {1000 * age:.0f} ms old", flush=True)
