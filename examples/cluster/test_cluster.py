"""What can be said of this folder without a cluster: python3 -m unittest discover --start-directory examples/cluster"""
import collections
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile
import unittest

HERE = pathlib.Path(__file__).parent
SPLATSTREAM = os.environ.get("SPLATSTREAM") or shutil.which("splatstream")


class Files(unittest.TestCase):
    """The files of job systems are what their readers take."""

    def test_the_slurm_script_is_one_of_bash(self):
        subprocess.run(["bash", "-n", HERE / "slurm.sh"], check=True)

    def test_the_slurm_script_hands_each_step_on(self):
        """With a Slurm that runs every job at once, in an environment that has what Slurm gives."""
        with tempfile.TemporaryDirectory() as folder:
            folder = pathlib.Path(folder)
            sbatch = """#!/bin/bash
                echo "$*" >>"$LOG.jobs"
                while [[ $1 == --* ]]; do case $1 in --array=1-*) count=${1#--array=1-};; esac; shift; done
                export SLURM_CPUS_PER_TASK=2
                for number in $(seq 1 "${count:-1}"); do SLURM_ARRAY_TASK_ID=$number bash "$@" >&2; done
                echo 7"""
            # The command writes what it was asked for, and the file that it was asked for.
            command = """#!/bin/bash
                echo "$*" >>"$LOG"
                while [ $# -gt 0 ]; do [ "$1" != -o ] || touch "$2"; shift; done"""
            for name, text in (("sbatch", sbatch), ("splatstream", command)):
                (folder / name).write_text(text)
                (folder / name).chmod(0o755)
            log, out = folder / "log", folder / "talk.gss"
            given = {"FRAMES": "frames", "OUT": str(out), "SHARDS": "3", "LOG": str(log)}
            given["PATH"] = f"{folder}:{os.environ['PATH']}"
            def run():
                """What the command was asked for."""
                log.unlink(missing_ok=True)
                script = ["bash", HERE / "slurm.sh", "--gop", "8"]
                subprocess.run(script, env={**os.environ, **given}, check=True, stdout=subprocess.DEVNULL)
                return log.read_text().splitlines()

            asked, again = run(), run()
            waiting = [job for job in (folder / "log.jobs").read_text().splitlines() if "--dependency" in job]
        self.assertEqual(len(asked), 5)
        self.assertEqual(len(waiting), 4)
        self.assertTrue(all("--kill-on-invalid-dep=yes" in job for job in waiting), waiting)
        self.assertIn("--write-plan", asked[0])
        for number, shard in enumerate(asked[1:4], 1):
            self.assertIn(f"--shard {number}/3", shard)
            self.assertTrue(shard.endswith("--threads 2 --gop 8"), shard)
        # Shards of the same plan are kept.
        self.assertEqual([words.split()[0] for words in again], ["encode", "concat"])
        self.assertTrue(asked[4].startswith("concat") and asked[4].endswith(f"-o {out}"), asked[4])

    def test_the_jobs_of_kubernetes_agree(self):
        try:
            import yaml
        except ImportError:
            self.skipTest("PyYAML is not installed")
        documents = list(yaml.safe_load_all((HERE / "kubernetes.yaml").read_text()))
        self.assertEqual([document["kind"] for document in documents], ["ConfigMap", "Job", "Job", "Job"])
        shards = int(documents[0]["data"]["SHARDS"])
        job = documents[2]["spec"]
        self.assertEqual((job["completionMode"], job["completions"]), ("Indexed", shards))
        for document in documents[1:]:
            [container] = document["spec"]["template"]["spec"]["containers"]
            shell, _, script = container["command"]
            subprocess.run([shell, "-n", "-c", script], check=True)


# Stands for the command, and writes down what it was asked for. The first time that shard 3 is asked for, the worker that asked and
# the encoder are killed while the encoder runs.
FRAGILE = """#!/bin/bash
echo "$*" >>"$LOG"
if [[ "$*" == *"--shard 3/"* ]] && mkdir "$LOG.killed" 2>/dev/null; then
    "$ENCODER" "$@" &
    kill -9 $! $PPID
    exit 1
fi
exec "$ENCODER" "$@"
"""


class Drivers(unittest.TestCase):
    """A driver writes the stream of a single run, also if a worker is killed: only the shard that it had at hand is encoded again."""

    def drive(self, driver, module):
        try:
            __import__(module)
        except ImportError:
            self.skipTest(f"{module} is not installed")
        if not SPLATSTREAM:
            self.skipTest("the command is not there: give it in SPLATSTREAM")
        with tempfile.TemporaryDirectory() as folder:
            folder = pathlib.Path(folder)
            frames, whole = folder / "frames", folder / "whole.gss"
            options = ["--gop", "2", "--preset", "fast", "--psnr", "40"]
            stream = HERE.parent / "talk.gss"
            encoder = str(pathlib.Path(SPLATSTREAM).resolve())
            subprocess.run([encoder, "decode", stream, "-o", frames], check=True, stdout=subprocess.DEVNULL)
            subprocess.run([encoder, "encode", frames, "-o", whole, *options], check=True, stdout=subprocess.DEVNULL)
            fragile, log = folder / "fragile", folder / "log"
            fragile.write_text(FRAGILE)
            fragile.chmod(0o755)

            def run(command):
                """The stream, byte for byte, and how often each shard was encoded."""
                log.write_text("")
                out, scratch = folder / f"{command.name}.gss", folder / f"{command.name}-shards"
                how = ["-o", out, "--scratch", scratch, "--splatstream", command, "--workers", "2"]
                given = {**os.environ, "ENCODER": encoder, "LOG": str(log)}
                subprocess.run([sys.executable, HERE / driver, frames, *how, "--", *options], check=True, env=given)
                self.assertEqual(out.read_bytes(), whole.read_bytes())
                words = [line.split() for line in log.read_text().splitlines()]
                return collections.Counter(asked[asked.index("--shard") + 1] for asked in words if "--shard" in asked)

            run(pathlib.Path(encoder))
            asked = run(fragile)
            self.assertTrue((folder / "log.killed").exists())
            most = len(asked)
            self.assertGreater(most, 3)
            self.assertEqual(asked, {f"{shard}/{most}": 1 + (shard == 3) for shard in range(1, most + 1)})

    def test_dask(self):
        self.drive("dask_driver.py", "distributed")

    def test_ray(self):
        self.drive("ray_driver.py", "ray")


if __name__ == "__main__":
    unittest.main()
