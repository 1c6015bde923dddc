"""Decoders of SplatStream for fluster: the reference, and any program that speaks the protocol of the conformance suite.

SPLATSTREAM_DECODER is the command of the second, with the placeholders {in}, {op}, {mode} and {out} (adapters/README.md of the suite).
"""

import hashlib
import os
import shlex
import subprocess
import tempfile
from typing import Any, Dict, List, Optional

from fluster.codec import Codec, OutputFormat
from fluster.decoder import Decoder, register_decoder

CLASSES = {0: "accept", 10: "malformed", 11: "invalid", 12: "unsupported", 13: "over-limit", 14: "truncated"}


def answer(words: List[str], timeout: int) -> str:
    """The verdict of a decoder, by its exit code.

    Raises an error for any other end."""
    ended = subprocess.run(words, timeout=timeout, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, check=False)
    if ended.returncode not in CLASSES:
        last = ended.stderr.decode(errors="replace").strip().splitlines()[-1:]
        raise RuntimeError(f"exit code {ended.returncode}: {' '.join(last)}")
    return CLASSES[ended.returncode]


def planes(folder: str) -> List[str]:
    """A line `sha256 name` for each file of planes in a folder, in the order of the names."""
    lines = []
    for name in sorted(os.listdir(folder)):
        if name.endswith(".i32"):
            with open(os.path.join(folder, name), "rb") as file:
                lines.append(f"{hashlib.sha256(file.read()).hexdigest()} {name}")
    return lines


class SplatStream(Decoder):
    """A program that speaks the protocol."""

    codec = Codec("SplatStream")

    def words(self, path: str, op: str, out: str) -> List[str]:
        """The command for a stream at an operating point."""
        raise NotImplementedError

    def decode(
        self,
        input_filepath: str,
        output_filepath: str,
        output_format: OutputFormat,
        timeout: int,
        verbose: bool,
        keep_files: bool,
        optional_params: Optional[Dict[str, Any]] = None,
    ) -> str:
        """SHA-256 of the verdict and of the digests of all planes, as lines."""
        params = optional_params or {}
        with tempfile.TemporaryDirectory() as folder:
            lines = [answer(self.words(os.path.abspath(input_filepath), params.get("op", "s3,t3,r9"), folder), timeout)]
            if not params.get("verdict_only"):
                lines += planes(folder)
        return hashlib.sha256("".join(line + "\n" for line in lines).encode()).hexdigest()


@register_decoder
class SplatStreamReference(SplatStream):
    """The reference decoder."""

    name = "SplatStream-reference"
    description = "Reference decoder of SplatStream"
    binary = "splatstream"
    is_reference = True

    def words(self, path: str, op: str, out: str) -> List[str]:
        return [self.binary, "conformance", "decode", "--in", path, "--op", op, "--mode", "full", "--out", out]


@register_decoder
class SplatStreamProtocol(SplatStream):
    """The program of SPLATSTREAM_DECODER."""

    name = "SplatStream-protocol"
    description = "Decoder of SplatStream that SPLATSTREAM_DECODER names"

    def check(self, verbose: bool) -> bool:
        return bool(os.environ.get("SPLATSTREAM_DECODER"))

    def words(self, path: str, op: str, out: str) -> List[str]:
        values = {"{in}": path, "{op}": op, "{mode}": "full", "{out}": out}
        words = shlex.split(os.environ["SPLATSTREAM_DECODER"])
        for placeholder, value in values.items():
            words = [word.replace(placeholder, value) for word in words]
        return words
