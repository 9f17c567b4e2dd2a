import pytest

from dloftbs.ui.security import Access, security_headers

LOCAL_HOSTS = ["127.0.0.1:8765", "localhost:9000", "[::1]:8765", "127.0.0.1", "127.0.0.2:1"]
FOREIGN_HOSTS = [
    "evil.example:8765", "192.168.1.7:8765", "localhost.evil.example", "127.0.0.1.evil.example", "", None,
    "localhost:port", "user@localhost", "localhost/..", "[::1", "0.0.0.0:8765", "localhost;x", "localhost:1:2",
]  # fmt: skip


@pytest.mark.parametrize("host", LOCAL_HOSTS)
def test_this_machine_is_let_in_by_any_port_since_a_tunnel_has_its_own(host):
    access = Access(token="abc")
    assert access.refusal("abc", host, None) is None
    assert access.refusal("abc", host, f"http://{host}") is None


@pytest.mark.parametrize("host", FOREIGN_HOSTS)
def test_other_names_are_refused(host):
    assert "name" in Access(token="abc").refusal("abc", host, None)


@pytest.mark.parametrize(
    "origin", ["http://evil.example", "null", "https://localhost:1", "http://localhost:2", "http://localhost", ""]
)
def test_pages_of_other_sites_are_refused(origin):
    assert "another site" in Access(token="abc").refusal("abc", "localhost:1", origin)


@pytest.mark.parametrize("token", ["", "ab", "abcd", "ABC", "\N{LATIN SMALL LETTER A WITH GRAVE}bc"])
def test_a_wrong_token_is_refused(token):
    assert "token" in Access(token="abc").refusal(token, "localhost", None)


def test_tokens_are_long_and_differ_and_are_not_shown():
    one, other = Access(), Access()
    assert len(one.token) >= 24
    assert one.token != other.token
    assert one.token not in repr(one)


@pytest.mark.parametrize(
    ("bound", "host", "known"),
    [
        ("0.0.0.0", "192.168.1.7:8765", True),
        ("0.0.0.0", "robot.local:8765", False),  # a name that somebody else's name server may point here
        ("robot.local", "robot.local:8765", True),
        ("robot.local", "Robot.local:8765", True),
        ("192.168.1.7", "192.168.1.7:8765", True),
        ("192.168.1.7", "evil.example", False),
    ],
)
def test_other_addresses_are_known_where_the_command_named_them(bound, host, known):
    assert (Access(bound, "abc").refusal("abc", host, None) is None) == known


def test_the_policy_lets_the_page_use_nothing_but_its_own():
    policy = security_headers("localhost:8765")["Content-Security-Policy"]
    assert "default-src 'none'" in policy
    assert "unsafe" not in policy
    assert "connect-src 'self' ws://localhost:8765" in policy
