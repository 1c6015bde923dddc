#!/usr/bin/env python3
"""Encode a sequence with Ray: ray_driver.py FRAMES -o OUT.gss [--address ray://HEAD:10001] [-- options of encode]

Ray gives the shard of a worker that is lost to another one, and tries a shard that fails again. Needs `pip install ray`.
"""
import pathlib

import ray
import shards


def main():
    job = shards.arguments("Ray")
    # Every worker gets the modules of this folder.
    modules = {"working_dir": str(pathlib.Path(__file__).parent), "excludes": ["*.yaml", "*.sh", "*.md"]}
    cores = {} if job.address else {"num_cpus": job.workers * job.threads, "include_dashboard": False}
    ray.init(address=job.address, runtime_env=modules, log_to_driver=False, **cores)
    try:
        numbers = shards.make_plan(job)
        encode = ray.remote(shards.encode_shard).options(
            num_cpus=job.threads, max_retries=job.retries, retry_exceptions=True
        )
        coded, done = [encode.remote(job, number) for number in numbers], 0
        while coded:
            [shard], coded = ray.wait(coded)
            done += 1
            shards.tell(job, done, ray.get(shard))
    finally:
        ray.shutdown()
    shards.join(job)


if __name__ == "__main__":
    main()
