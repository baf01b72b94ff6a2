"""Three examples of each command, which its `--help` ends with."""

from __future__ import annotations

EXAMPLES: dict[str, dict[str, str]] = {
    "track": {
        "lab --overlay": "several calibrated cameras; the body drawn over the films",
        "mine.mp4 --fov 65 --height 1.75": "one film of a phone held across",
        "lab --evidence keypoints -o run-net": "by a detector's keypoints alone",
    },
    "live": {
        "0 --height 1.80": "the first camera of this machine",
        "--camera 0,1,2 --calibration lab.toml": "three cameras",
        "0 --height 1.80 --osc 39539": "moves an avatar (VMC)",
    },
    "info": {
        "lab": "good or bad, why, and what helps",
        "lab/calibration.toml": "where the cameras stand, and what they see",
        "rig.xcp --to lab/calibration.toml": "writes a calibration in our format",
    },
    "calibrate": {
        "--print-board board.pdf": "a board to print",
        "lab": "lenses, places and floor from films of it",
        "lab/walking --from-person --height 1.75": "places from a person who walks",
    },
    "check": {
        "lab": "do the cameras agree, do the films begin together",
        "lab --fix": "writes down what is certain",
        "lab --json": "for a program",
    },
    "masks": {
        "--list": "programs that are known",
        "lab -o lab-masks --with mediapipe": "silhouettes by one of them",
        "lab -o lab-masks --with mine.py": "by a script of your own (--template)",
    },
    "keypoints": {
        "lab -o lab-net": "by MediaPipe, in an environment of its own",
        "lab -o lab-net --with mine.py": "by a script of your own",
        "--template mine.py": "begins such a script",
    },
    "view": {
        "run-lab": "the page in a browser",
        "run-lab --html run-lab.html": "the same as one file",
        "run-lab run-net": "two runs, side by side",
    },
    "evaluate": {
        "run-lab": "against the recording's own truth",
        "run-lab truth.trc --report page.html": "against a file, with a report",
        "run-lab --movement steps.csv": "steps, strides, angles of the gait",
    },
    "export": {
        "run-lab --to trc,mot,osim": "for OpenSim",
        "run-lab --to bvh,glb --rest t --names mixamo": "for Blender and game engines",
        "run-lab --to all -o files": "everything",
    },
    "synthesize": {
        "-o sample": "one camera, known truth",
        "-o ring --cameras 7 --motion random --seconds 8": "seven cameras",
        "--cameras 7 --show-spec": "a spec file to change",
    },
    "demo": {
        "": "into shadowpuppet-demo/",
        "-o there --seed 3": "other noise",
        "--preset liu2011": "as in the paper",
    },
    "batch": {
        "day1/a day1/b -o out --seeds 0:10": "ten seeds of each",
        "day1/a -o out --table parquet": "the table of results for pandas",
        "day1/a -o out --scheduler tcp://node0:8786": "on a cluster",
    },
    "completion": {"bash": "for ~/.bashrc", "zsh": "for ~/.zshrc", "fish": "for config.fish"},
    "convert": {
        "walk.csv walk.c3d": "joints",
        "walk.bvh walk.trc --rate 30": "thirty frames a second",
        "walk.c3d walk.csv --source-unit mm": "a file that does not tell its unit",
    },
    "doctor": {"": "what works here", "--warm": "compiles all kernels now", "--json": "for a program"},
    "fit-person": {
        "lab -o me.toml": "sizes, for --person of other runs",
        "lab -o me.toml --height 1.75": "of a known height",
        "mine.mp4 -o me.toml --fov 65 --height 1.75": "from one film",
    },
    "fit-prior": {
        "lab/training.trc -o walk.npz": "a motion prior, for --prior",
        "a.bvh b.bvh -o both.npz --regions 20": "of two films",
        "walk.amc -o walk.npz --mirrored": "and of its mirror image",
    },
    "play": {
        "run-lab --websocket 8601": "a run as if it were live, JSON",
        "run-lab --osc 39539 --loop": "for avatars, over and over",
        "run-lab --lsl mocap --speed 2": "as a stream of LSL, twice as fast",
    },
    "settings": {"": "every setting of the default preset", "--preset ni2008": "those of a paper", "--preset liu2011": "and the other's"},
}


def epilogue(command: str) -> str:
    """The last lines of a command's help."""
    lines = ((f"shadowpuppet {command} {arguments}".rstrip(), what) for arguments, what in EXAMPLES[command].items())
    return "\n".join(["Examples:\n", *(f"    {line}\n        {what}" for line, what in lines)])
