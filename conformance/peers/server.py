"""A program that waits for requests, one a line, and answers each with a line of JSON."""

import json
import os
import subprocess
import tempfile

from measure import Missing


class Server:
    """The program runs from the first request on; what it says before a request is answered is left out."""

    def __init__(self, command):
        self.command = [str(word) for word in command]
        self.process = self.errors = None
        self.answers = {}  # the last one to each request

    def ask(self, request):
        """The answer; Missing where the program ends instead."""
        if self.process is None:
            self._start()
        try:
            self.process.stdin.write(request + "\n")
            self.process.stdin.flush()
        except BrokenPipeError:
            pass
        for line in self.process.stdout:
            if line.startswith("{"):
                self.answers[request] = json.loads(line)
                return self.answers[request]
        raise Missing("%s: exit %d: %s" % (os.path.basename(self.command[0]), self.process.wait(), self._last_words()))

    def require(self, request):
        """Asks unless that has been done before."""
        if request not in self.answers:
            self.ask(request)

    def close(self):
        if self.process is not None:
            self.process.stdin.close()
            self.process.stdout.close()
            self.process.wait()
            self.errors.close()
            self.process = self.errors = None

    def _start(self):
        errors = tempfile.TemporaryFile()
        try:
            self.process = subprocess.Popen(self.command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=errors,
                                            text=True)
            self.errors = errors
        except FileNotFoundError:
            errors.close()
            raise Missing("%s is not on this machine" % self.command[0]) from None

    def _last_words(self):
        self.errors.seek(0)
        return " / ".join(self.errors.read().decode(errors="replace").strip().splitlines()[-3:])
