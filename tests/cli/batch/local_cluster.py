"""A dask cluster of this machine: prints its address and its workers, and lasts until its input is closed."""

import os
import sys

from distributed import LocalCluster


def main() -> None:
    with LocalCluster(
        host="127.0.0.1", n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None, silence_logs=50
    ) as cluster:
        pids = [nanny.pid for nanny in cluster.workers.values()]
        sys.stdout.write(f"{cluster.scheduler_address} {' '.join(map(str, pids))}\n")
        sys.stdout.flush()
        sys.stdin.read()


if __name__ == "__main__":
    os.environ["PYTHONWARNINGS"] = "ignore"
    main()
