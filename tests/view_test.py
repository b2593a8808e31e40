#!/usr/bin/env python3
"""The page of a run that goes on, and of one that was recorded, to clients that are no browsers: what they may see, and what
the hostile among them can do.

  view_test.py DEEPUAV
"""
import json
import shutil
import subprocess
import tempfile
import threading
import time
from pathlib import Path

import layered_scene
from program_under_test import TIMEOUT_S, command, main
from scene_test_case import SceneTest
from view_clients import HOSTILE, Farewell, Program, Siege, message

GOING_AWAY = 1001
MOST_VIEWERS, MOST_REQUESTS_PER_S = 16, 100  # As the server allows.
PATIENCE_S = 4  # After which it takes who answers no ping for one that does not read.
RESULTS = ("trajectory.txt", "keyframes.txt", "points.ply", "frames.csv", "map.deepuav")


class ViewTest(SceneTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.recorded = cls.scratch / "recorded"
        subprocess.run(command("run", cls.scene, "--out", cls.recorded, "--log-level", "off"), check=True,
                       capture_output=True)

    def start(self, *arguments):
        log = Path(tempfile.mkdtemp(prefix="log-", dir=self.scratch)) / "log"
        program = Program(log, *arguments, "--port", "0")
        self.addCleanup(program.stop)
        return program

    def live(self, *arguments):
        out = Path(tempfile.mkdtemp(prefix="live-", dir=self.scratch))
        return self.start("live", self.scene, "--loop", "--out", out, "--view", "--save-every", "0", *arguments)

    def test_messages_come(self):
        program = self.live()
        client, status = program.handshake()
        self.assertEqual(status, 101)
        kinds, frames, end = set(), set(), time.monotonic() + TIMEOUT_S
        while kinds < {"status", "picture", "map", "events"} or len(frames) < 10:
            self.assertLess(time.monotonic(), end, (kinds, frames))
            kind, header = message(client)
            kinds.add(kind)
            if kind == "status":
                frames.add(header["frame"])
                self.assertLess(header["latency_ms"], 5000)
                state = header
        self.assertEqual(state["link"], "open")
        self.assertGreater(state["memory_mb"], 10)
        self.assertIn("network", state["stages_ms"])
        client.close()

    def test_it_is_there_while_the_lens_is_looked_for(self):
        images = self.scratch / "no-calibration"
        shutil.copytree(self.scene / "mav0/cam0/data", images)
        out = self.scratch / "learning"
        program = self.start("live", images, "--loop", "--out", out, "--view", "--save-every", "0")
        client, status = program.handshake()
        self.assertEqual(status, 101)
        lines, end = [], time.monotonic() + TIMEOUT_S
        while not any("the lens is looked for" in line for line in lines):
            self.assertLess(time.monotonic(), end, lines)
            kind, header = message(client)
            lines += header["lines"] if kind == "events" else []
        self.assertNotIn("map 0 starts", program.text())
        client.close()
        taken = subprocess.run(command("live", images, "--out", self.scratch / "taken", "--view", "--port", program.port),
                               capture_output=True, text=True, timeout=TIMEOUT_S)
        self.assertEqual(taken.returncode, 1)
        self.assertIn("no page can be served there", taken.stderr)
        self.assertNotIn("the lens is looked for", taken.stderr)

    def test_a_survey_is_watched_while_it_grows(self):
        photographs = layered_scene.photographs(self.scene, self.scratch / "photographs")
        alone, out = self.scratch / "survey", self.scratch / "watched-survey"
        run = ("run", photographs, "--log-level", "off", "--out")
        subprocess.run(command(*run, alone), check=True, capture_output=True)
        program = self.start(*run, out, "--view")
        client, status = program.handshake()
        self.assertEqual(status, 101)
        pictures, keyframes = set(), 0
        with self.assertRaises(Farewell) as end:
            while True:
                kind, header = message(client)
                if kind == "picture":
                    pictures.add(header["frame"])
                if kind == "map":
                    keyframes = header["keyframes"]
        self.assertEqual(end.exception.code, GOING_AWAY)
        client.close()
        self.assertEqual(program.process.wait(TIMEOUT_S), 0)
        self.assertGreater(len(pictures), 1)
        self.assertEqual(keyframes, json.loads((out / "summary.json").read_text())["maps"][0]["keyframes"])
        for name in RESULTS:
            self.assertEqual((out / name).read_bytes(), (alone / name).read_bytes(), name)

    def test_only_its_page_may_look(self):
        program = self.start("view", self.recorded)
        status, headers, body = program.get()
        self.assertEqual((status, headers["X-Frame-Options"]), (200, "DENY"))
        self.assertIn("default-src 'none'", headers["Content-Security-Policy"])
        self.assertIn(b"Deep-UAV SLAM", body)
        for host in ("evil.example", f"evil.example:{program.port}", f"192.168.1.7:{program.port}"):
            self.assertEqual(program.get(Host=host)[0], 421, host)
        self.assertEqual(program.get(Host="localhost:9000")[0], 200)  # A port that SSH forwards.
        self.assertEqual(program.get(Origin="http://evil.example")[0], 403)
        for target in ("/../../etc/passwd", "//etc/passwd", "/%2e%2e/%2e%2e/etc/passwd", "/view.html", "/messages"):
            self.assertEqual(program.get(target)[0], 404, target)
        for arguments, expected in (({"origin": "http://evil.example"}, 403), ({"origin": ""}, 403),
                                    ({"host": "evil.example"}, 421), ({"target": "/other"}, 404),
                                    ({"host": "localhost:9000", "origin": "http://localhost:8000"}, 403),
                                    ({"host": "localhost:9000", "origin": "http://localhost:9000"}, 101)):
            client, status = program.handshake(**arguments)
            client.close()
            self.assertEqual(status, expected, arguments)

    def test_others_need_the_token(self):
        program = self.start("view", self.recorded, "--listen", "0.0.0.0")
        self.assertEqual(len(program.token), 32)
        self.assertFalse(program.host.startswith("0.0.0.0"))
        self.assertEqual(program.text().count(program.token), 1)
        for target in ("/", "/?token=" + "0" * 32, "/three.min.js"):
            self.assertEqual(program.get(target)[0], 403, target)
        client, status = program.handshake()
        client.close()
        self.assertEqual(status, 403)
        status, headers, _ = program.get("/?token=" + program.token)
        self.assertEqual((status, headers["Location"]), (303, "/"))
        cookie = headers["Set-Cookie"].split(";")[0]
        self.assertEqual(program.get(Cookie=cookie)[0], 200)
        client, status = program.handshake(cookie=cookie)
        client.close()
        self.assertEqual(status, 101)
        for host, expected in ((f"192.168.1.7:{program.port}", 200), ("192.168.1.7:1", 421),  # Given later, as by DHCP.
                               (f"evil.example:{program.port}", 421), ("LocalHost:9000", 200)):
            self.assertEqual(program.get(Cookie=cookie, Host=host)[0], expected, host)

    def test_wrong_tokens_are_refused(self):
        program = self.start("view", self.recorded, "--listen", "0.0.0.0")
        for wrong in ("", "0" * 32, program.token[:-1], program.token + "0", "%" + program.token):
            self.assertEqual(program.get(f"/?token={wrong}")[0], 403, wrong)
            self.assertEqual(program.get(Cookie=f"deepuav_view_{program.port}={wrong}")[0], 403, wrong)
            client, status = program.handshake(f"/messages?token={wrong}")
            client.close()
            self.assertEqual(status, 403, wrong)
        client, status = program.handshake(program.messages)
        client.close()
        self.assertEqual(status, 101)

    def test_an_address_asks_so_often_a_second(self):
        program = self.start("view", self.recorded, "--listen", "0.0.0.0")
        request = f"GET /?token={program.token} HTTP/1.1\r\nHost: {program.host}\r\n\r\n".encode()
        with program.connect() as client:  # Which counts as well.
            client.sendall(request * MOST_REQUESTS_PER_S)
            answers = b"".join(iter(lambda: client.recv(65536), b""))
        refused = 0 if program.host.startswith("localhost") else 1  # A machine without a network has the loopback alone.
        self.assertEqual(answers.count(b"HTTP/1.1 303 "), MOST_REQUESTS_PER_S - refused)
        self.assertEqual(answers.count(b"HTTP/1.1 429 "), refused)
        time.sleep(1.1)
        self.assertEqual(program.get(f"/?token={program.token}")[0], 303)

    def test_misuse(self):
        for arguments, told in ((("view", self.scratch / "nothing"), "nothing"),
                                (("view", self.recorded, "--listen", "moon"), "moon"),
                                (("view", self.recorded, "--port", "70000"), "--port")):
            done = subprocess.run(command(*arguments), capture_output=True, text=True)
            self.assertNotEqual(done.returncode, 0)
            self.assertIn(told, done.stderr)
            self.assertEqual(len(done.stderr.splitlines()), 1)
        taken = self.start("view", self.recorded)
        done = subprocess.run(command("view", self.recorded, "--port", taken.host.split(":")[1]), capture_output=True,
                              text=True)
        self.assertEqual(done.returncode, 1)
        self.assertIn("no page can be served there", done.stderr)

    def test_hostile_clients_change_nothing(self):
        scene, alone, out = (self.scratch / name for name in ("long", "alone", "watched"))
        to_and_fro(self.scene, scene)
        run = ("run", scene, "--schedule", "threaded", "--log-level", "off", "--out")
        subprocess.run(command(*run, alone), check=True, capture_output=True)
        program = self.start(*run, out, "--view")
        siege = Siege(program)
        self.assertEqual(program.process.wait(TIMEOUT_S), 0)
        siege.end()
        self.assertGreater(siege.done.value, 2 * HOSTILE)
        for name in RESULTS:
            self.assertEqual((out / name).read_bytes(), (alone / name).read_bytes(), name)

    def test_hostile_clients_lock_no_one_out(self):
        self.check_no_one_is_locked_out(self.live())

    def test_hostile_clients_with_the_token_lock_no_one_out(self):
        program = self.live("--listen", "0.0.0.0")
        program.host = f"localhost:{program.port}"  # Not held up by how many requests come from one address.
        self.check_no_one_is_locked_out(program)

    def check_no_one_is_locked_out(self, program):
        own, status = program.handshake(program.messages)
        self.assertEqual(status, 101)
        while message(own)[0] != "picture":
            pass
        before = program.resident_mb()
        siege = Siege(program)
        self.addCleanup(siege.end)
        watch(own, 5)
        updates, frames = watch(own, 5)
        self.assertGreater(updates, 20)
        self.assertGreater(frames, 10)
        own.close()
        self.check_a_newcomer(program)
        self.assertEqual(program.get("/?token=" + program.token)[0], 303 if program.token else 200)
        after = program.resident_mb()
        siege.end()
        self.assertEqual(siege.let_in.value, 0)
        self.assertLess(after, before + 100)

    def check_a_newcomer(self, program):
        """One that comes again when it is dropped, as the page does."""
        refusals = []
        for _ in range(3):
            client, status = program.handshake(program.messages)
            try:
                with client:
                    self.assertIn(status, (0, 101))  # 0: dropped before it was answered.
                    self.assertGreater(watch(client, 5)[0], 20)
                    return
            except ConnectionError as refusal:
                refusals.append(refusal)
            time.sleep(2)
        self.fail(refusals)

    def test_who_reads_keeps_his_place(self):
        program = self.start("view", self.recorded)
        clients = []
        for _ in range(MOST_VIEWERS):
            client, status = program.handshake()
            self.assertEqual(status, 101)
            clients.append(client)
            message(client)  # After it the question whether it reads, which it answers on the way.
        watched = [[] for _ in clients]
        threads = [threading.Thread(target=lambda c, w: w.append(watch(c, PATIENCE_S + 3)), args=pair, daemon=True)
                   for pair in zip(clients, watched)]
        for thread in threads:
            thread.start()
        end = time.monotonic() + PATIENCE_S + 2
        while time.monotonic() < end:
            client, status = program.handshake()
            client.close()
            self.assertEqual(status, 503)
            time.sleep(0.2)
        for thread in threads:
            thread.join(TIMEOUT_S)
        for client, result in zip(clients, watched):
            client.close()
            self.assertEqual(len(result), 1)  # None was dropped.
            self.assertGreater(result[0][0], 10)


def watch(client, seconds):
    """How many messages come in so many seconds, and of how many frames."""
    end, updates, frames = time.monotonic() + seconds, 0, set()
    while time.monotonic() < end:
        kind, header = message(client)
        updates += 1
        if kind == "status":
            frames.add(header["frame"])
    return updates, len(frames)


def to_and_fro(scene, longer, times=6):
    """The sequence forwards and backwards, again and again."""
    shutil.copytree(scene, longer)
    table = longer / "mav0/cam0/data.csv"
    head, *rows = table.read_text().splitlines()
    names = [row.split(",")[1] for row in rows]
    names = (names + names[-2:0:-1]) * times
    table.write_text("\n".join([head] + [f"{10**9 + i * 10**8},{name}" for i, name in enumerate(names)]) + "\n")


if __name__ == "__main__":
    main(__doc__)
