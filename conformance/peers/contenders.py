"""Who takes part in a measurement of speed: for a scene, the cases of each codec.

A contender is a function of (scene, setup) that gives cases, or raises Missing with the reason.
"""

import json
import os
import time
from dataclasses import dataclass
from typing import Callable

import sog
import splats4d
import spz
import spz_native
import transform
from measure import Missing, process, run
from server import Server

ROOT = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..")
WASM = "wasm32-unknown-unknown"
SPZ_NATIVE = "SPZ v4, C++"
SPZ_WASM = "SPZ v4, WebAssembly"
PRESETS = ["fast", "balanced"]
THREADS = 2


@dataclass(frozen=True)
class Case:
    """One thing to measure."""

    codec: str
    work: str        # "encode" or "decode"
    options: str
    threads: int
    measure: Callable[[], dict]  # does it once: {"cpu_s", "wall_s"}, and "bytes" where it knows them

    @property
    def name(self):
        return ", ".join(part for part in (self.codec, self.work, self.options) if part)


@dataclass
class Setup:
    """What contenders are made from."""

    tools: object
    spz_source: str  # a folder with the sources of SPZ, or None
    timers: dict     # our builds to measure: name to program
    servers: list

    def server(self, command):
        """A program for one scene: the same for the same command."""
        server = Server(command)
        for other in self.servers:
            if other.command == server.command:
                return other
        self.servers.append(server)
        return server

    def timer(self, name, scene):
        """One of our builds, with a scene."""
        return self.server([self.timers[name]] + scene.paths)

    def job(self, name, job):
        """A file with a job for a script on Node."""
        path = self.tools.scratch(name)
        with open(path, "w") as file:
            json.dump(job, file)
        return path


def ours(scene, setup):
    cases = []
    for name in setup.timers:
        server = setup.timer(name, scene)
        for preset in PRESETS:
            cases += _ours_with_preset(name, preset, server)
    return cases


def _ours_with_preset(name, preset, server):
    fitted = "encode %s fitted %d" % (preset, THREADS)
    cases = [_asked(name, server, fitted, "%s, as `encode`" % preset, THREADS),
             _asked(name, server, "encode %s given %d" % (preset, THREADS), "%s, steps given" % preset, THREADS)]
    for threads in (1, THREADS):
        for digests in ("unverified", "verified"):
            options = "%s, %s, %s" % (preset, digests, "one thread" if threads == 1 else "%d threads" % threads)
            request = "decode %s %s %d" % (preset, digests, threads)
            cases.append(_asked(name, server, request, options, threads, fitted))
    return cases


def ours_wasm(scene, setup):
    """The C interface, compiled to WebAssembly: decodes with digests compared."""
    libraries = {"WebAssembly": _wasm(setup, ""), "WebAssembly with SIMD": _wasm(setup, "-Ctarget-feature=+simd128")}
    stream = setup.tools.scratch("wasm.gss")
    name = next(iter(setup.timers))
    writer = setup.timer(name, scene)
    cases = []
    for build, library in libraries.items():
        server = setup.server(["node", _script("ours.mjs"), library, stream])

        def measure(server=server):
            writer.require("write balanced " + stream)
            return server.ask("decode")

        cases.append(Case("%s, %s" % (name, build), "decode", "balanced, verified", 1, measure))
    return cases


def spz_in_cpp(scene, setup):
    server = setup.server([spz_native.timer(setup.tools.cache, setup.spz_source)] + scene.paths)
    return _both(SPZ_NATIVE, server)


def spz_in_wasm(scene, setup):
    setup.tools.install(spz.SPZ)
    job = spz.job(spz.rates(scene)[0 if scene.sequence else 2], scene, setup.tools)
    return _both(SPZ_WASM, setup.server(["node", _script("spz.mjs"), setup.job("spz.json", job)]))


def sog_in_javascript(scene, setup):
    setup.tools.install(transform.TRANSFORM)
    rate = sog.rates(scene)[-1]
    frames = [{"in": os.path.abspath(path)} for path in scene.paths]
    job = {"module": setup.tools.entry(transform.TRANSFORM), "frames": frames, "suffix": "sog",
           "options": rate.settings}
    return _both("SOG, JavaScript", setup.server(["node", _script("transform.mjs"), setup.job("sog.json", job)]))


def splats4d_as_program(scene, setup):
    rates = splats4d.rates(scene)
    if not rates:
        raise Missing("it takes sequences only")
    for package in splats4d.PACKAGES:
        setup.tools.install(package)
    coder = splats4d.Coder(rates[0], scene, setup.tools)

    def encode():
        return sized(_program([coder.encode]))

    def decode():
        if not os.path.exists(coder.coded):
            encode()
        return sized(_program(coder.decode()))

    def sized(sample):
        return dict(sample, bytes=os.path.getsize(coder.coded))

    options = rates[0].options + ", a whole process"
    return [Case("splats4d", "encode", options, 1, encode), Case("splats4d", "decode", options, 1, decode)]


CONTENDERS = {"ours": ours, "spz": spz_in_cpp, "spz_wasm": spz_in_wasm, "ours_wasm": ours_wasm,
              "sog": sog_in_javascript, "splats4d": splats4d_as_program}


def built_timer():
    """Our own timer, built from this tree."""
    command = ["cargo", "build", "--release", "--quiet", "--message-format", "json", "--example", "speed",
               "--manifest-path", os.path.join(ROOT, "Cargo.toml"), "-p", "splatstream-encoder"]
    for line in run(command).splitlines():
        message = json.loads(line)
        if message.get("executable") and message["target"]["name"] == "speed":
            return message["executable"]
    raise Missing("cargo built no timer")


def _wasm(setup, flags):
    """The C interface, built for WebAssembly with some flags of rustc."""
    if not os.path.isdir(run(["rustc", "--print", "target-libdir", "--target", WASM]).strip()):
        raise Missing("the Rust target %s is not there" % WASM)
    target = os.path.join(setup.tools.cache, "wasm-simd" if flags else "wasm")
    run(["env", "RUSTFLAGS=" + flags, "cargo", "build", "--release", "--quiet", "--target", WASM, "--target-dir", target,
         "--manifest-path", os.path.join(ROOT, "Cargo.toml"), "-p", "splatstream-c"])
    return os.path.join(target, WASM, "release", "splatstream_c.wasm")


def _both(codec, server):
    return [_asked(codec, server, "encode", "", 1), _asked(codec, server, "decode", "", 1, "encode")]


def _asked(codec, server, request, options, threads, before=None):
    def measure():
        if before:
            server.require(before)
        sample = server.ask(request)
        # What is decoded is what was encoded.
        return dict(server.answers.get(before, {}), **sample)

    return Case(codec, request.split()[0], options, threads, measure)


def _program(commands):
    begin = time.perf_counter()
    cpu = sum(process(command) for command in commands)
    return {"cpu_s": cpu, "wall_s": time.perf_counter() - begin}


def _script(name):
    return os.path.join(os.path.dirname(os.path.abspath(__file__)), name)
