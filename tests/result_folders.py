#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Result folders of the command under everything that may end a run: kill -9, Ctrl-C, a full disk, an unwritable folder,
other runs in the same folder, other hosts. Whatever happens, whole parts stay, and --resume ends with the bytes of a
run that nothing disturbed.

    python3 tests/result_folders.py build/dev/kempe            some kills: seconds
    python3 tests/result_folders.py build/dev/kempe --kills 50 all of them: minutes
"""
import argparse
import json
import os
import pathlib
import random
import re
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[1]
MODEL = ROOT / "examples/four_bar/four_bar.yaml"
COUNT, CHUNK = 240, 16
TABLE = ["ensemble", str(MODEL), "--sample", "crank=IT7,base=0.88:0.92", "--instances", str(COUNT), "--t-end", "0.3", "--quiet"]
STUDY = [*TABLE, "--chunk", str(CHUNK)]
PARTS = COUNT // CHUNK


def run(folder, *words, study=STUDY, **keywords):
    return subprocess.run([KEMPE, *study, "--out", str(folder), *words], capture_output=True, text=True, timeout=300, **keywords)


def content(folder):
    """Bytes of the files of a folder; nothing but parts and the manifest is in it."""
    files = {path.name: path.read_bytes() for path in sorted(pathlib.Path(folder).iterdir())}
    wrong = [name for name in files if name != "manifest.json" and not re.fullmatch(r"part-\d{6}\.parquet", name)]
    assert not wrong, wrong
    return files


class Folders(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.place = pathlib.Path(tempfile.mkdtemp(prefix="kempe-folders-"))
        done = run(cls.place / "whole.kempe")
        assert done.returncode == 0, done.stderr
        cls.whole = content(cls.place / "whole.kempe")
        assert len(cls.whole) == PARTS + 1

    @classmethod
    def tearDownClass(cls):
        shutil.rmtree(cls.place)

    def setUp(self):
        self.folder = self.place / f"{self.id().split('.')[-1]}.kempe"

    def assert_whole(self):
        self.assertEqual(content(self.folder), self.whole)
        done = subprocess.run([KEMPE, "gather", self.folder], capture_output=True, text=True)
        self.assertEqual((done.returncode, done.stderr), (0, ""))

    def whole_parts(self):
        return sorted(path.name for path in self.folder.glob("part-*.parquet"))

    def test_threads_and_chunks_of_work(self):
        self.assertEqual(run(self.folder, "--threads", "3", "--lanes", "2").returncode, 0)
        self.assert_whole()

    def test_shares(self):
        for shares in (1, 2, 3, 7):
            shutil.rmtree(self.folder, ignore_errors=True)
            jobs = [subprocess.Popen([KEMPE, *STUDY, "--threads", "1", "--out", self.folder, "--shard", f"{k + 1}/{shares}"],
                                     stdout=subprocess.DEVNULL) for k in range(shares)]
            self.assertEqual([job.wait(300) for job in jobs], [0] * shares)
            self.assert_whole()

    def test_kill(self):
        """After each kill the parts are those of the whole run, with all that were there before."""
        chance, began = random.Random(1), time.time()
        run(self.folder)
        span = time.time() - began
        shutil.rmtree(self.folder)
        kills, before = 0, []
        while kills < KILLS:
            job = subprocess.Popen([KEMPE, *STUDY, "--threads", "1", "--out", self.folder, "--resume"],
                                   stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
            time.sleep(chance.uniform(0, 1.2) * span * (0.3 if kills % 3 else 1))
            job.send_signal(signal.SIGKILL)
            if job.wait() == 0:
                self.assert_whole()
                shutil.rmtree(self.folder)
                before = []
                continue
            kills += 1
            after = self.whole_parts()
            self.assertEqual([name for name in before if name not in after], [])
            for name in after:
                self.assertEqual((self.folder / name).read_bytes(), self.whole[name])
            before = after
        done = run(self.folder, "--resume")
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        self.assert_whole()

    def test_interrupt(self):
        for number in (signal.SIGINT, signal.SIGTERM):
            shutil.rmtree(self.folder, ignore_errors=True)
            job = subprocess.Popen([KEMPE, *STUDY, "--instances", "100000", "--threads", "1", "--out", self.folder],
                                   stdout=subprocess.PIPE, text=True)
            while len(self.whole_parts()) < 2:
                time.sleep(0.01)
            job.send_signal(number)
            text = job.communicate(timeout=100)[0]
            self.assertEqual(job.returncode, 1)
            self.assertIn("interrupted", text)
            self.assertRegex(text, r"missing   \d+ of 6250 parts; the run's command with --resume runs them")
            self.assertGreaterEqual(len(content(self.folder)), 3)

    def test_two_runs(self):
        """The second one is refused, or joins the first one."""
        study = [*STUDY, "--instances", "1600", "--threads", "1"]
        first = subprocess.Popen([KEMPE, *study, "--out", self.folder], stdout=subprocess.DEVNULL)
        while not self.whole_parts():
            time.sleep(0.005)
        second = run(self.folder, study=study)
        self.assertEqual(second.returncode, 2)
        self.assertIn("the folder has results: --resume runs what is missing", second.stderr)
        third = run(self.folder, "--resume", study=study)
        self.assertEqual((first.wait(300), third.returncode), (0, 0))
        self.assertEqual(run(self.folder, "--resume", study=study).returncode, 0)
        alone = self.folder.with_name("alone.kempe")
        self.assertEqual(run(alone, study=study).returncode, 0)
        self.assertEqual(content(self.folder), content(alone))

    def test_limit_of_files(self):
        """A file that cannot be written ends the run with a sentence; parts before it stay."""
        least = min(len(data) for name, data in self.whole.items() if name != "manifest.json")

        def limit():
            resource.setrlimit(resource.RLIMIT_FSIZE, (least - 100, resource.RLIM_INFINITY))

        done = run(self.folder, preexec_fn=limit)
        self.assertEqual(done.returncode, 1)
        self.assertRegex(done.stderr, r"cannot write '.*part-000000.parquet': File too large\n$")
        self.assertEqual(sorted(path.name for path in self.folder.iterdir()), ["manifest.json"])
        self.assertEqual(run(self.folder, "--resume").returncode, 0)
        self.assert_whole()

    def test_full_disk(self):
        place = self.place / "disk"
        place.mkdir()
        size = sum(map(len, self.whole.values())) // 2
        if subprocess.run(["mount", "-t", "tmpfs", "-o", f"size={size // 1024}k", "none", place], capture_output=True).returncode:
            self.skipTest("a small disk cannot be mounted here")
        try:
            done = run(place / "full.kempe")
            self.assertEqual(done.returncode, 1)
            self.assertRegex(done.stderr, r"cannot write '.*': No space left on device\n$")
            self.assertIn("--resume", run(place / "full.kempe").stderr)
            parts = list((place / "full.kempe").glob("part-*.parquet"))
            self.assertGreater(len(parts), 2)
            shutil.copytree(place / "full.kempe", self.folder)
        finally:
            subprocess.run(["umount", place], check=True)
        self.assertEqual(run(self.folder, "--resume").returncode, 0)
        self.assert_whole()

    def test_unwritable(self):
        done = run("/proc/results.kempe")
        self.assertEqual(done.returncode, 1)
        self.assertIn("cannot make the folder '/proc/results.kempe'", done.stderr)
        file = self.place / "file.kempe"
        file.write_text("")
        self.assertEqual(run(file).returncode, 1)

    def test_other_study(self):
        self.assertEqual(run(self.folder, "--shard", "1/5").returncode, 0)
        for words, reason in ((["--rtol", "1e-6"], r"rtol is 1e-10 in the folder and 1e-06 in this run"),
                              (["--seed", "2"], r"the seed is 1 in the folder and 2"),
                              (["--instances", "241"], r"the number of instances is 240 in the folder and 241"),
                              (["--chunk", "17"], r"the number of instances of a part is 16 in the folder and 17"),
                              (["--t-end", "0.4"], r"t_end is 0.3 in the folder and 0.4"),
                              (["--no-convergence-check"], r"the convergence check is true in the folder and false"),
                              (["--alone"], r"the choice of separate runs is false in the folder and true"),
                              (["--set", "rocker=0.71"], r"the content of the model .* differs")):
            done = run(self.folder, "--resume", *words)
            self.assertEqual(done.returncode, 2, words)
            self.assertRegex(done.stderr, reason)
        self.assertEqual(run(self.folder, "--resume").returncode, 0)
        self.assert_whole()

    def test_claims(self):
        """A claim of a process that has ended, or of another host that has been silent, is taken over; others are not."""
        self.assertEqual(run(self.folder, "--shard", "2/2").returncode, 0)
        claims = self.folder / "claims"
        claims.mkdir(exist_ok=True)
        (claims / "000000").write_text("elsewhere/boot/pid:[1] 17 4711\n")
        done = run(self.folder, "--resume")
        self.assertEqual(done.returncode, 0)
        self.assertIn("missing   1 of 15 parts; other processes work on 1 of them", done.stdout)
        silent = time.time() - 301
        os.utime(claims / "000000", (silent, silent))
        self.assertEqual(run(self.folder, "--resume").returncode, 0)
        self.assert_whole()

    def test_gather(self):
        shutil.copytree(self.place / "whole.kempe", self.folder)
        for ending in ("csv", "parquet", "npz", "json"):
            one, other = self.place / f"one.{ending}", self.place / f"other.{ending}"
            subprocess.run([KEMPE, *TABLE, "--output", one], check=True, capture_output=True)
            subprocess.run([KEMPE, "gather", self.folder, "-o", other], check=True, capture_output=True)
            self.assertEqual(one.read_bytes(), other.read_bytes(), ending)
        gathered = self.place / "gathered.csv"
        part = self.folder / "part-000003.parquet"
        data = bytearray(part.read_bytes())
        random.seed(2)
        for _ in range(100):  # any damage, in values or in the footer, is found
            changed = bytearray(data)
            at = random.randrange(len(data))
            changed[at] ^= 1 << random.randrange(8)
            part.write_bytes(changed)
            done = subprocess.run([KEMPE, "gather", self.folder, "-o", gathered], capture_output=True, text=True)
            if done.returncode == 0:  # behind the sum there is the name of the writer alone
                self.assertGreater(at, len(data) - 60)
                gathered.unlink()
                continue
            self.assertEqual(done.returncode, 1, at)
            self.assertIn("part-000003.parquet", done.stderr)
            self.assertFalse(gathered.exists())
        part.unlink()
        done = subprocess.run([KEMPE, "gather", self.folder], capture_output=True, text=True)
        self.assertEqual(done.returncode, 1)
        self.assertIn("1 of 15 parts is missing: 3; the run with --resume makes it", done.stderr)
        self.assertEqual(run(self.folder, "--resume").returncode, 0)
        self.assert_whole()

    def test_equilibria(self):
        """Instances begin at their own equilibria, and the folder knows that they do: other starts are refused."""
        study = ["ensemble", str(MODEL), "--sample", "crank=IT7", "--instances", "4", "--t-end", "0.1", "--quiet"]
        done = run(self.folder, "--at", "equilibrium", study=study)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn("each instance begins at the equilibrium that its own start leads to", done.stdout)
        self.assertEqual(json.loads((self.folder / "manifest.json").read_text())["at"], "equilibrium")
        done = run(self.folder, "--resume", study=study)
        self.assertEqual((done.returncode, "the state at the start (--at) is \"equilibrium\" in the folder and missing in this run" in done.stderr), (2, True), done.stderr)
        replay = ["simulate", "--from", str(self.folder), "--instance", "2"]
        done = subprocess.run([KEMPE, *replay], capture_output=True, text=True)
        self.assertEqual((done.returncode, "--set or --at" in done.stderr), (2, True), done.stderr)
        done = subprocess.run([KEMPE, *replay, "--at", "equilibrium"], capture_output=True, text=True)
        self.assertEqual((done.returncode, "begins at the equilibrium" in done.stdout), (0, True), done.stderr)

    def test_replay(self):
        """An instance again: the state of its row, to the tolerance of the run."""
        text = subprocess.run([KEMPE, "gather", self.place / "whole.kempe", "-o", "/dev/stdout", "--json", "/dev/null"],
                              capture_output=True, text=True).stdout
        names, *rows = [line.split(",") for line in text.splitlines() if line.count(",") > 10]
        self.assertEqual(len(rows), COUNT)
        for k in (1, 100, COUNT):
            table = self.place / "motion.csv"
            done = subprocess.run([KEMPE, "simulate", "--from", self.place / "whole.kempe", "--instance", str(k), "-o", table],
                                  capture_output=True, text=True)
            self.assertEqual(done.returncode, 0, done.stderr)
            self.assertIn("dop853", done.stdout)
            head, *lines = table.read_text().splitlines()
            end = dict(zip(head.split(","), lines[-1].split(",")))
            row = dict(zip(names, rows[k - 1]))
            self.assertEqual(float(end["t"]), 0.3)
            for name in ("q.crank", "q.rocker", "qd.crank"):
                self.assertAlmostEqual(float(end[name]), float(row[name]), delta=1e-6)
        done = subprocess.run([KEMPE, "simulate", "--from", self.place / "whole.kempe", "--instance", str(COUNT + 1)],
                              capture_output=True, text=True)
        self.assertEqual((done.returncode, "instance 241 does not exist: the ensemble has 240" in done.stderr), (3, True))
        done = subprocess.run([KEMPE, "simulate", ROOT / "examples/slider_crank/slider_crank.yaml", "--from",
                               self.place / "whole.kempe", "--instance", "1"], capture_output=True, text=True)
        self.assertEqual((done.returncode, "the results belong to another model" in done.stderr), (2, True))

    def test_statistics(self):
        """gather prints the statistics of one run, and commands that a shell takes, also from a folder with a difficult name."""
        study = ["ensemble", str(MODEL), "--sample", "crank=IT7,qd.crank=15:25", "--instances", "100", "--t-end", "0.3",
                 "--quiet", "--quantity", "swing = max(q(rocker))", "--limit", "swing < 2.4"]
        folder = self.folder.with_name("it's a folder.kempe")
        one = json.loads(subprocess.run([KEMPE, *study, "--json", "-"], capture_output=True, text=True, check=True).stdout)
        self.assertEqual(run(folder, "--chunk", "16", study=study).returncode, 0)
        gather = [KEMPE, "gather", folder]
        told = subprocess.run([*gather, "--json", "-"], capture_output=True, text=True, check=True).stdout
        self.assertEqual(json.loads(told)["statistics"], one["statistics"])
        table = self.place / "statistics.csv"
        text = subprocess.run([*gather, "-o", table], capture_output=True, text=True, check=True).stdout
        self.assertIn(subprocess.run(gather, capture_output=True, text=True, check=True).stdout.split("statistics of")[1], text)
        head, *rows = (line.split(",") for line in table.read_text().splitlines())
        self.assertEqual(head[:2], ["crank", "value.qd.crank"])
        self.assertEqual(len(set(head)), len(head))
        swings = [float(row[head.index("swing")]) for row in rows]
        self.assertIn(f"{min(swings):.7g} in instance {swings.index(min(swings)) + 1}, " # they differ by 1e-4 of their size
                      f"{max(swings):.7g} in instance {swings.index(max(swings)) + 1}\n", text)
        motion = self.place / "extreme.csv"
        for word, swing in (("least", min(swings)), ("largest", max(swings))):
            command = re.search(rf"^  {word} +kempe (.*)$", text, re.M).group(1)
            subprocess.run(["sh", "-c", f"'{KEMPE}' {command} -o '{motion}'"], check=True, capture_output=True)
            head, *lines = (line.split(",") for line in motion.read_text().splitlines())
            found = max(float(line[head.index("q.rocker")]) for line in lines)
            self.assertLessEqual(found, swing + 1e-7)
            self.assertAlmostEqual(found, swing, delta=0.01)  # rows are apart from each other
        next(folder.glob("part-*.parquet")).unlink()
        told = subprocess.run(gather, capture_output=True, text=True)
        self.assertEqual((told.returncode, "swing" in told.stdout), (1, False))

    def test_page(self):
        """The page of a gathered run has the bytes of that of a run in one piece; it needs the model of the run."""
        studies = {"states": ["--sample", "crank=IT7,base=0.88:0.92", "--t-end", "0.3"], "quantities": ["--sample", "crank=IT7,qd.crank=15:25", "--t-end", "0.3", "--quantity",
                   "swing = range(q(rocker)), fast = max(qd(rocker))", "--limit", "fast < 8.3"],
                   "doubts": ["--sample", "crank=0.28:0.5,qd.coupler=1:2", "--rtol", "1e-3", "--t-end", "50"]}
        one, other = self.place / "one.html", self.place / "other.html"
        for name, words in studies.items():
            for unit in ("rad", "deg"):
                with self.subTest(name, unit=unit):
                    folder = self.place / f"{name}.kempe"
                    study = ["ensemble", str(MODEL), *words, "--instances", "100", "--quiet", "--set", "coupler=1.01"]
                    code = 5 if name == "doubts" else 0
                    done = subprocess.run([KEMPE, *study, "--angle-unit", unit, "--report", one], capture_output=True)
                    self.assertEqual(done.returncode, code)
                    for share in ("2/2", "1/2"):
                        parts = run(folder, "--chunk", "16", "--shard", share, study=study)
                        if unit == "rad":
                            self.assertEqual(parts.returncode, code)
                        else:  # the parts are there, and nothing runs
                            self.assertEqual((parts.returncode, ": complete, not checked, 100 instances" in parts.stdout), (0, True))
                    gather = [KEMPE, "gather", folder, "--set", "coupler=1.01", "--angle-unit", unit, "--report", other]
                    self.assertEqual(subprocess.run(gather, capture_output=True).returncode, code)
                    self.assertTrue(one.read_bytes() == other.read_bytes())
                    self.assertEqual(b"velocities were adjusted" in one.read_bytes() and b"do not trust" in one.read_bytes(), name == "doubts")
                    other.unlink()
        done = subprocess.run([KEMPE, "gather", folder, "--report", other], capture_output=True, text=True)
        self.assertEqual((done.returncode, "the results belong to another model" in done.stderr), (2, True))
        done = subprocess.run([KEMPE, "gather", folder, "--set", "coupler=1.01"], capture_output=True, text=True)
        self.assertEqual((done.returncode, "belong to a page: give --report" in done.stderr), (3, True))
        next(folder.glob("part-*.parquet")).unlink()
        other.unlink(missing_ok=True)
        done = subprocess.run(gather, capture_output=True, text=True)
        self.assertEqual((done.returncode, "1 of 7 parts is missing" in done.stderr, other.exists()), (1, True, False))

    def histories(self):
        return {path.name: path.read_bytes() for path in sorted((self.folder / "history").iterdir())}

    def test_history(self):
        """Histories of chosen instances: the bytes of a run for any threads and shares, after kills and losses."""
        words = ["--history", "3,40:42,240", "--output-step", "0.05"]
        chosen = [3, 40, 41, 42, 240]
        self.assertEqual(run(self.folder, *words).returncode, 0)
        whole = self.histories()
        self.assertEqual(list(whole), ["part-000000.parquet", "part-000002.parquet", "part-000014.parquet"])
        parts = [path.read_bytes() for path in sorted(self.folder.glob("part-*"))]
        table, ends = self.place / "history.csv", self.place / "ends.csv"
        gather = [KEMPE, "gather", self.folder, "-o", ends, "--history-output", table]
        subprocess.run(gather, check=True, capture_output=True)
        other = self.place / "history_of_table.csv"
        subprocess.run([KEMPE, *TABLE, *words, "--history-output", other], check=True, capture_output=True)
        self.assertEqual(table.read_bytes(), other.read_bytes())
        head, *rows = table.read_text().splitlines()
        self.assertEqual([int(row.split(",")[0]) for row in rows], [k for k in chosen for _ in range(7)])
        names, *all_ends = (line.split(",") for line in ends.read_text().splitlines())
        for k in chosen:  # the rows of simulate, and the end of the table of ends
            motion = self.place / "instance.csv"
            replay = [KEMPE, "simulate", "--from", self.folder, "--instance", str(k), "-o", motion]
            subprocess.run([*replay, "--output-step", "0.1"], check=True, capture_output=True)  # instead of that of the run
            self.assertEqual([row.split(",")[0] for row in motion.read_text().splitlines()[1:]], ["0", "0.1", "0.2", "0.3"])
            subprocess.run(replay, check=True, capture_output=True)
            mine = [row.split(",", 1)[1] for row in rows if row.startswith(f"{k},")]
            self.assertEqual([head.split(",", 1)[1], *mine], motion.read_text().splitlines())
            for name in ("q.crank", "q.rocker", "qd.crank"):
                last = float(mine[-1].split(",")[head.split(",").index(name) - 1])
                self.assertAlmostEqual(last, float(all_ends[k - 1][names.index(name)]), delta=1e-6)
        for shares in (1, 2, 3, 7):
            shutil.rmtree(self.folder)
            jobs = [subprocess.Popen([KEMPE, *STUDY, *words, "--threads", str(1 + shares % 2), "--out", self.folder, "--shard",
                                      f"{k + 1}/{shares}"], stdout=subprocess.DEVNULL) for k in range(shares)]
            self.assertEqual([job.wait(300) for job in jobs], [0] * shares)
            self.assertEqual(self.histories(), whole)
        chance = random.Random(3)
        shutil.rmtree(self.folder)
        kills, span = 0, 0.2
        while kills < KILLS:
            job = subprocess.Popen([KEMPE, *STUDY, *words, "--threads", "1", "--out", self.folder, "--resume"],
                                   stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
            time.sleep(chance.uniform(0, span))
            job.send_signal(signal.SIGKILL)
            if job.wait() == 0:
                shutil.rmtree(self.folder)
                span *= 0.7
                continue
            kills += 1
            for name in whole:  # a whole part has its histories
                if (self.folder / name).exists():
                    self.assertEqual((self.folder / "history" / name).read_bytes(), whole[name])
        for lost in (None, *whole):
            if lost:
                (self.folder / "history" / lost).unlink()
                told = subprocess.run(gather, capture_output=True, text=True)
                self.assertEqual(told.returncode, 1)
                self.assertIn(f"1 of 15 parts is missing: {int(lost[5:11])}; the run with --resume makes it", told.stderr)
            self.assertEqual(run(self.folder, *words, "--resume").returncode, 0)
            self.assertEqual({name: data for name, data in self.histories().items() if name in whole}, whole)
            self.assertEqual([path.read_bytes() for path in sorted(self.folder.glob("part-*"))], parts)
        damaged = self.folder / "history/part-000002.parquet"
        damaged.write_bytes(whole[damaged.name][:100] + b"?" + whole[damaged.name][101:])
        told = subprocess.run([KEMPE, "gather", self.folder], capture_output=True, text=True)
        self.assertEqual((told.returncode, "history/part-000002.parquet: it is damaged" in told.stderr), (1, True))
        for other, reason in ((["--history", "3"], "the list of histories is \"3,40:42,240\" in the folder and \"3\""),
                              (["--output-step", "0.1"], "the time between rows of histories is 0.05 in the folder and 0.1"),
                              (["--history", "241"], "there are no instances 241 to 241: there are 1 to 240")):
            self.assertIn(reason, run(self.folder, *words, *other, "--resume").stderr)
        self.assertIn("the list of histories is", run(self.folder, "--resume").stderr)
        self.assertEqual(run(self.folder.with_name("wrong.kempe"), "--history", "3,,4").returncode, 3)
        self.assertFalse(self.folder.with_name("wrong.kempe").exists())

    def test_histories_that_fail(self):
        """An instance that cannot start has no rows; an impossible one is no failure of the others."""
        values = self.place / "values.csv"
        values.write_text("crank\n3\n0.3\n4\n")
        words = ["ensemble", str(MODEL), "--values", str(values), "--t-end", "0.1", "--quiet", "--history", "1:3"]
        table = self.place / "some.csv"
        done = subprocess.run([KEMPE, *words, "--history-output", table], capture_output=True, text=True)
        self.assertIn("2 failed", done.stdout)
        self.assertEqual({row.split(",")[0] for row in table.read_text().splitlines()[1:]}, {"2"})
        self.assertEqual((done.returncode, run(self.folder, "--chunk", "1", study=words).returncode), (5, 5))
        gathered = self.place / "gathered_some.csv"
        done = subprocess.run([KEMPE, "gather", self.folder, "--history-output", gathered], capture_output=True, text=True)
        self.assertEqual((done.returncode, "1 of 3 instances complete, 2 failed" in done.stdout), (5, True))
        self.assertEqual(gathered.read_bytes(), table.read_bytes())

    def test_plurals(self):
        study = [*TABLE, "--instances", "1", "--threads", "1"]
        text = run(self.folder, study=study).stdout
        self.assertIn(": complete, 1 instance, all passed", text)
        self.assertNotRegex(text, r"(?<!\.)\b1 \w+s\b")  # 428.1 instances per second is a rate

    def test_engines(self):
        """Processes of an engine, as it starts them."""
        environment = {**os.environ, "OMPI_ALLOW_RUN_AS_ROOT": "1", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1"}
        command = [KEMPE, *STUDY, "--threads", "1", "--out", str(self.folder), "--shard", "auto"]
        engines = {"mpirun": ["mpirun", "--oversubscribe", "-n", "2", *command],
                   "parallel": ["parallel", "-j2", "-N0", *command, ":::", "1", "2"]}
        found = 0
        for name, words in engines.items():
            if not shutil.which(name):
                continue
            shutil.rmtree(self.folder, ignore_errors=True)
            done = subprocess.run(words, capture_output=True, text=True, timeout=300, env=environment)
            self.assertEqual(done.returncode, 0, done.stderr)
            self.assert_whole()
            found += 1
        if not found:
            self.skipTest("neither mpirun nor parallel is installed")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("kempe")
    parser.add_argument("--kills", type=int, default=4)
    options, rest = parser.parse_known_args()
    KEMPE, KILLS = str(pathlib.Path(options.kempe).resolve()), options.kills
    unittest.main(argv=[sys.argv[0], *rest])
