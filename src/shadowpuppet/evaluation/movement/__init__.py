"""What a run says about the movement itself, without a truth: steps and strides, joint angles over the gait cycle, ranges of motion."""
