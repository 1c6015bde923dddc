#!/usr/bin/env python3
"""Encode a sequence with Dask: dask_driver.py FRAMES -o OUT.gss [--address tcp://SCHEDULER:8786] [-- options of encode]

Dask gives the shard of a worker that is lost to another one, and tries a shard that fails again. Needs `pip install distributed`.
"""
import shards
from dask.distributed import Client, as_completed


def cluster(job):
    """A client of the cluster, or of one with processes on this machine."""
    if job.address:
        client = Client(job.address)
        client.upload_file(shards.__file__)
        return client
    return Client(n_workers=job.workers, threads_per_worker=1, dashboard_address=None)


def main():
    job = shards.arguments("Dask")
    with cluster(job) as client:
        numbers = shards.make_plan(job)
        # Not pure: a shard whose file has gone is encoded again.
        coded = client.map(shards.encode_shard, [job] * len(numbers), numbers, retries=job.retries, pure=False)
        for done, future in enumerate(as_completed(coded), 1):
            shards.tell(job, done, future.result())
    shards.join(job)


if __name__ == "__main__":
    main()
