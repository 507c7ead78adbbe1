"""A certificate for HTTPS, made on this machine at the first start and kept there."""

import datetime
import ipaddress
import os
import socket
from contextlib import suppress
from pathlib import Path

from cryptography import x509
from cryptography.hazmat.primitives import hashes, serialization
from cryptography.hazmat.primitives.asymmetric import ec

from handrail.collect.cockpit_config import not_serving
from handrail.datasets.storage.atomic import explained

LASTS = datetime.timedelta(days=365)
_ELSEWHERE = ("192.0.2.1", 9)  # an address for examples: asked for a way there, the system says its own


def certificate(host: str, folder: Path) -> tuple[Path, Path]:
    """Return the files in a folder of a certificate for an address, and of its key.

    They are made now if there are none, they expire or do not fit each other, this computer has another
    address by now, or others than their owner can read the key.
    """
    cert, key = folder / f"{host}.pem", folder / f"{host}.key.pem"
    names = _names(host)
    is_secret = key.is_file() and not key.stat().st_mode & 0o077
    if not is_secret or not _is_valid(cert, names) or not_serving(cert, key):
        with explained(f"certificate in {folder}"):
            folder.mkdir(parents=True, exist_ok=True, mode=0o700)
            _make(names, cert, key)
    return cert, key


def _names(host: str) -> list[x509.GeneralName]:
    """Return what the certificate is for: the address, or those of this computer where it is any."""
    found = [ipaddress.ip_address(host)]
    if found[0].is_unspecified:
        found = [ipaddress.ip_address("127.0.0.1")]
        # nothing is sent; without a network there is no other address
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as asking, suppress(OSError):
            asking.connect(_ELSEWHERE)
            found.append(ipaddress.ip_address(asking.getsockname()[0]))
    return [x509.DNSName("localhost"), *(x509.IPAddress(each) for each in dict.fromkeys(found))]


def _is_valid(cert: Path, names: list[x509.GeneralName]) -> bool:
    try:
        made = x509.load_pem_x509_certificate(cert.read_bytes())
        of = made.extensions.get_extension_for_class(x509.SubjectAlternativeName).value
    except (OSError, ValueError, x509.ExtensionNotFound):
        return False
    end = made.not_valid_after_utc
    return list(of) == names and end > datetime.datetime.now(datetime.UTC) + datetime.timedelta(days=1)


def _make(names: list[x509.GeneralName], cert: Path, key: Path) -> None:
    private = ec.generate_private_key(ec.SECP256R1())
    name = x509.Name([x509.NameAttribute(x509.NameOID.COMMON_NAME, "Handrail cockpit")])
    now = datetime.datetime.now(datetime.UTC)
    made = x509.CertificateBuilder().subject_name(name).issuer_name(name).public_key(private.public_key())
    made = made.serial_number(x509.random_serial_number())
    made = made.not_valid_before(now - datetime.timedelta(hours=1)).not_valid_after(now + LASTS)
    made = made.add_extension(x509.SubjectAlternativeName(names), critical=False)
    pem = serialization.Encoding.PEM
    secret = private.private_bytes(pem, serialization.PrivateFormat.PKCS8, serialization.NoEncryption())
    key.unlink(missing_ok=True)  # its rights too are made anew
    with os.fdopen(os.open(key, os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o600), "wb") as file:
        file.write(secret)
    cert.write_bytes(made.sign(private, hashes.SHA256()).public_bytes(pem))
