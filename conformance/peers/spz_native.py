"""SPZ's own library, in C++, from its authors' repository: fetched where the network allows, and built with -O3."""

import hashlib
import os
import subprocess

from measure import Missing, run

REPOSITORY = "https://github.com/nianticlabs/spz"
COMMIT = "21715c3b7a609ea6fb7c69b8ae42181a12b59f22"  # of 2026-07-10; format 4
SOURCES = ["load-spz.cc", "splat-types.cc", "splat-c-types.cc"]
FLAGS = ["-O3", "-DNDEBUG", "-std=c++17"]
LIBRARIES = ["-lz", "-lzstd"]
TIMER = os.path.join(os.path.dirname(os.path.abspath(__file__)), "spz_timer.cc")


def timer(cache, source=None):
    """The program of spz_timer.cc with the sources in the folder `source`, or else with those of COMMIT."""
    folder = os.path.join(source or fetched(cache), "src", "cc")
    sources = [TIMER] + [os.path.join(folder, name) for name in SOURCES]
    command = [os.environ.get("CXX", "c++"), *FLAGS, "-I", folder, *sources, *LIBRARIES]
    place = os.path.join(cache, "spz-native", "timer-" + _digest(command, sources))
    if not os.path.exists(place):
        os.makedirs(os.path.dirname(place), exist_ok=True)
        run(command + ["-o", place + ".new"])
        os.rename(place + ".new", place)
    return place


def fetched(cache):
    """A folder with the sources of COMMIT."""
    folder = os.path.join(cache, "spz-native", COMMIT)
    if os.path.exists(os.path.join(folder, "src")):
        return folder
    git = ["git", "-C", folder, "-c", "http.lowSpeedLimit=1000", "-c", "http.lowSpeedTime=20"]
    os.makedirs(folder, exist_ok=True)
    run(git + ["init", "--quiet"])
    run(git + ["fetch", "--quiet", "--depth", "1", REPOSITORY, COMMIT])
    run(git + ["checkout", "--quiet", "FETCH_HEAD"])
    return folder


def version(source=None):
    """What was built, as far as it is known."""
    if source is None:
        return "nianticlabs/spz %s" % COMMIT[:9]
    done = subprocess.run(["git", "-C", source, "rev-parse", "--show-toplevel", "HEAD"], capture_output=True, text=True)
    top, _, commit = done.stdout.strip().partition("\n")
    # A folder within another repository has no commit of its own.
    is_own = done.returncode == 0 and os.path.realpath(top) == os.path.realpath(source)
    return "spz " + (commit[:9] if is_own else "from a folder")


def _digest(command, sources):
    digest = hashlib.sha256(" ".join(command).encode())
    for path in sources:
        try:
            with open(path, "rb") as file:
                digest.update(file.read())
        except FileNotFoundError:
            raise Missing("%s is not among the sources of SPZ" % os.path.basename(path)) from None
    return digest.hexdigest()[:16]
