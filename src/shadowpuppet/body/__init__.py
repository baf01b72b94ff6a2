"""The jointed person: skeleton, sizes, shapes, models by name, kinematics."""
