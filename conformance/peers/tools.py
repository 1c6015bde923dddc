"""A virtual environment and npm folders in a cache; nothing is installed anywhere else."""

import json
import os
import subprocess
import sys
import tempfile
import venv

from measure import Package, run

NUMPY = Package("pip", "numpy", "2.4.6")


def enter(cache):
    """Continues this very program inside the cache's virtual environment, made on first use."""
    home = os.path.join(cache, "python")
    python = os.path.join(home, "bin", "python")
    if os.path.realpath(sys.prefix) == os.path.realpath(home):
        return
    if not os.path.exists(python):
        venv.create(home, with_pip=True)
    _pip(python, NUMPY)
    os.execv(python, [python] + sys.argv)


class Tools:
    def __init__(self, cache, repeat, limit):
        self.cache = os.path.abspath(cache)
        self.repeat = repeat
        self.limit = limit
        self.work = tempfile.TemporaryDirectory(prefix="work-", dir=self.cache)

    def install(self, package):
        if package.registry == "pip":
            _pip(sys.executable, package)
        else:
            self._npm(package)

    def program(self, name):
        """A program that a pip package brought along."""
        return os.path.join(os.path.dirname(sys.executable), name)

    def entry(self, package):
        """The main module of an npm package."""
        folder = os.path.join(self._folder(package), "node_modules", package.name)
        with open(os.path.join(folder, "package.json")) as file:
            return os.path.join(folder, json.load(file)["main"])

    def node(self, script, job):
        """Runs a script of this folder on a job; both sides speak JSON."""
        path = os.path.join(os.path.dirname(os.path.abspath(__file__)), script)
        out = run(["node", path], stdin=json.dumps(job).encode(), limit=self.limit)
        return json.loads(out.splitlines()[-1])

    def scratch(self, name):
        return os.path.join(self.work.name, name)

    def _folder(self, package):
        return os.path.join(self.cache, "npm", "%s@%s" % (package.name.replace("/", "+"), package.version))

    def _npm(self, package):
        folder = self._folder(package)
        if os.path.exists(os.path.join(folder, "node_modules", package.name)):
            return
        os.makedirs(folder, exist_ok=True)
        with open(os.path.join(folder, "package.json"), "w") as file:
            json.dump({"private": True, "dependencies": {package.name: package.version}}, file)
        run(["npm", "install", "--silent", "--no-audit", "--no-fund", "--prefix", folder])


def _pip(python, package):
    wanted = "%s==%s" % (package.name, package.version)
    have = subprocess.run([python, "-m", "pip", "freeze"], capture_output=True, text=True).stdout
    if wanted.lower() not in have.lower().split():
        run([python, "-m", "pip", "install", "--quiet", "--disable-pip-version-check", wanted])
