"""The decoder under test: a command for each case, or a process that answers line by line."""

import json
import os
import select
import shlex
import shutil
import signal
import subprocess
import tempfile
import time

try:
    import resource
except ImportError:                                 # not on every system
    resource = None

STDERR_KEPT = 4096


class Answer:
    """How a decoder ended: an exit code, `signal N` or a limit in words; and what it said."""

    def __init__(self, code=None, ending=None, said=None, message=""):
        self.code, self.ending, self.said, self.message = code, ending, said or {}, message


def diagnosis(line):
    """The JSON object in a line; {} if there is none."""
    try:
        said = json.loads(line)
    except ValueError:
        return {}
    return said if isinstance(said, dict) else {}


def limit(pid, memory, output):
    """Bounds the data segment and the files of a process that has just started, where the system can; 0 is no bound."""
    if getattr(resource, "prlimit", None):
        for kind, bound in ((resource.RLIMIT_DATA, 2 * memory), (resource.RLIMIT_FSIZE, output)):
            if bound:
                try:
                    resource.prlimit(pid, kind, (bound, bound))
                except ProcessLookupError:
                    pass                            # it has ended already


class Session:
    """Asks a decoder, one case after the other, with a folder for what it writes."""

    def __init__(self, settings):
        self.settings, self.process, self.received = settings, None, b""
        self.folder = tempfile.mkdtemp(prefix="splatstream-conformance-")
        self.out = os.path.join(self.folder, "out")

    def close(self):
        self.end()
        shutil.rmtree(self.folder, ignore_errors=True)

    def ask(self, case):
        path = os.path.join(self.folder, "in.gss")
        with open(path, "wb") as f:
            f.write(case.input())
        shutil.rmtree(self.out, ignore_errors=True)
        os.mkdir(self.out)
        request = {"in": path, "op": case.op, "mode": case.mode, "out": self.out}
        return self.ask_line(request) if self.settings.stdio else self.ask_once(request)

    def start(self, words, **pipes):
        # Unbuffered: what a process that has ended was to get is not written once more when its pipe is closed.
        process = subprocess.Popen(words, start_new_session=True, bufsize=0, **pipes)
        limit(process.pid, self.settings.memory, self.settings.output)
        return process

    def ask_once(self, request):
        words = [self.filled(word, request) for word in shlex.split(self.settings.decoder)]
        with tempfile.TemporaryFile() as errors:
            process = self.start(words, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=errors)
            try:
                code = process.wait(self.settings.time)
            except subprocess.TimeoutExpired:
                code = None
            kill(process)
            errors.seek(max(0, os.fstat(errors.fileno()).st_size - STDERR_KEPT))
            text = errors.read().decode(errors="replace").rstrip()
        last = text.splitlines()[-1].strip() if text else ""
        return answer(code, diagnosis(last), last)

    @staticmethod
    def filled(word, request):
        for name, value in request.items():
            word = word.replace("{%s}" % name, value)
        return word

    def ask_line(self, request):
        """Writes `in TAB op TAB mode TAB out`; the decoder answers `exit-code`, or `exit-code TAB JSON`."""
        if self.process is None or self.process.poll() is not None:
            self.process, self.received = self.start(shlex.split(self.settings.stdio), stdin=subprocess.PIPE,
                                                     stdout=subprocess.PIPE, stderr=subprocess.DEVNULL), b""
        line = "\t".join(request[key] for key in ("in", "op", "mode", "out")) + "\n"
        try:
            self.process.stdin.write(line.encode())
            self.process.stdin.flush()
        except OSError:
            self.end()
            return Answer(ending="no answer", message="the process ended before it was asked")
        text = self.line()
        if text is None:
            is_over = self.process.poll() is not None
            self.end()
            return Answer(ending="no answer" if is_over else "timeout")
        code, _, rest = text.partition("\t")
        try:
            return answer(int(code), diagnosis(rest), rest)
        except ValueError:
            self.end()
            return Answer(ending="no answer", message="the answer %r does not start with an exit code" % text[:80])

    def line(self):
        """The next line of the process; None if none comes in time, or it has ended."""
        end = time.monotonic() + self.settings.time
        while b"\n" not in self.received:
            left = end - time.monotonic()
            if left <= 0 or not select.select([self.process.stdout], [], [], left)[0]:
                return None
            part = os.read(self.process.stdout.fileno(), 65536)
            if not part:
                self.process.wait()
                return None
            self.received += part
        line, self.received = self.received.split(b"\n", 1)
        return line.decode(errors="replace").rstrip("\r")

    def end(self):
        if self.process is not None:
            kill(self.process)
            self.process.stdin.close()
            self.process.stdout.close()
            self.process = None


def kill(process):
    """Ends a process and all that it has started."""
    try:
        os.killpg(process.pid, signal.SIGKILL)
    except (ProcessLookupError, PermissionError):
        pass
    process.wait()


def answer(code, said, message):
    if code is None:
        return Answer(ending="timeout")
    if code < 0:
        return Answer(ending="signal %d" % -code, message=message)
    return Answer(code, said=said, message=message)
