"""Poses and joints over time: tables, clocks, inverse kinematics, basic metrics."""
