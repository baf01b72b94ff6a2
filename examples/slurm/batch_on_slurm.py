"""A batch on a SLURM cluster: python batch_on_slurm.py OUT RECORDING...

Start it on a node that can submit jobs, in `tmux` or in a small job; it runs until the batch is finished. It needs
`pip install 'shadowpuppet[batch]' dask-jobqueue`, the same environment on all nodes, and recordings and OUT in a folder that all nodes can
access. Started again with the same arguments, it does the missing runs.
"""

from __future__ import annotations

import sys

from dask_jobqueue import SLURMCluster  # pyright: ignore[reportMissingImports]

from shadowpuppet.pipeline.batch import BatchListener, make_grid, run_batch


class Lines(BatchListener):
    """Prints one line per run."""

    def ended(self, task, outcome, again):
        print(task.label, outcome["status"], outcome.get("message", ""), "; again" if again else "", flush=True)


def main(out: str, *recordings: str) -> int:
    """Run the batch with one job per core; the number of jobs follows the remaining work."""
    cluster = SLURMCluster(
        queue="short",  # the partition's name, as `sinfo` lists it
        cores=1, processes=1, memory="2GB", walltime="04:00:00",
        job_script_prologue=["export SHADOWPUPPET_THREADS=1"],
        scheduler_options={"dashboard_address": None},
    )  # fmt: skip
    cluster.adapt(minimum_jobs=1, maximum_jobs=64)
    grid = make_grid({"preset": "liu2011"}, cases={"drs": {}, "srs": {"tracker": {"resampling": "stratified"}}})
    batch = run_batch(recordings, out, grid, seeds=range(100), retries=2, scheduler=cluster.scheduler_address, listener=Lines())
    cluster.close()
    print(f"{len(batch.runs) - len(batch.failed)} of {len(batch.runs)} runs are done; {batch.folder}/summary.csv has them all")
    return 3 if batch.failed else 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
