"""Motion files: one module per format; `motion_files` reads any of `READABLE`, `io.export` writes any of `EXPORTS`."""

READABLE = (".amc", ".bvh", ".c3d", ".csv", ".npz", ".parquet", ".trc")
EXPORTS = ("c3d", "trc", "csv", "npz", "bvh", "glb", "usda", "mot", "osim", "parquet")
"""Formats that can be written, in the order of `--to all`: formats that need person.toml, then the one that needs pyarrow, come last."""
