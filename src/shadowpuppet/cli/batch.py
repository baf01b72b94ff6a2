"""The command about many runs."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

from cyclopts import Group, Parameter

from shadowpuppet.cli.flags import OTHER, RUN, BatchFlags, Quiet, given, output
from shadowpuppet.errors import SOME_FAILED

WORK = Group("Work", sort_key=0.5)
ForBatch = Annotated[BatchFlags | None, Parameter(name="*")]


def flag(group: Group, help: str) -> Parameter:
    """A flag under a heading of `--help`."""
    return Parameter(group=group, help=help)


def switch(group: Group, help: str) -> Parameter:
    """A flag that is there or not."""
    return Parameter(group=group, help=help, negative=(), show_default=False)


def batch(recordings: Annotated[list[Path], Parameter(help="Recordings, as `track` takes them.")], /, *,
          folder: Annotated[Path, output("Folder of the batch: new, or an earlier one's, which goes on.")],
          config: Annotated[Path | None, flag(RUN, "File of settings, TOML, with seeds, [grid] and [case.NAME].")] = None,
          seeds: Annotated[str | None, flag(RUN, "Seeds: 0:10 is 0 to 9; or 1,5,9. [default: the file's, or 0]")] = None,
          workers: Annotated[int | None, flag(WORK, "Processes; 0 for none but this one. [default: one a core]")] = None,
          threads: Annotated[int, flag(WORK, "Threads that each may use.")] = 1,
          retries: Annotated[int, flag(WORK, "Further tries of a run that failed of the machine: a killed worker, a full disk.")] = 1,
          scheduler: Annotated[str | None, flag(WORK, "Address or file of a Dask scheduler, whose workers do the work.")] = None,
          afresh: Annotated[bool, switch(WORK, "Make silhouettes anew for every run, to measure speed.")] = False,
          table: Annotated[Literal["csv", "parquet"], flag(OTHER, "Format of the summary.")] = "csv",
          quiet: Quiet = False,
          flags: ForBatch = None) -> int:  # fmt: skip
    """Track many recordings, with many seeds and settings: a run folder each in OUT/runs, and a table of all in OUT/summary.csv.

    Begun again, it does what is missing or failed. Exit code 3: some runs failed, the others are done.
    """
    from shadowpuppet.cli.batch_terminal import batch_table, batch_terminal
    from shadowpuppet.cli.terminal import show
    from shadowpuppet.pipeline.batch.grid import make_grid, read_grid, seeds_of
    from shadowpuppet.pipeline.batch.plot import can_plot, plot_batch
    from shadowpuppet.pipeline.batch.run import run_batch

    grid = read_grid(config, given(flags)) if config is not None else make_grid(flags=given(flags))
    with batch_terminal(quiet) as shown:
        found = run_batch(recordings, folder, grid, None if seeds is None else seeds_of(seeds, "flags: seeds"), workers=workers,
                          retries=retries, threads=threads, scheduler=scheduler, reuse=not afresh, table=table, listener=shown)
        shown.failures(found)
    if can_plot():
        plot_batch(found.runs, folder / "summary.png")
    if not quiet:
        show(*batch_table(found, table))
    return SOME_FAILED if found.failed else 0
