"""Clients of a page that are no browsers: those that ask for it and its messages, and hostile ones."""
import base64
import http.client
import json
import multiprocessing
import os
import random
import re
import signal
import socket
import struct
import subprocess
import threading
import time

from program_under_test import TIMEOUT_S, UnderWay

HOSTILE = 200


class Program(UnderWay):
    """`deepuav` with a page, under way."""

    def __init__(self, log, *arguments):
        super().__init__(log, *arguments, stdout=subprocess.DEVNULL)
        self.url = self.wait_for(r"watch at (http://\S+)")[1]
        self.host = re.match(r"http://([^/]+)", self.url)[1]
        self.token = self.url.partition("token=")[2]
        self.messages = "/messages" + (f"?token={self.token}" if self.token else "")

    @property
    def port(self):
        return self.host.rpartition(":")[2]

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
        self.done = self.let_in = 0

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
        """Where none is needed, as the page of someone else."""
        origin = None if self.program.token else "http://evil.example"
        client, status = self.program.handshake("/messages?token=" + "f" * 32, origin=origin)
        client.close()
        self.let_in += status == 101
        if self.program.token:
            self.let_in += self.program.get("/?token=" + "f" * 32)[0] != 403

    def slow_reader(self):
        client, status = self.program.handshake(self.program.messages)
        with client:
            while status == 101 and not self.over.wait(1):
                client.recv(1)

    def chatter(self):
        client, status = self.program.handshake(self.program.messages)
        with client:
            while status == 101 and not self.over.is_set():
                client.sendall(frame(b"x" * 100) + frame(b"", opcode=9))

    def endless_body(self):
        with self.program.connect() as client:
            client.sendall(f"POST / HTTP/1.1\r\nHost: {self.program.host}\r\nContent-Length: 100000000\r\n\r\n".encode())
            for _ in range(100):
                client.sendall(b"b" * 1_000_000)


class Siege:
    """Hostile clients of all kinds, in a process of their own: as threads of this one they would slow its clients down."""

    def __init__(self, program):
        self.over = multiprocessing.Event()
        self.done, self.let_in = multiprocessing.Value("i"), multiprocessing.Value("i")
        self.process = multiprocessing.Process(target=self.run, args=(program,), daemon=True)
        self.process.start()

    def run(self, program):
        clients = [Hostile(program, kind, self.over) for kind in range(HOSTILE)]
        for client in clients:
            client.start()
        self.over.wait()
        for client in clients:
            client.join(30)
        self.done.value = sum(client.done for client in clients)
        self.let_in.value = sum(client.let_in for client in clients)

    def end(self):
        self.over.set()
        self.process.join(TIMEOUT_S)
