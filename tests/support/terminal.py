"""Types keys at a program in a pseudo-terminal and reports its screen.

Standard input: JSON { command, environment, columns, seconds, steps }, a step { keys, ends, breaks,
signal }: a signal is sent and keys are typed; then the line with the cursor must become `ends`,
after a line break if `breaks`.
Standard output: JSON { status, echo, steps }: the exit status, whether the terminal echoes then, and
for each step the lines that it put on the screen; a step without its end within `seconds` is the
last and has `late`.
"""
import codecs
import fcntl
import json
import os
import pty
import re
import select
import signal
import struct
import sys
import termios
import time

ESCAPE = re.compile(r"\x1b\[([0-9;?]*)([A-Za-z])")


class Screen:
    """The parts of a terminal that a line editor on TERM=dumb or vt100 needs; keeps all lines."""

    def __init__(self):
        self.lines, self.row, self.column, self.breaks = [""], 0, 0, 0
        self.pending = ""

    def put(self, letter):
        line = self.lines[self.row].ljust(self.column)
        self.lines[self.row] = line[: self.column] + letter + line[self.column + 1 :]
        self.column += 1

    def control(self, number, what):
        count = int(number) if number.isdigit() else 1
        line = self.lines[self.row]
        if what == "K":
            self.lines[self.row] = line[: self.column]
        elif what == "C":
            self.column += count
        elif what == "D":
            self.column = max(0, self.column - count)
        elif what == "A":
            self.row = max(0, self.row - count)
        elif what == "J":
            self.lines[self.row] = line[: self.column]
            del self.lines[self.row + 1 :]

    def feed(self, text):
        text, self.pending = self.pending + text, ""
        i = 0
        while i < len(text):
            letter = text[i]
            if letter == "\x1b":
                found = ESCAPE.match(text, i)
                if not found and len(text) - i < 12:
                    self.pending = text[i:]
                    return
                if found:
                    self.control(found.group(1), found.group(2))
                    i = found.end()
                    continue
            elif letter == "\r":
                self.column = 0
            elif letter == "\b":
                self.column = max(0, self.column - 1)
            elif letter == "\n":
                self.row += 1
                self.breaks += 1
                if self.row == len(self.lines):
                    self.lines.append("")
            elif letter not in "\x00\x07":
                self.put(letter)
            i += 1


def main():
    task = json.load(sys.stdin)
    child, terminal = pty.fork()
    if child == 0:
        os.environ.update(task["environment"])
        os.execv(task["command"][0], task["command"])
    fcntl.ioctl(terminal, termios.TIOCSWINSZ, struct.pack("HHHH", 50, task["columns"], 0, 0))
    screen, decoder, results = Screen(), codecs.getincrementaldecoder("utf-8")("replace"), []
    ended = False
    for step in task["steps"]:
        first, breaks = screen.row, screen.breaks
        if step["signal"]:
            os.kill(child, step["signal"])
        if step["keys"]:
            os.write(terminal, step["keys"].encode())
        deadline = time.monotonic() + task["seconds"]

        def done():
            if step["ends"] is None:
                return ended
            broken = screen.breaks > breaks or not step["breaks"]
            return broken and screen.lines[screen.row].rstrip() == step["ends"].rstrip()

        while not done() and not ended and time.monotonic() < deadline:
            if select.select([terminal], [], [], 0.05)[0]:
                try:
                    data = os.read(terminal, 65536)
                except OSError:
                    data = b""
                ended = not data
                screen.feed(decoder.decode(data))
        shown = [line.rstrip() for line in screen.lines[first:]]
        results.append({"lines": shown, "late": not done()})
        if not done():
            break
    if not ended:
        os.kill(child, signal.SIGKILL)
    _, status = os.waitpid(child, 0)
    echo = bool(termios.tcgetattr(terminal)[3] & termios.ECHO)
    status = os.waitstatus_to_exitcode(status)
    json.dump({"status": status, "echo": echo, "steps": results}, sys.stdout)


main()
