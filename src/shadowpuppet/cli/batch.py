"""The command `batch`: many recordings, seeds and settings."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from cyclopts import Group, Parameter

from shadowpuppet.cli.flags import OTHER, Quiet, flag, flags_of, given, output, switch, unpacked
from shadowpuppet.cli.tables import files_in, pairs, show, table
from shadowpuppet.errors import SOME_FAILED
from shadowpuppet.pipeline.options import Options

if TYPE_CHECKING:
    from shadowpuppet.pipeline.batch.run import Batch

    BatchFlags = Any
else:
    BatchFlags = unpacked(flags_of(Options, without=("seed",)))
    """Options that runs with different seeds share."""

WORK = Group("Work", sort_key=0.5)


def batch(recordings: Annotated[list[Path], Parameter(help="Recordings, as `track` takes them.")], /, *,
          folder: Annotated[Path, output("Folder of the batch: new, or an earlier one's, which is continued.")],
          config: Annotated[Path | None, flag("Settings file, TOML, with seeds, [grid] and [case.NAME].")] = None,
          seeds: Annotated[str | None, flag("Seeds: 0:10 is 0 to 9; or 1,5,9. [default: the file's, or 0]")] = None,
          workers: Annotated[int | None, flag("Processes; 0 for this one alone. [default: one a core]", WORK)] = None,
          threads: Annotated[int, flag("Threads of each process.", WORK)] = 1,
          retries: Annotated[int, flag("Further tries of a run that the machine failed: a killed worker, a full disk.", WORK)] = 1,
          scheduler: Annotated[str | None, flag("Address or file of a Dask scheduler, whose workers do the work.", WORK)] = None,
          afresh: Annotated[bool, switch("Segment the film again for every run, to measure speed.", WORK)] = False,
          table: Annotated[Literal["csv", "parquet"], flag("Format of the summary.", OTHER)] = "csv",
          quiet: Quiet = False,
          flags: BatchFlags = None) -> int:  # fmt: skip
    """Track many recordings, with many seeds and settings: a run folder each in OUT/runs, and a table of all in OUT/summary.csv.

    The same command again does what is missing or failed. Exit code 3: some runs failed, the others are done.
    """
    from shadowpuppet.cli.batch_terminal import batch_terminal
    from shadowpuppet.pipeline.batch.grid import make_grid, read_grid, seeds_of
    from shadowpuppet.pipeline.batch.plot import can_plot, plot_batch
    from shadowpuppet.pipeline.batch.run import run_batch

    grid = read_grid(config, given(flags)) if config is not None else make_grid(flags=given(flags))
    with batch_terminal(quiet) as listener:
        found = run_batch(recordings, folder, grid, None if seeds is None else seeds_of(seeds, "flags: seeds"), workers=workers,
                          retries=retries, threads=threads, scheduler=scheduler, reuse=not afresh, table=table, listener=listener)
        listener.failures(found)
    if can_plot():
        plot_batch(found.runs, folder / "summary.png")
    if not quiet:
        show(_summary(found), pairs([files_in(found.folder, f"summary.{table}", "summary.png")]))
    return SOME_FAILED if found.failed else 0


def _summary(batch: Batch) -> Any:
    """Table with a row per recording and choice of settings: mean and standard deviation over the seeds."""
    import numpy as np

    from shadowpuppet.pipeline.batch.plot import MEASURES, measured, rows_of

    rows = []
    for (name, choice), runs in rows_of(batch.runs).items():
        done = [run for run in runs if run.status == "done"]
        count = str(len(done)) if len(done) == len(runs) else f"{len(done)} of {len(runs)}"
        figures = [_spread([measured(run, place) for run in done], digits) for (place, _), digits in zip(MEASURES, (1, 3))]
        seconds = [run.seconds for run in done if run.seconds is not None]
        rows.append((name, choice, count, *figures, f"{np.median(seconds):.1f}" if seconds else ""))
    out = table("", ("recording", "settings", "runs", "error, mm", "overlap", "s"), rows, right=(2, 3, 4, 5))
    for column in out.columns[:2]:  # in a narrow terminal names are folded, and figures stay whole
        column.no_wrap, column.overflow = False, "fold"
    return out


def _spread(values: Sequence[float], digits: int) -> str:
    import numpy as np

    known = np.array([value for value in values if np.isfinite(value)])
    if not len(known):
        return ""
    return f"{known.mean():.{digits}f}" + (f" ± {known.std(ddof=1):.{digits}f}" if len(known) > 1 else "")
