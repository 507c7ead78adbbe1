"""Where the cockpit listens, as typed settings; light to import."""

import ipaddress
import ssl
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from msgspec import Meta

from handrail.controllers.errors import HandrailError, message_of
from handrail.controllers.typed import check_settings


@dataclass(frozen=True)
class CockpitConfig:
    """Where browsers find the cockpit."""

    host: str = "127.0.0.1"
    """Address to listen at; any other than 127.0.0.1 asks for a token, by HTTPS."""
    token: bool = False
    """Ask for the token on 127.0.0.1 too: without, every account of this computer can drive."""
    port: Annotated[int, Meta(ge=0, le=65535)] = 8765
    """Port to listen at; the next free one where it is taken; 0 for any."""
    open: bool = True
    """Open the page in this computer's browser, unless it asks for a token."""
    certificate: str = ""
    """Folder of a certificate of your own, cert.pem and key.pem; without, one is made on this machine."""

    @property
    def is_private(self) -> bool:
        """Whether only this computer, as itself, can come in."""
        return self.host in ("127.0.0.1", "::1", "localhost")

    @property
    def asks(self) -> bool:
        """Whether the page asks for a token."""
        return self.token or not self.is_private

    def check(self) -> None:
        """Check the settings."""
        if self.host != "localhost":
            try:
                ipaddress.ip_address(self.host)
            except ValueError:
                raise HandrailError(
                    f"--cockpit.host {self.host}: expected an address of this computer, "
                    "such as 192.168.1.20, or 0.0.0.0 for all"
                ) from None
        check_settings(self, "--cockpit.")
        folder = Path(self.certificate).expanduser()
        if self.certificate and (said := not_serving(folder / "cert.pem", folder / "key.pem")):
            raise HandrailError(f"--cockpit.certificate {self.certificate}: {said}")


def not_serving(cert: Path, key: Path) -> str:
    """Return why a certificate and its key cannot serve; "" if they can."""
    try:
        ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER).load_cert_chain(cert, key, password="")
    except (OSError, ssl.SSLError) as error:
        return f"expected in it cert.pem and its key.pem without a password; {message_of(error)}"
    return ""
