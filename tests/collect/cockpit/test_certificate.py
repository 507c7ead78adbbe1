"""Laws: a certificate is made on this machine, for its address, for a year; nobody else reads its key."""

import datetime
import ipaddress

import pytest
from cryptography import x509

from handrail.collect.cockpit import certificate as of_certificate
from handrail.collect.cockpit.certificate import certificate
from handrail.controllers.errors import HandrailError


def read(path):
    return x509.load_pem_x509_certificate(path.read_bytes())


def addresses(path):
    names = read(path).extensions.get_extension_for_class(x509.SubjectAlternativeName).value
    return names.get_values_for_type(x509.IPAddress)


def test_it_is_kept_and_its_key_is_secret(tmp_path):
    cert, key = certificate("192.168.1.20", tmp_path / "new")
    assert key.stat().st_mode & 0o777 == 0o600
    assert addresses(cert) == [ipaddress.ip_address("192.168.1.20")]
    before = cert.read_bytes()
    assert certificate("192.168.1.20", tmp_path / "new") == (cert, key)
    assert cert.read_bytes() == before


def test_one_that_expires_is_made_anew(tmp_path, monkeypatch):
    monkeypatch.setattr(of_certificate, "LASTS", datetime.timedelta(hours=20))
    cert, _ = certificate("127.0.0.2", tmp_path)
    before = read(cert).serial_number
    monkeypatch.undo()
    certificate("127.0.0.2", tmp_path)
    assert read(cert).serial_number != before
    assert read(cert).not_valid_after_utc > datetime.datetime.now(datetime.UTC) + datetime.timedelta(days=300)


def test_one_whose_key_others_can_read_is_made_anew(tmp_path):
    _, key = certificate("127.0.0.2", tmp_path)
    before = key.read_bytes()
    key.chmod(0o644)
    certificate("127.0.0.2", tmp_path)
    assert key.read_bytes() != before
    assert key.stat().st_mode & 0o777 == 0o600


def test_one_of_another_address_is_made_anew(tmp_path):
    cert, _ = certificate("10.0.0.1", tmp_path)
    other, _ = certificate("10.0.0.2", tmp_path)
    other.write_bytes(cert.read_bytes())
    certificate("10.0.0.2", tmp_path)
    assert addresses(other) == [ipaddress.ip_address("10.0.0.2")]


@pytest.mark.parametrize("spoil", ["", "nonsense"])
def test_a_spoilt_one_is_made_anew(tmp_path, spoil):
    cert, _ = certificate("127.0.0.2", tmp_path)
    cert.write_text(spoil)
    certificate("127.0.0.2", tmp_path)
    assert addresses(cert) == [ipaddress.ip_address("127.0.0.2")]


def test_one_for_every_address_names_this_computers(tmp_path):
    cert, _ = certificate("0.0.0.0", tmp_path)
    assert ipaddress.ip_address("127.0.0.1") in addresses(cert)


def test_a_folder_that_cannot_be_written_is_one_line(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(HandrailError, match="certificate in"):
        certificate("127.0.0.2", tmp_path / "file")
