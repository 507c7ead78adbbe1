"""The pipe between the recording and the web server: whole messages, never a wait.

The recording must not wait for a page, nor the server for the robot. What comes many times a second (frames,
pictures, inputs) is dropped where there is no room; what is said once (a scene, a mode) waits until there is.
What takes motion away is never dropped, and goes first.
"""

import socket
from collections import Counter, deque
from collections.abc import Collection

from handrail.controllers.errors import HandrailError

LARGEST = 2**23  # message [bytes]
_PACKET = 2**16  # [bytes]
_BUFFER = 2**20  # asked for; the system may give less [bytes]
_MOST_WAITING = 64  # messages
_MORE, _LAST = b"+", b"."

# from the recording, and from the server
FRAME, PICTURE, STAGE, CARD, OVER = b"F", b"P", b"S", b"Q", b"O"
NOTE, DRIVE, ASK, STILL, STOP, LOST, DROPPED, ANSWER = b"N", b"D", b"A", b"a", b"!", b"L", b"-", b"R"
_STILL = (STOP, LOST, STILL, DRIVE)  # what takes motion away: inputs only wait where all is let go


class Pipe:
    """One end of a connected socket pair that keeps packets apart."""

    def __init__(self, end: socket.socket) -> None:
        end.setblocking(False)
        for option in (socket.SO_SNDBUF, socket.SO_RCVBUF):
            end.setsockopt(socket.SOL_SOCKET, option, _BUFFER)
        self._socket = end
        self.dropped = Counter[bytes]()
        """Messages for which there was no room, by kind."""
        self._begun = deque[bytes]()  # packets of a message whose first one is gone
        self._waiting = deque[tuple[bytes, bytes]]()
        self._parts: list[bytes] = []  # of a message that comes in

    @staticmethod
    def pair() -> tuple[socket.socket, socket.socket]:
        """Return two connected ends."""
        return socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)

    def fileno(self) -> int:
        """Return the file descriptor, for a loop that waits."""
        return self._socket.fileno()

    def send(self, kind: bytes, data: bytes) -> bool:
        """Send a message if there is room for it now; return whether there was."""
        went = self.flush() and len(data) <= LARGEST and self._begin(kind, data)
        self.dropped[kind] += not went
        if went:
            self.flush()
        return went

    def send_surely(self, kind: bytes, data: bytes, instead_of: Collection[bytes] = ()) -> None:
        """Send a message, later if there is no room now.

        Of too many that wait the last ones are dropped, but none that takes motion away: it waits once.

        Args:
            kind: of the message.
            data: content of the message.
            instead_of: kinds that are out of date with it: those that wait are dropped.
        """
        for each in [each for each in self._waiting if each[0] in instead_of or each == (kind, data)]:
            self._waiting.remove(each)
        is_full = len(self._waiting) >= _MOST_WAITING and kind not in _STILL
        if is_full or len(data) > LARGEST:
            self.dropped[kind] += 1
            return
        (self._waiting.appendleft if kind == STOP else self._waiting.append)((kind, data))
        self.flush()

    def flush(self) -> bool:
        """Send what waits, as far as there is room; return whether nothing waits any more."""
        while self._begun or self._waiting:
            if self._begun:
                if not self._push(self._begun[0]):
                    return False
                self._begun.popleft()
            elif self._begin(*self._waiting[0]):
                self._waiting.popleft()
            else:
                return False
        return True

    def receive(self) -> list[tuple[bytes, bytes]]:
        """Return all messages that have come, the oldest first."""
        messages: list[tuple[bytes, bytes]] = []
        try:
            while packet := self._socket.recv(2 * _PACKET):
                self._parts.append(packet[2:])
                if packet[1:2] == _LAST:
                    messages.append((packet[:1], b"".join(self._parts)))
                    self._parts.clear()
        except BlockingIOError:
            return messages
        except OSError as error:
            raise _gone() from error
        if messages:
            return messages
        raise _gone()

    def close(self) -> None:
        """Close it."""
        self._socket.close()

    def _begin(self, kind: bytes, data: bytes) -> bool:
        """Send a message's first packet; the others follow as there is room."""
        starts = range(0, max(len(data), 1), _PACKET)
        ends = [_MORE] * (len(starts) - 1) + [_LAST]
        if not self._push(kind + ends[0] + data[:_PACKET]):
            return False
        rest = zip(starts[1:], ends[1:], strict=True)
        self._begun.extend(kind + end + data[start : start + _PACKET] for start, end in rest)
        return True

    def _push(self, packet: bytes) -> bool:
        try:
            self._socket.send(packet)
        except BlockingIOError:
            return False
        except OSError as error:
            raise _gone() from error
        return True


def _gone() -> HandrailError:
    return HandrailError("cockpit: the other end of the pipe is gone")
