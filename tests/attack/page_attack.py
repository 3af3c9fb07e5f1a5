#!/usr/bin/env python3
"""page_attack.py SIM [COUNT [SEED]]: COUNT random requests and as many WebSocket frames for `sim view`.

Requests are cut, damaged, doubled, without the token or with it; frames are of every kind, length
and mask, with commands that make sense and such that do not. Only one server on 127.0.0.1 is spoken
to. It must go on serving an honest page, let nobody in without the token and the page's origin, keep
its memory within bounds, and end by a signal without a word of a sanitizer."""

import os
import pathlib
import random
import socket
import struct
import subprocess
import sys
import tempfile
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent / "view"))

from live_client import Refused, Server, Socket  # noqa: E402

HOLD = 40  # connections that are left open
MEMORY = 400 << 20  # bytes more than at the start; with the shadow of a sanitizer
HEADERS = ("Connection: Upgrade", "Connection: close", "Connection: keep-alive, Upgrade", "Upgrade: websocket",
           "Upgrade: h2c", "HTTP2-Settings: AAMAAABkAARAAAAAAAIAAAAA", "Sec-WebSocket-Version: 13",
           "Sec-WebSocket-Version: 8", "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==", "Sec-WebSocket-Key: x",
           "Sec-WebSocket-Protocol: sim", "Sec-WebSocket-Extensions: permessage-deflate", "Content-Length: 5",
           "Content-Length: -1", "Content-Length: 99999999999999999999", "Transfer-Encoding: chunked",
           "Transfer-Encoding: identity, chunked", "Expect: 100-continue", "Origin: null",
           "Origin: http://evil.example", "Host: evil.example", "Host:", " folded", "X: \x00", "X" * 300,
           "Cookie: " + "c" * 9000, "Range: bytes=0-", "Referer: http://evil.example/")
COMMANDS = ("play", "pause", "reset", "undo", "hello", "drawn", "bye", "step 1", "step 1000", "back 3", "goto 0.2",
            "goto 1e9", "speed 2", "speed 0", "dt 0.001", "dt nan", "integrator verlet", "integrator rk4",
            "integrator rk4:precision=single", "integrator auto", "grab 3", "grab -1", "pull 3 0 0 1",
            "pull 3 1e9 nan 0", "release 3", "pin 5", "unpin 5", "switch wind on", "position 3 0 0 1",
            "velocity 3 1 0 0", "component 0 1", "colour energy", "colour error", "colour mode", "colour x",
            "set n 3", "set n none", "set x 1", "", " ", ":", "a: pin 3", "move 3 0 0 0 over 5")


def request_of(rng, server):
    """Bytes that may be a request."""
    host = f"127.0.0.1:{server.port}"
    token = rng.choice((server.token, server.token, "0" * 32, server.token[:-1], ""))
    path = rng.choice(("/{}/", "/{}/", "/{}/socket", "/{}/socket", "/{}/socket/", "/{}", "/", "*", "/{}/x",
                       "/../{}/", "http://h/{}/")).format(token)
    method = rng.choice(("GET",) * 6 + ("POST", "HEAD", "PRI", "CONNECT", "get", "G" * 400))
    lines = [f"{method} {path} " + rng.choice(("HTTP/1.1",) * 6 + ("HTTP/1.0", "HTTP/2.0", "HTTP/9", ""))]
    if rng.random() < 0.9:
        lines.append("Host: " + rng.choice((host, host, "localhost", "[::1]:1", "evil.example", "a" * 500)))
    if rng.random() < 0.4:
        lines += ["Connection: Upgrade", "Upgrade: websocket", "Sec-WebSocket-Version: 13",
                  "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ=="]
        if rng.random() < 0.8:
            lines.append(f"Origin: http://{host}")
    lines += rng.sample(HEADERS, rng.choice((0, 0, 1, 1, 2, 5)))
    data = ("\r\n".join(lines) + "\r\n\r\n").encode("latin-1")
    kind = rng.randrange(8)
    if kind == 0:
        data = data[:rng.randrange(len(data))]
    elif kind == 1:
        data += data + rng.randbytes(rng.randrange(2000))
    elif kind == 2:
        data = bytearray(data)
        for _ in range(rng.randrange(1, 6)):
            data[rng.randrange(len(data))] = rng.randrange(256)
        data = bytes(data)
    elif kind == 3:
        data = rng.randbytes(rng.choice((1, 30, 3000, 20000)))
    return data


def may_enter(data, server, upgraded):
    """Whether a request deserves its answer."""
    path = server.token + ("/socket" if upgraded else "/")
    origin = not upgraded or b"\r\nOrigin: http://127.0.0.1:%d\r\n" % server.port in data \
        or b"\r\nOrigin: http://localhost\r\n" in data
    return data.startswith(f"GET /{path} HTTP/1.1\r\n".encode()) and origin


def one_request(rng, server, held):
    """Sends one; what is wrong with the answer, or nothing."""
    data = request_of(rng, server)
    one = socket.create_connection(("127.0.0.1", server.port), 60)
    try:
        if rng.random() < 0.1:  # slowly
            cut = rng.randrange(len(data) + 1)
            one.sendall(data[:cut])
            one.sendall(data[cut:])
        else:
            one.sendall(data)
        if rng.random() < 0.2:  # never ends, or not until much later
            held.append(one)
            if len(held) > HOLD:
                end(rng, held.pop(rng.randrange(len(held))))
            return ""
        if rng.random() < 0.5 or b"\r\n\r\n" not in data:
            one.shutdown(socket.SHUT_WR)
        answer = one.recv(4096)
    except (ConnectionError, BrokenPipeError, OSError) as error:
        if isinstance(error, TimeoutError):
            return "no answer in a minute"
        answer = b""
    end(rng, one)
    if answer.startswith(b"HTTP/1.1 200") and not may_enter(data, server, False):
        return "it showed the page"
    if answer.startswith(b"HTTP/1.1 101") and not may_enter(data, server, True):
        return "it let somebody in"
    return ""


def end(rng, one):
    if rng.random() < 0.3:
        one.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
    one.close()


def frame_of(rng):
    """The bytes of one frame."""
    payload = rng.choice(COMMANDS).encode()
    kind = rng.randrange(12)
    if kind == 0:
        payload = rng.randbytes(rng.choice((0, 1, 125, 126, 4096, 4097, 70000)))
    elif kind == 1 and payload:
        payload = bytearray(payload)
        payload[rng.randrange(len(payload))] = rng.randrange(256)
    first = rng.choice((0x81,) * 40 + (0x01, 0x00, 0x80, 0x82, 0x88, 0x89, 0x8A, 0x8F, 0xC1, rng.randrange(256)))
    size = len(payload)
    stated = size if rng.random() < 0.98 else rng.choice((0, 126, 65536, 2**31, 2**63 - 1, 2**64 - 1))
    if stated < 126 and rng.random() < 0.95:
        head = struct.pack("!BB", first, 0x80 | stated)
    elif stated < 65536 and rng.random() < 0.95:
        head = struct.pack("!BBH", first, 0x80 | 126, stated)
    else:
        head = struct.pack("!BBQ", first, 0x80 | 127, stated)
    if rng.random() < 0.01:
        return bytes((head[0], head[1] & 0x7F)) + head[2:] + bytes(payload)  # not masked
    mask = rng.randbytes(4)
    return head + mask + bytes(byte ^ mask[i % 4] for i, byte in enumerate(payload))


def frames(rng, server, count):
    """Sends up to so many on one connection; how many it took."""
    try:
        page = Socket(server)
    except (Refused, ConnectionError):
        return 1
    page.socket.settimeout(60)
    sent = 0
    try:
        while sent < count:
            page.socket.sendall(frame_of(rng))
            sent += 1
            if rng.random() < 0.3:
                page.socket.setblocking(False)
                try:
                    while page.socket.recv(1 << 16):
                        pass
                    break
                except BlockingIOError:
                    pass
                finally:
                    page.socket.settimeout(60)
    except TimeoutError:
        pass  # it reads no more of one whose commands wait
    except ConnectionError:
        pass
    end(rng, page.socket)
    return max(1, sent)


def memory(server):
    with open(f"/proc/{server.process.pid}/statm", encoding="ascii") as file:
        return int(file.read().split()[1]) * os.sysconf("SC_PAGE_SIZE")


def honest(server):
    """What an honest page misses, or nothing."""
    if server.process.poll() is not None:
        return f"it ended with {server.process.returncode}"
    status, page = server.get(f"/{server.token}/")
    if status != 200 or b"</script></html>" not in page:
        return f"no page: {status}"
    for _ in range(50):  # the others may not all have gone yet
        try:
            one = Socket(server)
            one.socket.settimeout(120)
            for _ in range(600):  # commands of those who went may come in between
                one.say("speed 1.5")
                if one.receive().get("speed") == 1.5:
                    one.close()
                    return ""
            return "commands are not taken"
        except (Refused, ConnectionError):
            time.sleep(0.2)
    return "no page gets in"


def attack(server, count, seed):
    """What went wrong, or nothing."""
    start, held, requests, sent = memory(server), [], 0, 0
    for turn in range(seed, sys.maxsize):
        rng = random.Random(turn)
        for _ in range(100):
            if why := one_request(rng, server, held):
                return f"seed {turn}: {why}"
            requests += 1
        while sent < min(count, requests):
            sent += frames(rng, server, rng.choice((1, 5, 50)))
        done = requests >= count and sent >= count
        if turn % 10 == 0 or done:
            if why := honest(server) or ("memory grew" if memory(server) - start > MEMORY else ""):
                return f"seed {turn}: {why}"
        if done:
            break
    for one in held:
        one.close()
    print(f"  {requests} requests, {sent} frames, {(memory(server) - start) >> 20} MB more", flush=True)
    code = server.stop(60)
    return "" if code == 130 else f"exit code {code}"


def main():
    listed = subprocess.run([sys.argv[1], "list", "view"], capture_output=True, text=True, check=False)
    if "web" not in listed.stdout:
        print("skipped: this build has no page, for libboost-dev is missing")
        return 77
    count = int(sys.argv[2]) if len(sys.argv) > 2 else 100_000
    seed = int(sys.argv[3]) if len(sys.argv) > 3 else time.time_ns() % 10**9
    print(f"page attack: {count} requests and frames from seed {seed}", flush=True)
    with tempfile.TemporaryFile("w+") as said:
        with Server(sys.argv[1], "-s", "n=4", stderr=said, record=False) as server:
            why = attack(server, count, seed)
        said.seek(0)
        words = said.read()
    for word in ("Sanitizer", "runtime error", "terminate called", "please report"):
        why = why or (f"it said '{word}'" if word in words else "")
    if why:
        print(f"page attack failed: {why}\n{words[-4000:]}")
    return 1 if why else 0


if __name__ == "__main__":
    sys.exit(main())
