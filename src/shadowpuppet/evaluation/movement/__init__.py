"""The movement in a run, without a truth: steps and strides, joint angles over the gait cycle, ranges of motion."""
