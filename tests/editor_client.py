# SPDX-License-Identifier: BSD-3-Clause
"""A client of the Language Server Protocol, for tests: messages over the pipes of `kempe language-server`."""
import json
import pathlib
import re
import subprocess


class Refused(Exception):
    """An error of JSON-RPC."""

    def __init__(self, error):
        super().__init__(error["message"])
        self.code = error["code"]


class Client:
    def __init__(self, kempe, encodings=("utf-16",), begin=True):
        self.process = subprocess.Popen([str(kempe), "language-server", "--stdio"], stdin=subprocess.PIPE, stdout=subprocess.PIPE)
        self.number, self.diagnostics, self.versions = 0, {}, {}
        if begin:
            capabilities = {"general": {"positionEncodings": list(encodings)}}
            self.capabilities = self.ask("initialize", processId=None, rootUri=None, capabilities=capabilities)["capabilities"]
            self.tell("initialized")

    def send(self, message):
        body = json.dumps({"jsonrpc": "2.0", **message}).encode()
        self.send_bytes(b"Content-Length: %d\r\n\r\n" % len(body) + body)

    def send_bytes(self, data):
        self.process.stdin.write(data)
        self.process.stdin.flush()

    def receive(self):
        length = None
        while line := self.process.stdout.readline().strip():
            length = int(line.split(b":")[1])
        if length is None:
            raise EOFError("the server has ended")
        message = json.loads(self.process.stdout.read(length))
        if message.get("method") == "textDocument/publishDiagnostics":
            self.diagnostics[message["params"]["uri"]] = message["params"]["diagnostics"]
        return message

    def tell(self, method, **params):
        self.send({"method": method, "params": params})

    def ask(self, method, **params):
        self.number += 1
        self.send({"id": self.number, "method": method, "params": params})
        while (message := self.receive()).get("id") != self.number:
            pass
        if "error" in message:
            raise Refused(message["error"])
        return message["result"]

    # -- documents

    def open(self, path, text=None):
        """Opens a file and returns its diagnostics."""
        uri = uri_of(path)
        text = pathlib.Path(path).read_text() if text is None else text
        self.versions[uri] = 1
        self.tell("textDocument/didOpen", textDocument={"uri": uri, "languageId": "yaml", "version": 1, "text": text})
        return self.wait(uri)

    def change(self, path, text):
        uri = uri_of(path)
        self.versions[uri] += 1
        self.tell("textDocument/didChange", textDocument={"uri": uri, "version": self.versions[uri]}, contentChanges=[{"text": text}])
        return self.wait(uri)

    def close(self, path):
        self.tell("textDocument/didClose", textDocument={"uri": uri_of(path)})
        return self.wait(uri_of(path))

    def wait(self, uri):
        self.diagnostics.pop(uri, None)
        while uri not in self.diagnostics:
            self.receive()
        return self.diagnostics[uri]

    def at(self, method, path, position, **more):
        line, character = position
        return self.ask(f"textDocument/{method}", textDocument={"uri": uri_of(path)}, position={"line": line, "character": character}, **more)

    def of(self, method, path, **more):
        return self.ask(f"textDocument/{method}", textDocument={"uri": uri_of(path)}, **more)

    def labels(self, path, position):
        return [item["label"] for item in self.at("completion", path, position)]

    def end(self):
        """Shuts the server down; its exit code."""
        self.ask("shutdown")
        self.tell("exit")
        self.process.stdin.close()
        self.process.stdout.close()
        return self.process.wait(60)

    def stop(self):
        """Ends the process after a test that has failed."""
        self.process.kill()
        with self.process:
            pass


def uri_of(path):
    return path if re.match(r"\w+:", str(path)) else pathlib.Path(path).resolve().as_uri()


def position_of(text, offset):
    """Line and character of UTF-16."""
    before = text[:offset]
    line = before.count("\n")
    return line, len(before[before.rfind("\n") + 1:].encode("utf-16-le")) // 2


def offset_of(text, position):
    lines = text.split("\n")
    line = lines[position["line"]] if position["line"] < len(lines) else ""
    units = line.encode("utf-16-le")[:2 * position["character"]].decode("utf-16-le")
    return sum(len(each) + 1 for each in lines[:position["line"]]) + len(units)


def edited(text, edits):
    """The text after edits, which do not overlap."""
    for edit in sorted(edits, key=lambda e: offset_of(text, e["range"]["start"]), reverse=True):
        begin, end = (min(offset_of(text, edit["range"][side]), len(text)) for side in ("start", "end"))
        text = text[:begin] + edit["newText"] + text[end:]
    return text
