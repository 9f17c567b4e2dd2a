"""Access to the server: for those who know the token, by a page that this server gave them.

The token is the first part of the path: whoever opens the address that was printed has it, a page of another site has
not. Two more checks keep such pages out should a token leak: the Host header must name this machine by an address or
as the command line did (against DNS rebinding), and a browser's Origin must be the same host.
"""

from __future__ import annotations

import hmac
import ipaddress
import secrets
from dataclasses import dataclass, field
from urllib.parse import urlsplit

LOCAL = "127.0.0.1"
_TOKEN_BYTES = 18


def is_address(name: str) -> bool:
    """Return whether a host is named by its IP address, which no name server can change."""
    try:
        ipaddress.ip_address(name)
    except ValueError:
        return False
    return True


def is_local(host: str) -> bool:
    """Return whether only this machine reaches a server that is bound to a host."""
    return host == "localhost" or (is_address(host) and ipaddress.ip_address(host).is_loopback)


@dataclass(frozen=True)
class Access:
    """The token of a server, and the names by which it may be called.

    Parameters
    ----------
    host : str
        Address that the server is bound to.
    token : str
    """

    host: str = LOCAL
    token: str = field(default_factory=lambda: secrets.token_urlsafe(_TOKEN_BYTES), repr=False)

    def refusal(self, token: str, host: str | None, origin: str | None) -> str | None:
        """Return why a request is refused; None if it is not.

        Parameters
        ----------
        token : str
            As the path has it.
        host, origin : str, optional
            The headers.
        """
        if not self._is_known(host):
            return "this server is not called by that name"
        if origin is not None and origin != f"http://{host}":
            return "the request comes from a page of another site"
        if not hmac.compare_digest(token.encode(), self.token.encode()):
            return "the address lacks the token: open the one that the command printed"
        return None

    def _is_known(self, host: str | None) -> bool:
        """Return whether a Host header names this server; its port may be that of a tunnel."""
        if host is None:
            return False
        try:
            parts = urlsplit(f"//{host}")
            name, _ = parts.hostname, parts.port
        except ValueError:
            return False
        if name is None or parts.netloc != host or "@" in host:
            return False
        if is_local(self.host):
            return is_local(name)
        return is_local(name) or is_address(name) or name == self.host.lower()


def security_headers(host: str) -> dict[str, str]:
    """Return the headers of every answer: nothing but this server's own files and connections may be used."""
    policy = {
        "default-src": "'none'",
        "script-src": "'self'",
        "style-src": "'self'",
        "img-src": "'self' blob: data:",
        "connect-src": f"'self' ws://{host}",
        "base-uri": "'none'",
        "form-action": "'none'",
        "frame-ancestors": "'none'",
    }
    return {
        "Content-Security-Policy": "; ".join(f"{name} {value}" for name, value in policy.items()),
        "X-Content-Type-Options": "nosniff",
        "Referrer-Policy": "no-referrer",
        "Cross-Origin-Opener-Policy": "same-origin",
        "Cross-Origin-Resource-Policy": "same-origin",
        "Cache-Control": "no-store",
    }
