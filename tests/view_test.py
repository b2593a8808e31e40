#!/usr/bin/env python3
"""The page of a run that goes on, and of one that was recorded, to clients that are no browsers: what they may see, and what
the hostile among them can do.

  view_test.py DEEPUAV
"""
import base64
import http.client
import json
import os
import random
import re
import shutil
import signal
import socket
import struct
import subprocess
import tempfile
import threading
import time
from pathlib import Path

import layered_scene
from program_under_test import TIMEOUT_S, UnderWay, command, main
from scene_test_case import FRAMES, SceneTest

HOSTILE = 200
GOING_AWAY = 1001
RESULTS = ("trajectory.txt", "keyframes.txt", "points.ply", "frames.csv", "map.deepuav")


class Program(UnderWay):
    """`deepuav` with a page, under way."""

    def __init__(self, log, *arguments):
        super().__init__(log, *arguments, stdout=subprocess.DEVNULL)
        self.url = self.wait_for(r"watch at (http://\S+)")[1]
        self.host = re.match(r"http://([^/]+)", self.url)[1]
        self.token = self.url.partition("token=")[2]

    def stop(self):
        if self.process.poll() is None:
            self.process.send_signal(signal.SIGINT)
        return self.process.wait(TIMEOUT_S)

    def connect(self):
        name, port = self.host.rsplit(":", 1)
        return socket.create_connection((name, int(port)), timeout=20)

    def get(self, target="/", **headers):
        """Status, headers, body."""
        connection = http.client.HTTPConnection(self.host, timeout=20)
        connection.putrequest("GET", target, skip_host="Host" in headers)
        for name, value in headers.items():
            connection.putheader(name, value)
        connection.endheaders()
        answer = connection.getresponse()
        body = answer.read()
        connection.close()
        return answer.status, answer.headers, body

    def handshake(self, target="/messages", origin=None, host=None, cookie=None):
        """A socket after the answer to a request for a WebSocket, and the answer's status."""
        client = self.connect()
        key = base64.b64encode(os.urandom(16)).decode()
        lines = [f"GET {target} HTTP/1.1", f"Host: {host or self.host}", "Upgrade: websocket", "Connection: Upgrade",
                 f"Sec-WebSocket-Key: {key}", "Sec-WebSocket-Version: 13"]
        if origin != "":
            lines.append(f"Origin: {origin or 'http://' + self.host}")
        if cookie:
            lines.append(f"Cookie: {cookie}")
        client.sendall(("\r\n".join(lines) + "\r\n\r\n").encode())
        answer = b""
        try:
            while b"\r\n\r\n" not in answer:
                piece = client.recv(1)
                if not piece:
                    break
                answer += piece
        except OSError:
            client.close()
            raise
        return client, int(answer.split()[1]) if answer else 0


def receive(client, count):
    data = b""
    while len(data) < count:
        piece = client.recv(count - len(data))
        if not piece:
            raise ConnectionError("closed")
        data += piece
    return data


class Farewell(ConnectionError):
    """Why the server ends the connection, as its own code."""

    def __init__(self, code):
        super().__init__(f"closed: {code}")
        self.code = code


def message(client):
    """(kind, header) of the next message; pings are answered."""
    while True:
        first, length = receive(client, 2)
        if length == 126:
            length = struct.unpack(">H", receive(client, 2))[0]
        elif length == 127:
            length = struct.unpack(">Q", receive(client, 8))[0]
        payload = receive(client, length)
        if first & 0x0F == 8:
            raise Farewell(struct.unpack(">H", payload[:2])[0])
        if first & 0x0F == 9:
            client.sendall(frame(payload, opcode=10))  # Who gives no sign of life is dropped.
        if first & 0x0F in (1, 2):
            break
    if first & 0x0F == 1:
        header = json.loads(payload)
    else:
        size = struct.unpack("<I", payload[:4])[0]
        header = json.loads(payload[4:4 + size])
    return header["kind"], header


def frame(payload, opcode=1):
    """As clients send it: masked."""
    return bytes([0x80 | opcode, 0x80 | len(payload)]) + b"\0\0\0\0" + payload


class Hostile(threading.Thread):
    """A client that does one bad thing after another until it is told to end."""

    def __init__(self, program, kind, over):
        super().__init__(daemon=True)
        self.program, self.kind, self.over = program, kind, over
        self.done = 0

    def run(self):
        deeds = (self.garbage, self.half_open, self.slow_request, self.huge_header, self.wrong_token, self.slow_reader,
                 self.chatter, self.endless_body)
        while not self.over.is_set():
            try:
                deeds[self.kind % len(deeds)]()
            except (OSError, http.client.HTTPException):
                pass  # Shut out, as it should be.
            self.done += 1
            time.sleep(0.05)

    def garbage(self):
        with self.program.connect() as client:
            client.sendall(random.Random(self.kind).randbytes(4000))
            client.recv(1000)

    def half_open(self):
        with self.program.connect():
            self.over.wait(3)

    def slow_request(self):
        with self.program.connect() as client:
            for letter in b"GET / HTTP/1.1\r\nHost: x\r\n" * 10:
                client.sendall(bytes([letter]))
                if self.over.wait(0.1):
                    return

    def huge_header(self):
        with self.program.connect() as client:
            client.sendall(b"GET / HTTP/1.1\r\nX: ")
            for _ in range(100):
                client.sendall(b"a" * 1_000_000)

    def wrong_token(self):
        client, _ = self.program.handshake("/messages?token=0123456789abcdef", origin="http://evil.example")
        client.close()
        self.program.get("/?token=" + "f" * 32)

    def slow_reader(self):
        client, status = self.program.handshake()
        with client:
            while status == 101 and not self.over.wait(1):
                client.recv(1)

    def chatter(self):
        client, status = self.program.handshake()
        with client:
            while status == 101 and not self.over.is_set():
                client.sendall(frame(b"x" * 100) + frame(b"", opcode=9))

    def endless_body(self):
        with self.program.connect() as client:
            client.sendall(f"POST / HTTP/1.1\r\nHost: {self.program.host}\r\nContent-Length: 100000000\r\n\r\n".encode())
            for _ in range(100):
                client.sendall(b"b" * 1_000_000)


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
        self.assertEqual(program.get(Host="evil.example")[0], 421)
        self.assertEqual(program.get(Origin="http://evil.example")[0], 403)
        for target in ("/../../etc/passwd", "//etc/passwd", "/%2e%2e/%2e%2e/etc/passwd", "/view.html", "/messages"):
            self.assertEqual(program.get(target)[0], 404, target)
        for arguments, expected in (({"origin": "http://evil.example"}, 403), ({"origin": ""}, 403),
                                    ({"host": "evil.example"}, 421), ({"target": "/other"}, 404)):
            client, status = program.handshake(**arguments)
            client.close()
            self.assertEqual(status, expected, arguments)

    def test_others_need_the_token(self):
        program = self.start("view", self.recorded, "--listen", "0.0.0.0")
        self.assertEqual(len(program.token), 32)
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
        over = threading.Event()
        clients = [Hostile(program, kind, over) for kind in range(HOSTILE)]
        for client in clients:
            client.start()
        self.assertEqual(program.process.wait(TIMEOUT_S), 0)
        over.set()
        for client in clients:
            client.join(30)
        self.assertGreater(sum(client.done for client in clients), 2 * HOSTILE)
        for name in RESULTS:
            self.assertEqual((out / name).read_bytes(), (alone / name).read_bytes(), name)

    def test_hostile_clients_lock_no_one_out(self):
        program = self.live()
        own, status = program.handshake()
        self.assertEqual(status, 101)
        while message(own)[0] != "picture":
            pass
        before = program.resident_mb()
        over = threading.Event()
        clients = [Hostile(program, kind, over) for kind in range(HOSTILE) if kind % 8 != 5]  # These would be viewers.
        for client in clients:
            client.start()
        time.sleep(5)
        began, updates, frames = time.monotonic(), 0, set()
        while time.monotonic() - began < 5:
            kind, header = message(own)
            updates += 1
            if kind == "status":
                frames.add(header["frame"])
        self.assertGreater(updates, 20)
        self.assertGreater(len(frames), 10)
        self.assertEqual(program.get()[0], 200)
        after = program.resident_mb()
        over.set()
        for client in clients:
            client.join(30)
        own.close()
        self.assertLess(after, before + 100)


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
