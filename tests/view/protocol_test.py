#!/usr/bin/env python3
"""The server behind the page, without a browser: who is let in, what is understood, what it costs,
and that whatever hands did comes again with the same bits. `protocol_test.py SIM`"""

import json
import os
import re
import signal
import socket
import subprocess
import sys
import tempfile
import threading
import time

from live_client import Refused, Server, Socket, replay
from skip import need_view

PROGRAM = sys.argv[1]


def refused(make):
    try:
        make()
    except (Refused, ConnectionError):
        return True
    return False


def test_who_is_let_in(server):
    own = "/" + server.token + "/"
    status, page = server.get(own)
    assert status == 200 and b"<!doctype html>" in page and b"@SOCKET@" not in page
    for host in ("localhost:9999", "localhost", "127.0.0.1", "127.0.0.1:1"):  # through a tunnel
        assert server.get(own, host)[0] == 200, host
    for host in ("localhost:", "localhost:1x", "127.0.0.1:80:80", "8080", ":8080", "localhost:-1"):
        assert server.get(own, host)[0] in (0, 403), host
    for path, host in (("/", None), ("/" + "0" * 32 + "/", None), (own + "../etc/passwd", None),
                       (own[:-2], None), (own, "evil.example"), (own, "127.0.0.1.evil.example"),
                       (own, "[::1"), (own, "[::2]"), (own, "[::1].evil.example"),
                       (own, "[::1]x:%d" % server.port), (own, "::1")):
        assert server.get(path, host)[0] in (0, 403, 404), (path, host)
    for bad in (dict(origin="http://evil.example"), dict(origin=None), dict(origin="null"),
                dict(host="evil.example"), dict(path="/" + "0" * 32 + "/socket"),
                dict(path="/socket"), dict(origin="https://127.0.0.1:%d" % server.port)):
        assert refused(lambda bad=bad: Socket(server, **bad)), bad
    Socket(server).close()
    if not has_ipv6():
        print("no ::1 here: not tested")
        return
    there = "[::1]:%d" % server.port
    assert server.get(own, there)[0] == 200  # a name for the same place
    assert server.get(own, there, at="::1")[0] == 200
    assert server.get(own, "localhost:%d" % server.port, at="::1")[0] == 200
    assert server.get(own, "evil.example", at="::1")[0] in (0, 403)
    assert refused(lambda: Socket(server, host=there, origin="http://evil.example", at="::1"))
    assert refused(lambda: Socket(server, host=there, origin="http://[::1]:1", at="::1"))
    page = Socket(server, host=there, at="::1")
    page.until(lambda s: True)
    page.close()


def test_headers(server):
    """Nothing runs in the page but its own script, and nothing of it is kept or told."""
    for path in (server.token + "/", "x"):
        head = server.exchange("GET /%s HTTP/1.1\r\nHost: localhost:%d\r\n\r\n"
                               % (path, server.port)).split(b"\r\n\r\n")[0].decode()
        headers = dict(line.split(": ", 1) for line in head.split("\r\n")[1:])
        assert headers["Cache-Control"] == "no-store"
        assert headers["X-Content-Type-Options"] == "nosniff"
        assert headers["Referrer-Policy"] == "no-referrer"
        assert headers["X-Frame-Options"] == "DENY"
        policy = headers["Content-Security-Policy"].split("; ")
        assert "default-src 'none'" in policy and "frame-ancestors 'none'" in policy
    page = server.exchange("GET /%s/ HTTP/1.1\r\nHost: localhost:%d\r\n\r\n"
                           % (server.token, server.port)).decode()
    nonce = re.search("script-src 'nonce-([0-9a-f]{32})';", page)[1]
    assert nonce != server.token and '<script nonce="%s">' % nonce in page
    assert "connect-src 'self' ws://localhost:%d;" % server.port in page
    assert "unsafe" not in page.split("\r\n\r\n")[0]


def test_nothing_else_of_http(server):
    """One GET without a body, or a WebSocket of the page itself; all else is closed at once."""
    own, host = "/" + server.token + "/", "Host: 127.0.0.1:%d\r\n" % server.port
    get = "GET " + own + " HTTP/1.1\r\n" + host
    answer = server.exchange(get + "Connection: keep-alive\r\n\r\n")
    assert answer.startswith(b"HTTP/1.1 200 ") and b"connection: close" in answer.lower()
    h2c = "Connection: Upgrade, HTTP2-Settings\r\nUpgrade: h2c\r\nHTTP2-Settings: AAMAAABk\r\n\r\n"
    bad = [get + h2c, get + h2c + "PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n",
           "PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n\0\0\0\4\0\0\0\0\0",
           get + "Content-Length: 3\r\n\r\nabc", get + "Content-Length: 0\r\n\r\n",
           get + "Transfer-Encoding: chunked\r\n\r\n0\r\n\r\n", get + "\r\n" + get + "\r\n",
           get + "Expect: 100-continue\r\n\r\n", get + host + "\r\n",
           get.replace("1.1", "1.0", 1) + "\r\n", get.replace("1.1", "2.0", 1) + "\r\n",
           "GET " + own + "\r\n", "GET http://127.0.0.1" + own + " HTTP/1.1\r\n" + host + "\r\n",
           "GET " + own + " HTTP/1.1\r\n\r\n", get + "X: " + "y" * 20000 + "\r\n\r\n", "\0" * 100]
    bad += [method + get[3:] + "\r\n" for method in ("HEAD", "POST", "PUT", "OPTIONS", "get", "CONNECT")]
    bad += ["GET " + own + path + " HTTP/1.1\r\n" + host + "\r\n"
            for path in ("x", "?x", "#", "%20", "socket", "socket/", "../" + server.token + "/")]
    for request in bad:
        answer = server.exchange(request)
        assert b"<!doctype" not in answer, request
        assert not answer or answer.split()[1] in (b"400", b"403"), (request, answer)
    for path in ("", "x", "socket/", "socket?", "socket/x", "Socket"):
        assert refused(lambda path=path: Socket(server, own + path)), path
    for header in ("Sec-WebSocket-Version: 8", "Sec-WebSocket-Version: 13\r\nContent-Length: 1",
                   "Sec-WebSocket-Version: 13\r\nHost: evil.example",
                   "Sec-WebSocket-Version: 13\r\nOrigin: http://evil.example"):
        answer = server.exchange(
            "GET " + own + "socket HTTP/1.1\r\n" + host + "Connection: Upgrade\r\nUpgrade: websocket"
            "\r\nSec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\nOrigin: http://" + host[6:] + header
            + "\r\n\r\n")
        assert b" 101 " not in answer, header
    # The library that once was the server never came back from this.
    for _ in range(3):
        server.exchange("GET / HTTP/1.1\r\nHost: " + "a" * 500 + "\r\n\r\nPOST / HTTP/1.1\r\nHost: a"
                        "\r\nContent-Length: 10\r\n\r\n0123456789")
    unmasked = Socket(server)
    unmasked.send_raw(0x81, b"pause", masked=0)
    assert refused(lambda: [unmasked.receive() for _ in range(2000)])
    # Connections that say nothing keep nobody out.
    idle = [socket.create_connection(("127.0.0.1", server.port)) for _ in range(200)]
    assert server.get(own)[0] == 200
    page = Socket(server)
    page.until(lambda s: s["playing"])
    page.close()
    for each in idle:
        each.close()


def has_ipv6():
    try:
        with socket.socket(socket.AF_INET6) as one:
            one.bind(("::1", 0))
        return True
    except OSError:
        return False


def test_garbage(server):
    page = Socket(server)
    page.say("pause")
    before = page.until(lambda s: not s["playing"])["systems"][0]
    for text in ("", "x", "grab", "grab -1", "grab 64", "grab 1e9", "grab nan", "pull 3 0 0 0",
                 "move 3 0 0 0 over 5", "switch wind on", "dt 0", "dt -1", "dt inf", "dt nan",
                 "integrator nothing", "integrator rk4:x=1", "integrator rk4:", "goto -1", "goto x",
                 "back 0", "back 1e30", "step 1e9", "step -1", "speed 0", "speed 1e9",
                 "left: grab 3", ": grab 3", "position 3 0 0 nan", "undo",
                 "component 0 1", "set", "set n", "set n 3", "release 99999999999", "\x00\x01",
                 "gr\u00e4b 3", "grab 3 " * 400,
                 "'; DROP TABLE", "../../etc/passwd", "<script>alert(1)</script>"):
        error = page.error_of(text)
        assert error and len(error) < 600, (text, error)
    after = page.until(lambda s: True)["systems"][0]
    assert before["hash"] == after["hash"], "garbage touched the state"
    # Whoever sends too much, or no text, is shown out; the others stay.
    for first, payload in ((0x81, b"x" * 5000), (0x81, b"x" * 1000000), (0x82, b"grab 3"),
                           (0x81, b"\xff\xfe\xfd"), (0x8F, b"grab 3"), (0xF1, b"grab 3")):
        other = Socket(server)

        def shown_out(other=other, first=first, payload=payload):
            other.send_raw(first, payload)
            for _ in range(2000):
                other.receive()

        assert refused(shown_out), (first, len(payload))
        other.close()
    others = [Socket(server) for _ in range(15)]
    try:
        Socket(server).receive()
        raise AssertionError("17 pages")
    except Refused as why:
        assert "16 pages are open" in str(why), why
    for each in others:
        each.close()
    page.say("play")
    page.until(lambda s: s["systems"][0]["step"] > after["step"])
    page.close()


def test_each_word(server):
    page = Socket(server)
    say, until = page.say, page.until

    def system():
        return page.state["systems"][0]

    say("pause"), say("reset")
    start = until(lambda s: s["systems"][0]["step"] == 0)["systems"][0]["hash"]
    say("step 5")
    five = until(lambda s: s["systems"][0]["step"] == 5)["systems"][0]["hash"]
    say("step 1"), until(lambda s: s["systems"][0]["step"] == 6)
    say("back 1")
    assert until(lambda s: s["systems"][0]["step"] == 5)["systems"][0]["hash"] == five
    say("goto 0")
    assert until(lambda s: s["systems"][0]["step"] == 0)["systems"][0]["hash"] == start
    say("pin 27"), until(lambda s: 27 in s["systems"][0]["pinned"])
    say("unpin 27"), until(lambda s: 27 not in s["systems"][0]["pinned"])
    say("dt 0.002"), until(lambda s: s["systems"][0]["h"] == 0.002)
    say("integrator verlet"), until(lambda s: s["systems"][0]["method"] == "verlet")
    assert 0 < system()["share"] < 1
    say("dt 0.02"), until(lambda s: s["systems"][0]["share"] > 1)
    until(lambda s: re.match("suspect.*largest stable", s["systems"][0]["verdict"]))
    say("undo"), until(lambda s: s["systems"][0]["h"] != 0.02)
    say("reset"), until(lambda s: s["systems"][0]["step"] == 0)
    say("speed 2"), until(lambda s: s["speed"] == 2)
    say("grab 63"), until(lambda s: s["systems"][0]["held"] == [63])
    say("play")
    for k in range(40):
        say("pull 63 0.3 %.3f 0.5" % (0.01 * k))
        time.sleep(0.01)
    until(lambda s: s["systems"][0]["step"] > 40)
    gone = Socket(server)  # who goes lets go
    gone.say("grab 60"), until(lambda s: 60 in s["systems"][0]["held"])
    gone.close()
    until(lambda s: s["systems"][0]["held"] == [63])
    say("release 63"), until(lambda s: s["systems"][0]["held"] == [])
    say("back 20"), until(lambda s: not s["playing"])
    now = system()["step"]
    say("position 12 0.1 0.2 0.3"), say("velocity 20 1 0 0"), say("play")
    until(lambda s: s["systems"][0]["step"] > now + 5)
    page.close()


def test_cost(server):
    page = Socket(server)
    page.until(lambda s: True)
    assert page.bytes_of_points <= 16 + 6 * 4096, page.bytes_of_points
    # Somebody who does not read, and one who does not say that it has drawn: nothing piles up.
    stalled = Socket(server)
    stalled.say("hello")
    memory = []
    for _ in range(3):
        for _ in range(20):
            page.receive()
        with open("/proc/%d/statm" % server.process.pid, encoding="ascii") as file:
            memory.append(int(file.read().split()[1]))
    assert memory[-1] - memory[0] < 2000, memory  # pages of 4 KiB
    stalled.close()
    page.close()


def test_flood(server):
    """One who sends commands without end leaves pictures, commands and signals to the others."""
    page, flood = Socket(server), Socket(server)
    words = ["dt 0.002", "integrator verlet", "goto 0.1", "reset", "dt 0.001", "integrator rk4"]

    def send():
        try:
            for _ in range(100000):
                for word in words:
                    flood.say(word)
        except OSError:
            pass

    sender = threading.Thread(target=send)
    sender.start()
    try:
        time.sleep(1)
        # Commands of the other are not behind the thousands that were sent before them, and pictures
        # do not wait for them: between two of these few are done, however long they take.
        for speed in (2, 3, 4, 5):
            page.say("speed %d" % speed)
            for pictures in range(1000):
                if page.receive().get("speed") == speed:
                    break
            assert pictures < 60, pictures
        begin, seen = time.time(), 0
        while time.time() < begin + 3:
            seen += "systems" in page.receive()
        print("  %d pictures in 3 s of a flood" % seen)
        assert seen >= 6, seen
        flood.socket.shutdown(socket.SHUT_RDWR)
    finally:
        sender.join()
        flood.close()
    while not page.receive().get("playing"):  # some of the flood is still to come
        page.say("play")
    page.close()


def test_verdict(server):
    """Positions are compared with those of half the step once a hundred steps are done."""
    page = Socket(server)

    def verdict(s):
        return s["systems"][0]["verdict"]

    page.say("pause"), page.say("reset"), page.say("step 90")
    unknown = page.until(lambda s: s["systems"][0]["step"] == 90)
    assert "positions to" not in verdict(unknown), verdict(unknown)
    page.say("play")
    page.until(lambda s: re.match(r"trusted: positions to .* \(verified\)", verdict(s)))
    page.say("pause"), page.say("reset"), page.say("integrator verlet"), page.say("dt 0.05"), page.say("play")
    page.until(lambda s: re.match("suspect: positions differ by up to .* half the step", verdict(s)))
    page.close()


def test_world(server):
    """The strip shows the energies of the first system that has any, here the last of all."""
    page = Socket(server)
    page.say("pause"), page.say("reset"), page.say("step 20")
    page.until(lambda s: s["systems"][1]["step"] > 0)
    newcomer = Socket(server)
    newcomer.say("hello")
    past = next(m for m in (newcomer.receive() for _ in range(100)) if "kinetic" in m)
    assert max(past["kinetic"]) > 0 > min(past["potential"]), past
    newcomer.close()
    page.close()


def chosen_by_program(*words):
    """Method, tolerance and step that the program chooses."""
    done = subprocess.run([PROGRAM, *words, "--json", "-q"], capture_output=True, text=True,
                          check=True)
    goals = [each["error_goal"] for each in json.loads(done.stdout)["systems"]]
    return [(goal["integrator"], goal["tol"], goal["dt"]) for goal in goals]


def test_error(server):
    """An error instead of a step: what the program chooses for it, found beside the steps."""
    page = Socket(server)
    assert "3 cows" in page.error_of("error 3 cows")
    (method, tolerance, h), = chosen_by_program("scenes/cloth.lua", "--error", "1%")
    page.say("error 1e-9"), page.until(lambda s: s["goal"]["busy"])
    page.say("error 1%")
    busy = page.until(lambda s: s["goal"]["asked"] == "1%")
    assert busy["goal"]["busy"], busy["goal"]
    found = page.until(lambda s: not s["goal"]["busy"])
    now = found["systems"][0]
    assert (now["method"].split(":")[0], now["h"]) == (method, h), (now["method"], now["h"], method, h)
    assert tolerance == 0 or "tol=" in now["method"], now["method"]
    for word in ("chosen", "measured", "cost"):
        assert word in found["goal"]["words"], found["goal"]
    assert found["goal"]["asked"] == "1%" and found["playing"]
    # Another step is another choice; a search ends where nobody wants it any more.
    page.say("dt 0.002")
    page.until(lambda s: s["systems"][0]["h"] == 0.002 and s["goal"]["asked"] == s["goal"]["words"] == "")
    page.say("error 1e-9"), page.until(lambda s: s["goal"]["busy"])
    page.say("error off")
    page.until(lambda s: not s["goal"]["busy"])
    assert page.state["systems"][0]["h"] == 0.002
    page.close()


def test_error_of_world(server):
    page = Socket(server)
    chosen = chosen_by_program(server.arguments[0], "--error", "1%")
    page.say("error 1%")
    page.until(lambda s: s["goal"]["words"].count("chosen") == 2)
    now = [(each["method"].split(":")[0], each["h"]) for each in page.state["systems"]]
    assert now == [(method, h) for method, _, h in chosen], (now, chosen)
    page.close()


def test_diverges(server):
    page = Socket(server)
    page.say("dt 0.2"), page.say("play")
    failed = page.until(lambda s: s["failure"])
    assert failed["failure"].startswith("diverged") and "try dt" in failed["failure"]
    # It has diverged for whoever looks at it later, at whatever state before.
    Socket(server).close()
    page.say("colour error"), page.say("back 1"), page.say("speed 3")
    later = page.until(lambda s: s["speed"] == 3)
    for each in (failed, later):
        assert each["systems"][0]["verdict"] == failed["failure"] == each["failure"], each
    page.say("reset"), page.say("dt 0.005"), page.say("play")
    page.until(lambda s: not s["failure"] and s["systems"][0]["step"] > 10)
    page.close()


def test_moves():
    """A verdict knows the state that it is shown with, however dear a look at it is."""
    with Server(PROGRAM, "scenes/cloth.lua", record=False) as server:
        page = Socket(server)
        page.until(lambda s: s["page"] == 0)
        page.say("set n 80"), page.until(lambda s: s["page"] == 1)
        verdict = page.until(lambda s: s["systems"][0]["kinetic"] > 0.1)["systems"][0]["verdict"]
        assert "hardly anything moves" not in verdict, verdict
        page.close()
        server.stop()
    print("test_moves ok")


def test_browser_launch():
    """The browser gets a private file that leads on; nobody reads the token in its arguments."""
    with tempfile.TemporaryDirectory() as folder:
        launcher, seen = os.path.join(folder, "xdg-open"), os.path.join(folder, "seen")
        with open(launcher, "w", encoding="ascii") as file:
            file.write(f"#!/bin/sh\n{{ echo $#; echo \"$1\"; stat -c '%a %u' \"$1\"; cat \"$1\"; }} "
                       f">{seen}.part\nmv {seen}.part {seen}\n")
        os.chmod(launcher, 0o755)
        runtime, open_to_all = os.path.join(folder, "run"), os.path.join(folder, "all")
        os.mkdir(runtime, 0o700), os.mkdir(open_to_all), os.chmod(open_to_all, 0o755)
        for home in (runtime, open_to_all, os.path.join(folder, "none"), ""):
            environment = dict(os.environ, DISPLAY=":9", XDG_RUNTIME_DIR=home, TMPDIR=folder,
                               PATH=folder + ":" + os.environ["PATH"])
            process = subprocess.Popen([PROGRAM, "view"], stdout=subprocess.PIPE, env=environment,
                                       stderr=subprocess.DEVNULL, text=True)
            try:
                address = process.stdout.readline().strip()
                end = time.time() + 30
                while not os.path.exists(seen) and time.time() < end:
                    time.sleep(0.05)
                with open(seen, encoding="utf-8") as file:
                    count, argument, owner, text = file.read().split("\n", 3)
                os.remove(seen)
                token = address.split("/")[3]
                assert count == "1" and token not in argument and token in text, argument
                assert owner == "600 %d" % os.getuid() and f'content="0;url={address}"' in text
                assert os.path.dirname(argument) == runtime or home != runtime
                assert os.path.dirname(argument) != open_to_all
                assert os.stat(os.path.dirname(argument)).st_mode & 0o77 == 0
            finally:
                process.send_signal(signal.SIGINT)
                process.communicate(timeout=30)
            assert not os.path.exists(argument)
        left = sorted(os.listdir(folder))
        assert left == ["all", "run", "xdg-open"] and not os.listdir(runtime), left
    print("test_browser_launch ok")


def run(test, *arguments):
    with Server(PROGRAM, *arguments) as server:
        test(server)
        code = server.stop()
        assert code == 130, code
        assert not server.process.stderr.read().count("error")
        code, words = replay(PROGRAM, server.record)
        assert code == 0 and "the same bits" in words, words
    print(test.__name__, "ok")


if __name__ == "__main__":
    need_view(PROGRAM, "web", "Boost", "libboost-dev")
    run(test_who_is_let_in)
    test_browser_launch()
    run(test_headers)
    run(test_nothing_else_of_http)
    run(test_garbage)
    run(test_each_word)
    test_moves()
    run(test_cost, "scenes/cloth.lua", "-s", "n=64")
    run(test_flood)
    run(test_error)
    run(test_diverges)
    run(test_verdict, "scenes/pendulum.lua")
    with tempfile.TemporaryDirectory() as folder:
        scene = os.path.join(folder, "world.lua")
        with open(scene, "w", encoding="ascii") as file:
            file.write("local sim = require 'sim'\nreturn sim.world { a = require 'scenes.circle', "
                       "b = require 'scenes.pendulum' }\n")
        run(test_world, scene)
        run(test_error_of_world, scene)
