"""What a peer is, and how it is timed.

A peer is a module with
    PACKAGES                      what it needs from the registries: [Package, ...]
    rates(scene)                  the points to measure: [Rate, ...], empty where the peer does not take the scene
    code(rate, scene, decoded, tools)  ->  Coded; writes one PLY for every path of `decoded`
Seconds are CPU seconds of all threads: on a machine that others use too, they are what can be repeated.
"""

import os
import resource
import shlex
import signal
import statistics
import subprocess
import time
from dataclasses import dataclass, field


@dataclass(frozen=True)
class Package:
    registry: str  # "pip" or "npm"
    name: str
    version: str


@dataclass(frozen=True)
class Rate:
    peer: str
    options: str
    settings: dict = field(default_factory=dict)


@dataclass(frozen=True)
class Coded:
    bytes: int
    gaussians: int
    encode_s: float
    decode_s: float
    timing: str  # "in-process" or "process"
    command: str


SLOW = 60.0  # seconds: what takes longer is not repeated


class Missing(Exception):
    """The peer cannot be measured here; the text says why."""


def one_core():
    """Keeps this process and its children on one core, where the system can."""
    if hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})


def in_process(work, repeat):
    """(what work() returns, the median of its CPU seconds)."""
    seconds = []
    for _ in range(repeat):
        begin = time.process_time()
        result = work()
        seconds.append(time.process_time() - begin)
        if seconds[-1] > SLOW:
            break
    return result, statistics.median(seconds)


def process(command, repeat=1):
    """The median CPU seconds of a command."""
    seconds = []
    for _ in range(repeat):
        begin = _children_seconds()
        run(command)
        seconds.append(_children_seconds() - begin)
        if seconds[-1] > SLOW:
            break
    return statistics.median(seconds)


def run(command, stdin=None, limit=None):
    """What a command prints; one that fails or takes more than `limit` CPU seconds is Missing."""
    def bounded():
        if limit:
            resource.setrlimit(resource.RLIMIT_CPU, (limit, limit))

    try:
        done = subprocess.run([str(word) for word in command], input=stdin, capture_output=True, preexec_fn=bounded)
    except FileNotFoundError:
        raise Missing("%s is not on this machine" % command[0]) from None
    if limit and done.returncode in (-signal.SIGXCPU, -signal.SIGKILL):
        raise Missing("stopped after %d s" % limit)
    if done.returncode:
        tail = (done.stderr or done.stdout).decode(errors="replace").strip().splitlines()[-3:]
        raise Missing("%s: exit %d: %s" % (os.path.basename(str(command[0])), done.returncode, " / ".join(tail)))
    return done.stdout.decode(errors="replace")


def spoken(command):
    """A command as one types it, without the folders of this machine."""
    return shlex.join(os.path.basename(str(word)) if os.path.isabs(str(word)) else str(word) for word in command)


def _children_seconds():
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime
