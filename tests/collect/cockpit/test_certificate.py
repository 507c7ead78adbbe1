"""Laws of the certificate: made once, made anew whenever it no longer holds; nobody else reads its key."""

import contextlib
import datetime

import pytest
from cryptography import x509

from handrail.collect.cockpit import certificate as of_certificate
from handrail.collect.cockpit.certificate import certificate
from handrail.collect.cockpit_config import not_serving
from handrail.controllers.errors import HandrailError

HOST = "192.168.1.20"


def read(path):
    return x509.load_pem_x509_certificate(path.read_bytes())


def addresses(path):
    names = read(path).extensions.get_extension_for_class(x509.SubjectAlternativeName).value
    return [str(each) for each in names.get_values_for_type(x509.IPAddress)]


def test_it_is_kept_and_its_key_is_secret(tmp_path):
    cert, key = certificate(HOST, tmp_path / "new")
    assert key.stat().st_mode & 0o777 == 0o600
    assert addresses(cert) == [HOST]
    before = cert.read_bytes()
    assert certificate(HOST, tmp_path / "new") == (cert, key)
    assert cert.read_bytes() == before


SPOILT = {
    "empty": lambda cert, key: cert.write_text(""),
    "nonsense": lambda cert, key: cert.write_text("nonsense"),
    "of another address": lambda cert, key: cert.write_bytes(
        certificate("10.0.0.1", cert.parent)[0].read_bytes()
    ),
    "its key can be read by others": lambda cert, key: key.chmod(0o644),
    "its key is another one's": lambda cert, key: certificate("10.0.0.9", cert.parent)[1].rename(key),
    "without its key": lambda cert, key: key.unlink(),
    "it expires": lambda cert, key: None,
}


@pytest.mark.parametrize("spoilt", SPOILT)
def test_one_that_does_not_hold_is_made_anew(tmp_path, monkeypatch, spoilt):
    with monkeypatch.context() as patch:
        if spoilt == "it expires":
            patch.setattr(of_certificate, "LASTS", datetime.timedelta(hours=20))
        cert, key = certificate(HOST, tmp_path)
    before = key.read_bytes()
    SPOILT[spoilt](cert, key)
    certificate(HOST, tmp_path)
    assert addresses(cert) == [HOST]
    assert key.read_bytes() != before
    assert not_serving(cert, key) == ""
    assert key.stat().st_mode & 0o777 == 0o600
    assert read(cert).not_valid_after_utc > datetime.datetime.now(datetime.UTC) + datetime.timedelta(days=300)


class Asking(contextlib.nullcontext):
    """Stands in for a socket that is asked for its own address."""

    own = "10.1.2.3"

    def __init__(self, *_):
        super().__init__(self)

    def connect(self, _):
        pass

    def getsockname(self):
        return self.own, 1


def test_one_for_every_address_names_this_computers(tmp_path, monkeypatch):
    monkeypatch.setattr(of_certificate.socket, "socket", Asking)
    for Asking.own in ("10.1.2.3", "10.1.2.4"):
        cert, _ = certificate("0.0.0.0", tmp_path)
        assert addresses(cert) == ["127.0.0.1", Asking.own]


def test_a_folder_that_cannot_be_written_is_one_line(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(HandrailError, match="certificate in"):
        certificate(HOST, tmp_path / "file")
