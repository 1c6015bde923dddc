"""Copies of the oracle with one mutation, and what the vectors say of them."""

import os
import re
import resource
import shutil
import signal
import sys
import tempfile

CONFORMANCE = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
ORACLE = os.path.join(CONFORMANCE, "oracle")
MAX_SECONDS, MAX_BYTES = 120, 4 << 30             # of one vector, and of memory


def mutated(text, snippet, replacement):
    """The text with the one place of the snippet replaced; white space of the snippet stands for any white space."""
    pattern = r"\s+".join(map(re.escape, snippet.split()))
    places = list(re.finditer(pattern, text))
    if len(places) != 1:
        raise ValueError("%d places have the snippet %r" % (len(places), snippet))
    return text[:places[0].start()] + replacement + text[places[0].end():]


def read(name):
    with open(os.path.join(ORACLE, name), encoding="utf-8") as f:
        return f.read()


def fault_of(mutation):
    """Why a mutation cannot be made; none if it can."""
    requirement, name, snippet, replacement = mutation
    try:
        compile(mutated(read(name), snippet, replacement), name, "exec")
    except (ValueError, SyntaxError) as error:
        return "%s: %s: %s" % (requirement, name, error)
    return None


def copy_of_oracle(root, mutation):
    """The folder conformance with the mutated oracle. Compiled files are copied too and hold while sources stay."""
    folder = os.path.join(root, "conformance")
    shutil.copytree(ORACLE, os.path.join(folder, "oracle"))
    os.symlink(os.path.join(CONFORMANCE, "generator"), os.path.join(folder, "generator"))
    os.symlink(os.path.join(os.path.dirname(CONFORMANCE), "spec"), os.path.join(root, "spec"))
    if mutation is not None:
        _, name, snippet, replacement = mutation
        target = os.path.join(folder, "oracle", name)
        text = mutated(read(name), snippet, replacement)
        os.remove(target)
        with open(target, "w", encoding="utf-8") as f:
            f.write(text)
        os.utime(target, (1, 1))                    # another time than the compiled file of the original has
    return folder


def stop(signum, frame):
    raise TimeoutError


def first_failure(job):
    """(number of the job, name of the first vector that the mutated oracle fails or none). Call it in a process of its own.

    An exception, too much time and too much memory are failures too.
    """
    number, mutation, folders = job
    with tempfile.TemporaryDirectory() as root:
        sys.path.insert(0, copy_of_oracle(root, mutation))
        resource.setrlimit(resource.RLIMIT_AS, (MAX_BYTES, MAX_BYTES))
        signal.signal(signal.SIGALRM, stop)
        try:
            from oracle import run_vectors
        except Exception:                           # pylint: disable=broad-except
            return number, "import"
        for folder in folders:
            if fails(run_vectors, folder):
                return number, os.path.basename(folder)
    return number, None


def fails(run_vectors, folder):
    signal.alarm(MAX_SECONDS)
    try:
        return bool(run_vectors.run(folder)[1])
    except Exception:                               # pylint: disable=broad-except
        return True
    finally:
        signal.alarm(0)
