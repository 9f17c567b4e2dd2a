"""Each error is one of the package's and also the built-in one that it stands for."""

from __future__ import annotations

import pickle

import pytest

from dloftbs import errors

BUILT_IN = {
    errors.InputError: ValueError,
    errors.ConfigError: ValueError,
    errors.SourceError: OSError,
    errors.SinkError: OSError,
}


@pytest.mark.parametrize(("kind", "built_in"), BUILT_IN.items())
def test_an_error_is_caught_as_the_package_s_and_as_the_built_in(kind, built_in):
    for caught in (errors.DloftbsError, built_in, kind):
        with pytest.raises(caught, match=r"^what went wrong$"):
            raise kind("what went wrong")


@pytest.mark.parametrize("kind", BUILT_IN)
def test_an_error_is_none_of_its_siblings(kind):
    siblings = [other for other in BUILT_IN if other is not kind]
    assert not any(issubclass(kind, sibling) for sibling in siblings)


@pytest.mark.parametrize("kind", BUILT_IN)
def test_an_error_comes_whole_out_of_another_process(kind):
    error = pickle.loads(pickle.dumps(kind("what went wrong")))
    assert type(error) is kind
    assert str(error) == "what went wrong"


@pytest.mark.parametrize("kind", BUILT_IN)
def test_a_long_message_loses_its_middle(kind):
    error = kind(f"cannot read: {'x' * 76_000} at the end")
    assert str(error).startswith("cannot read: xxx")
    assert str(error).endswith("xxx at the end")
    assert " [72024 characters left out] " in str(error)
    assert str(kind("y" * 4000)) == "y" * 4000


def test_every_error_of_the_module_is_listed_here():
    defined = {value for value in vars(errors).values() if isinstance(value, type)}
    assert defined == {errors.DloftbsError, *BUILT_IN}
