"""What the drivers of this folder have in common: a plan, its shards, one stream.

Inputs, plan and shards lie in folders that every machine sees under the same names. A shard gets its name when it is whole, so
that one which is there is done: a driver that was stopped goes on where it was.
"""
import argparse
import json
import pathlib
import subprocess
import sys
import time


def arguments(engine):
    """The arguments of a driver. Those behind -- are options of `splatstream encode`, the same for the plan and for all shards."""
    parser = argparse.ArgumentParser(
        description=f"Encode a sequence with {engine}.",
        usage="%(prog)s FRAMES -o OUT.gss [options] [-- options of splatstream encode]",
    )
    parser.add_argument("frames", type=pathlib.Path, help="a folder of frames")
    parser.add_argument("-o", "--out", required=True, type=pathlib.Path, help="the stream")
    parser.add_argument("--shards", type=int, help="parts of the sequence [default: one for each GOP]")
    parser.add_argument("--scratch", type=pathlib.Path, default="shards", help="where plan and shards go [default: %(default)s]")
    parser.add_argument("--address", help="of the cluster [default: one is started on this machine]")
    parser.add_argument("--workers", type=int, default=2, help="of a cluster on this machine [default: %(default)s]")
    parser.add_argument("--threads", type=int, default=1, help="of each worker [default: %(default)s]")
    parser.add_argument("--retries", type=int, default=3, help="of a shard that fails [default: %(default)s]")
    parser.add_argument("--splatstream", default="splatstream", help="the command [default: %(default)s]")
    words = sys.argv[1:]
    split = words.index("--") if "--" in words else len(words)
    job = parser.parse_args(words[:split])
    job.options = words[split + 1 :]
    for name in ("frames", "out", "scratch"):
        # Workers run in other folders.
        setattr(job, name, getattr(job, name).resolve())
    if pathlib.Path(job.splatstream).exists():
        job.splatstream = str(pathlib.Path(job.splatstream).resolve())
    return job


def splatstream(job, *words):
    """Runs the command, and gives its report. What it complains about is in the error."""
    command = [job.splatstream, *map(str, words), "--json"]
    ended = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    if ended.returncode:
        raise RuntimeError(f"{' '.join(command)}: {ended.stderr.strip()}")
    return json.loads(ended.stdout)


def make_plan(job):
    """Writes the plan. Shards of another plan are left alone: each plan has a folder of its own, named by its digest."""
    job.scratch.mkdir(parents=True, exist_ok=True)
    plan = job.scratch / "plan.json"
    report = splatstream(job, "encode", job.frames, "--write-plan", "-o", plan, *job.options)
    job.folder = job.scratch / report["digest"]
    job.folder.mkdir(exist_ok=True)
    job.plan = plan.rename(job.folder / plan.name)
    job.shards = min(job.shards or report["most_shards"], report["most_shards"])
    print(f"plan: {report['frames']} frames, {job.shards} shards, {report['seconds']:.1f} s", flush=True)
    return range(1, job.shards + 1)


def shard_file(job, number):
    return job.folder / f"shard-{number:06}-of-{job.shards:06}.gss"


def encode_shard(job, number):
    """Encodes a shard, unless it is there; gives its number and the seconds that it took."""
    start, out = time.monotonic(), shard_file(job, number)
    if not out.exists():
        part = ["--plan", job.plan, "--shard", f"{number}/{job.shards}", "--threads", job.threads]
        splatstream(job, "encode", job.frames, *part, "-o", out, *job.options)
    return number, time.monotonic() - start


def tell(job, done, shard):
    """One line for a shard that is done."""
    number, seconds = shard
    print(f"shard {number} in {seconds:.1f} s, {done} of {job.shards} done", flush=True)


def join(job):
    """Joins the shards to the stream."""
    shards = [shard_file(job, number) for number in range(1, job.shards + 1)]
    report = splatstream(job, "concat", *shards, "-o", job.out)
    print(f"{job.out}: {report['bytes']} bytes, {report['frames']} frames", flush=True)
