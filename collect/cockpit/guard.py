"""Access: any page of the cockpit's own; from elsewhere, and where it is asked for, with the token.

Every request is checked for the `Host` it asks for, every socket and form for the `Origin` of the page that
makes it, so that no other page in the same browser, nor a name that was made to point here, gets in.
"""

import hashlib
import hmac
import ipaddress
import secrets
import time
from collections import deque
from collections.abc import Callable, Mapping

_LASTS = 12 * 3600.0  # a session [s]
_FAILURES, _WITHIN = 5, 60.0  # wrong tokens from one address, in a time [s]
_MOST_FAILURES = 1000  # that are remembered, of all addresses


class Guard:
    """Checks requests.

    A session is a signed note of who may come in until when, so that it outlives a server that has to be
    started again; with the secret of another recording it is worth nothing.

    Args:
        private: whether nobody needs the token, because only this computer, as itself, can come in.
        scheme: `http` or `https`.
        secret: of this recording.
        clock: [s].

    Attributes:
        token: that a person must know.
        refused: requests turned away.
    """

    def __init__(
        self, private: bool, scheme: str, secret: str, clock: Callable[[], float] = time.monotonic
    ) -> None:
        self._private, self._scheme, self._secret, self._clock = private, scheme, secret.encode(), clock
        self.token, self.refused = self._signed("token"), 0
        self._failures = deque[tuple[str, float]](maxlen=_MOST_FAILURES)  # addresses, and when [s]

    def admits(self, headers: Mapping[str, str], cookies: Mapping[str, str], address: str) -> bool:
        """Whether a request may see more than the door."""
        known = self._private or self._is_known(cookies.get(cookie_name(headers), ""), address)
        fine = self.is_ours(headers) and known
        self.refused += not fine
        return fine

    def is_ours(self, headers: Mapping[str, str], origin: bool = False) -> bool:
        """Whether a request asks for this server by its address, and comes from a page of its own.

        Args:
            headers: of the request.
            origin: whether it must say which page it comes from.
        """
        host, said = headers.get("host", ""), headers.get("origin")
        return _is_address(host) and (said == f"{self._scheme}://{host}" or (said is None and not origin))

    def log_in(self, token: str, address: str) -> str:
        """Return a new session for the token; empty for a wrong one.

        The right one is always welcome: whoever guesses cannot keep its owner out.
        """
        if not hmac.compare_digest(token.encode(), self.token.encode()):
            self._failures.append((address, self._clock()))
            self.refused += 1
            return ""
        note = f"{self._clock() + _LASTS:.0f}.{secrets.token_urlsafe(12)}"
        return f"{note}.{self._signed(note, address)}"

    def guesses(self, address: str) -> bool:
        """Whether an address has said so many wrong tokens of late that its next answer may take a while."""
        since = self._clock() - _WITHIN
        return sum(each == address and at > since for each, at in self._failures) >= _FAILURES

    def _is_known(self, session: str, address: str) -> bool:
        note, _, signature = session.rpartition(".")
        is_signed = hmac.compare_digest(signature.encode(), self._signed(note, address).encode())
        return is_signed and self._clock() < float(note.partition(".")[0])

    def _signed(self, *words: str) -> str:
        return hmac.new(self._secret, "\n".join(words).encode(), hashlib.sha256).hexdigest()[:43]


def cookie_name(headers: Mapping[str, str]) -> str:
    """Return the name of a session's cookie: a computer has one name for the servers of all its ports."""
    return f"handrail_session_{headers.get('host', '').rpartition(':')[2].rstrip(']')}"


def _is_address(host: str) -> bool:
    """Whether a Host header names an address, or this computer as itself; other names can be anyone's."""
    name = host.rsplit(":", 1)[0] if not host.endswith("]") else host
    try:
        return name == "localhost" or bool(ipaddress.ip_address(name.strip("[]")))
    except ValueError:
        return False
