"""Make a certificate authority of your own, and certificates for a sim, a router, an operator and an observer.

    python make_certificates.py certificates --hosts sim-machine.lab 192.168.1.20

Files that are there already are kept: remove one and run this again to have it made anew. Keys are readable by you alone
(mode 0600); only ca.pem and a certificate with its own key belong on another machine. Needs the `cryptography` package.
"""

from __future__ import annotations

import argparse
import ipaddress
import os
from datetime import UTC, datetime, timedelta
from pathlib import Path

from cryptography import x509
from cryptography.hazmat.primitives import hashes, serialization
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.x509.oid import ExtendedKeyUsageOID, NameOID

SERVERS = ("sim", "router")
CLIENTS = ("operator", "observer")
LOCAL = ("localhost", "127.0.0.1", "::1")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("folder", type=Path, nargs="?", default=Path("certificates"), help="where the files go")
    parser.add_argument("--hosts", nargs="*", default=[], help="names and addresses under which sim and router are met")
    parser.add_argument("--days", type=int, default=365, help="how long the certificates hold")
    arguments = parser.parse_args()
    make_all(arguments.folder, hosts=arguments.hosts, days=arguments.days)


def make_all(folder: Path, *, hosts: list[str], days: int = 365) -> None:
    """Make what is missing in a folder.

    Args:
        folder: Where the files go; made with mode 0700.
        hosts: Names and IP addresses of the sim's and the router's machine, besides this one's loopback.
        days: How long the certificates hold; the authority holds ten times as long.
    """
    folder.mkdir(mode=0o700, parents=True, exist_ok=True)
    authority_key = private_key(folder / "ca.key")
    authority = authority_certificate(folder / "ca.pem", authority_key, days=10 * days)
    for name in SERVERS + CLIENTS:
        file = folder / f"{name}.pem"
        if file.exists():
            continue
        key = private_key(folder / f"{name}.key")
        names = [*LOCAL, *hosts] if name in SERVERS else []
        write(file, pem(certificate(name, key, authority, authority_key, names=names, days=days)))
        print(f"made {file} for {', '.join(names) or f'the {name}'}")


def authority_certificate(file: Path, key: ec.EllipticCurvePrivateKey, *, days: int) -> x509.Certificate:
    """Return the authority's certificate, made if it is not there."""
    if file.exists():
        return x509.load_pem_x509_certificate(file.read_bytes())
    name = common_name("RoboSandbox CA")
    made = (
        begin(name, name, key, days)
        .add_extension(x509.BasicConstraints(ca=True, path_length=0), critical=True)
        .add_extension(usage(signs_certificates=True), critical=True)
        .sign(key, hashes.SHA256())
    )
    write(file, pem(made))
    print(f"made {file}, the authority; keep ca.key where no sim and no client runs")
    return made


def certificate(
    name: str,
    key: ec.EllipticCurvePrivateKey,
    authority: x509.Certificate,
    authority_key: ec.EllipticCurvePrivateKey,
    *,
    names: list[str],
    days: int,
) -> x509.Certificate:
    """Return a certificate whose common name is what access control knows its owner by."""
    # A sim is a client of its router, so servers may call too.
    purposes = [ExtendedKeyUsageOID.CLIENT_AUTH] + [ExtendedKeyUsageOID.SERVER_AUTH] * bool(names)
    builder = (
        begin(common_name(name), authority.subject, key, days)
        .add_extension(x509.BasicConstraints(ca=False, path_length=None), critical=True)
        .add_extension(usage(signs_certificates=False), critical=True)
        .add_extension(x509.ExtendedKeyUsage(purposes), critical=False)
        .add_extension(x509.SubjectAlternativeName([subject(item) for item in names or [name]]), critical=False)
    )
    return builder.sign(authority_key, hashes.SHA256())


def begin(subject: x509.Name, issuer: x509.Name, key: ec.EllipticCurvePrivateKey, days: int) -> x509.CertificateBuilder:
    now = datetime.now(UTC)
    return (
        x509.CertificateBuilder()
        .subject_name(subject)
        .issuer_name(issuer)
        .public_key(key.public_key())
        .serial_number(x509.random_serial_number())
        # Clocks of two machines differ.
        .not_valid_before(now - timedelta(minutes=10))
        .not_valid_after(now + timedelta(days=days))
    )


def common_name(name: str) -> x509.Name:
    return x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, name)])


def subject(host: str) -> x509.GeneralName:
    try:
        return x509.IPAddress(ipaddress.ip_address(host))
    except ValueError:
        return x509.DNSName(host)


def usage(*, signs_certificates: bool) -> x509.KeyUsage:
    return x509.KeyUsage(
        digital_signature=not signs_certificates,
        key_cert_sign=signs_certificates,
        crl_sign=signs_certificates,
        content_commitment=False,
        key_encipherment=False,
        data_encipherment=False,
        key_agreement=False,
        encipher_only=False,
        decipher_only=False,
    )


def private_key(file: Path) -> ec.EllipticCurvePrivateKey:
    """Return the key in a file, made if it is not there."""
    if file.exists():
        found = serialization.load_pem_private_key(file.read_bytes(), password=None)
        if not isinstance(found, ec.EllipticCurvePrivateKey):
            raise SystemExit(f"{file}: is no elliptic curve key; remove it to have one made")
        return found
    made = ec.generate_private_key(ec.SECP256R1())
    write(
        file,
        made.private_bytes(serialization.Encoding.PEM, serialization.PrivateFormat.PKCS8, serialization.NoEncryption()),
        mode=0o600,
    )
    return made


def pem(made: x509.Certificate) -> bytes:
    return made.public_bytes(serialization.Encoding.PEM)


def write(file: Path, content: bytes, *, mode: int = 0o644) -> None:
    """Write a new file that has its mode from the start."""
    with os.fdopen(os.open(file, os.O_WRONLY | os.O_CREAT | os.O_EXCL, mode), "wb") as out:
        out.write(content)


if __name__ == "__main__":
    main()
