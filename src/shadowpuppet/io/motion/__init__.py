"""Motion files: one module per format; `motion_files` reads any of `READABLE`, `io.export` writes any of `EXPORTS`."""

READABLE = {
    ".amc": "AMC (Acclaim): a skeleton's angles, with its .asf", ".bvh": "BVH (Biovision): a skeleton and its angles",
    ".c3d": "C3D: points of a motion capture system", ".csv": "CSV: a table of joints", ".npz": "NPZ: arrays of a motion",
    ".parquet": "Parquet: a table of joints", ".trc": "TRC (Motion Analysis, OpenSim): a table of markers",
}  # fmt: skip
"""Endings of files that can be read, and the formats in words."""
EXPORTS = ("c3d", "trc", "csv", "npz", "bvh", "glb", "usda", "mot", "osim", "parquet")
"""Formats that can be written, in the order of `--to all`: formats that need person.toml, then the one that needs pyarrow, come last."""
