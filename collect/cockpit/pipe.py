"""The pipe between the recording and the web server: whole messages, never a wait.

The recording must not wait for a page, nor the server for the robot. Messages that come many times a second
(frames, pictures, inputs) are dropped where there is no room; those said once (a scene, a mode) wait until
there is. A message that takes motion away is never dropped, and goes first.
"""

import socket
from collections import Counter, deque
from collections.abc import Collection
from enum import StrEnum
from typing import Any

import msgspec

from handrail.controllers.errors import HandrailError

LARGEST = 2**23  # message [bytes]
_PACKET = 2**16  # [bytes]
_BUFFER = 2**20  # asked for; the system may give less [bytes]
_MOST_WAITING = 64  # messages
_MORE, _LAST = b"+", b"."


class Kind(StrEnum):
    """The kind of a message: of the recording, as pages are told it, and of the server."""

    FRAME, PICTURE, STAGE, CARD, OVER = "frame", "picture", "stage", "card", "over"
    NOTE, DRIVE, ASK, STILL, STOP = "note", "drive", "ask", "still", "stop"
    LOST, DROPPED, ANSWER = "lost", "dropped", "answer"


Message = tuple[Kind, Any]
"""A kind, and a value of JSON or bytes."""
_STILL = (Kind.STOP, Kind.LOST, Kind.STILL, Kind.DRIVE)  # inputs only wait where all is let go
_DECODER = msgspec.msgpack.Decoder(Message)


class Pipe:
    """One end of a connected socket pair that keeps packets apart.

    To send to an end that is gone does nothing: `receive` finds out.
    """

    def __init__(self, end: socket.socket) -> None:
        end.setblocking(False)
        for option in (socket.SO_SNDBUF, socket.SO_RCVBUF):
            end.setsockopt(socket.SOL_SOCKET, option, _BUFFER)
        self._socket = end
        self.dropped = Counter[Kind]()
        """Messages for which there was no room, by kind."""
        self._begun = deque[bytes]()  # packets of a message whose first one is gone
        self._waiting = deque[tuple[Kind, bytes]]()
        self._parts: list[bytes] = []  # of a message that comes in

    def fileno(self) -> int:
        """Return the file descriptor, for a loop that waits."""
        return self._socket.fileno()

    def send(self, kind: Kind, value: Any = None) -> bool:
        """Send a message if there is room for it now; return whether there was."""
        data = _encoded(kind, value)
        went = self.flush() and len(data) <= LARGEST and self._begin(data)
        self.dropped[kind] += not went
        self.flush()
        return went

    def send_surely(self, kind: Kind, value: Any = None, instead_of: Collection[Kind] = ()) -> None:
        """Send a message, later if there is no room now.

        Of too many that wait the last ones are dropped, but none that takes motion away: it waits once.

        Args:
            kind: of the message.
            value: content of the message.
            instead_of: kinds that are out of date with it: those that wait are dropped, as is the same one.
        """
        message = kind, _encoded(kind, value)
        for each in [each for each in self._waiting if each[0] in instead_of or each == message]:
            self._waiting.remove(each)
        is_full = len(self._waiting) >= _MOST_WAITING and kind not in _STILL
        if is_full or len(message[1]) > LARGEST:
            self.dropped[kind] += 1
            return
        (self._waiting.appendleft if kind is Kind.STOP else self._waiting.append)(message)
        self.flush()

    def flush(self) -> bool:
        """Send what waits, as far as there is room; return whether nothing waits any more."""
        while self._begun or self._waiting:
            if self._begun:
                if not self._push(self._begun[0]):
                    return False
                self._begun.popleft()
            elif self._begin(self._waiting[0][1]):
                self._waiting.popleft()
            else:
                return False
        return True

    def receive(self) -> list[Message]:
        """Return all messages that have come, the oldest first; of an end that is gone the last ones, too."""
        messages, errors = list[Message](), 0
        while errors < 2:
            try:
                packet = self._socket.recv(2 * _PACKET)
            except BlockingIOError:
                return messages
            except OSError:
                errors += 1  # the first: it went with something unread; what it has sent is still here
                continue
            if not packet:
                break
            self._parts.append(packet[1:])
            if packet[:1] == _LAST:
                messages.append(_DECODER.decode(b"".join(self._parts)))
                self._parts.clear()
        if not messages:
            raise HandrailError("cockpit: the other end of the pipe is gone")
        return messages

    def close(self) -> None:
        """Close it."""
        self._socket.close()

    def _begin(self, data: bytes) -> bool:
        """Send a message's first packet; the others follow as there is room."""
        chunks = [data[start : start + _PACKET] for start in range(0, len(data), _PACKET)]
        first, *rest = [_MORE + chunk for chunk in chunks[:-1]] + [_LAST + chunks[-1]]
        if not self._push(first):
            return False
        self._begun.extend(rest)
        return True

    def _push(self, packet: bytes) -> bool:
        try:
            self._socket.send(packet)
        except BlockingIOError:
            return False
        except OSError:
            pass  # the other end is gone
        return True


def _encoded(kind: Kind, value: Any) -> bytes:
    return msgspec.msgpack.encode((kind, value), enc_hook=float)
