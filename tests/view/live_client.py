"""Speaks with `sim view` as a page does, and as somebody who means no good, with sockets alone."""

import base64
import json
import os
import re
import signal
import socket
import struct
import subprocess
import tempfile


class Server:
    """A `sim view` that runs as long as the block, and its recording."""

    def __init__(self, program, *arguments, stderr=subprocess.PIPE, record=True):
        # A comparison of methods has no recording.
        record = record and arguments.count("-i") < 2
        self.arguments = arguments
        self.record = tempfile.mktemp(suffix=".rec") if record else ""
        record = ["--record", self.record] if self.record else []
        self.process = subprocess.Popen(
            [program, "view", *arguments, "--no-open", *record],
            stdout=subprocess.PIPE, stderr=stderr, text=True)
        self.take_address()

    def take_address(self):
        self.address = self.process.stdout.readline().strip()
        found = re.fullmatch(r"http://127\.0\.0\.1:(\d+)/([0-9a-f]{32})/", self.address)
        if not found:
            raise RuntimeError("no address: " + self.address + self.process.stderr.read())
        self.port, self.token = int(found[1]), found[2]

    def stop(self, seconds=10):
        """Ends it as Ctrl-C does; its exit code."""
        self.process.send_signal(signal.SIGINT)
        return self.process.wait(seconds)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        if self.process.poll() is None:
            self.process.kill()
            self.process.wait()
        if os.path.exists(self.record):
            os.remove(self.record)

    def get(self, path, host=None, at="127.0.0.1"):
        """The status and the body."""
        answer = self.exchange(f"GET {path} HTTP/1.1\r\nHost: {host or '127.0.0.1:%d' % self.port}"
                               "\r\nConnection: close\r\n\r\n", at)
        head, _, body = answer.partition(b"\r\n\r\n")
        return (int(head.split()[1]) if head else 0), body

    def exchange(self, request, at="127.0.0.1"):
        """All that comes back for these bytes until the connection ends."""
        with socket.create_connection((at, self.port), 10) as one:
            answer = b""
            try:
                one.sendall(request.encode("latin-1") if isinstance(request, str) else request)
                while more := one.recv(65536):
                    answer += more
            except (ConnectionResetError, BrokenPipeError):
                pass
        return answer


class Refused(Exception):
    pass


class Socket:
    def __init__(self, server, path=None, origin="own", host=None, at="127.0.0.1"):
        self.socket = socket.create_connection((at, server.port), 10)
        host = host or f"127.0.0.1:{server.port}"
        lines = [f"GET {path or '/' + server.token + '/socket'} HTTP/1.1", f"Host: {host}",
                 "Upgrade: websocket", "Connection: Upgrade", "Sec-WebSocket-Version: 13",
                 "Sec-WebSocket-Key: " + base64.b64encode(os.urandom(16)).decode()]
        if origin:
            lines.append("Origin: " + ("http://" + host if origin == "own" else origin))
        self.socket.sendall(("\r\n".join(lines) + "\r\n\r\n").encode())
        self.buffer = b""
        try:
            while b"\r\n\r\n" not in self.buffer:
                more = self.socket.recv(65536)
                if not more:
                    raise Refused("closed")
                self.buffer += more
        except ConnectionResetError as error:
            raise Refused("reset") from error
        head, self.buffer = self.buffer.split(b"\r\n\r\n", 1)
        if b" 101 " not in head.split(b"\r\n")[0]:
            raise Refused(head.split(b"\r\n")[0].decode())
        self.state = None

    def close(self):
        self.socket.close()

    def send_raw(self, first, payload, masked=0x80):
        size = len(payload)
        head = struct.pack("!B", first)
        if size < 126:
            head += struct.pack("!B", masked | size)
        elif size < 65536:
            head += struct.pack("!BH", masked | 126, size)
        else:
            head += struct.pack("!BQ", masked | 127, size)
        self.socket.sendall(head + (b"\0\0\0\0" if masked else b"") + payload)

    def say(self, text):
        self.send_raw(0x81, text.encode())

    def _take(self, count):
        while len(self.buffer) < count:
            more = self.socket.recv(1 << 20)
            if not more:
                raise Refused("closed")
            self.buffer += more
        taken, self.buffer = self.buffer[:count], self.buffer[count:]
        return taken

    def receive(self):
        """One message: text, or the words of a frame, which are answered as drawn."""
        first, size = self._take(2)
        if size == 126:
            size = struct.unpack("!H", self._take(2))[0]
        elif size == 127:
            size = struct.unpack("!Q", self._take(8))[0]
        payload = self._take(size)
        if first & 15 == 8:
            raise Refused("closed: " + payload[2:].decode())
        if first & 15 == 1:
            return json.loads(payload)
        self.size = len(payload)
        length = struct.unpack("<I", payload[:4])[0]
        self.state = json.loads(payload[4:4 + length])
        self.bytes_of_points = len(payload) - 4 - length
        self.say("drawn")
        return self.state

    def until(self, true):
        for _ in range(600):
            message = self.receive()
            if "systems" in message and true(message):
                return message
        raise AssertionError("did not come true: " + json.dumps(self.state)[:300])

    def error_of(self, text):
        """What it answers to something bad."""
        self.say(text)
        for _ in range(300):
            message = self.receive()
            if "error" in message:
                return message["error"]
        raise AssertionError("no error for " + text)


def replay(program, record):
    """The exit code and the words of a replay."""
    done = subprocess.run([program, "--replay", record], capture_output=True, text=True,
                          check=False)
    return done.returncode, done.stdout + done.stderr
