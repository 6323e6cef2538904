import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from stribeck.report.text import MINUS, THIN, breakable, count, duration, matched, number, percent, symbol, unit


def parse(text: str) -> float:
    return float(text.replace(MINUS, "-").replace(THIN, ""))


@given(st.floats(min_value=-1e12, max_value=1e12).filter(lambda value: value == 0 or abs(value) > 1e-12))
def test_a_number_is_shown_within_its_last_digit(value: float) -> None:
    assert parse(number(value, 3)) == pytest.approx(value, rel=5.1e-3)


@given(st.floats(min_value=-1e4, max_value=1e4), st.floats(min_value=1e-4, max_value=1e3))
def test_a_value_keeps_the_digits_that_its_error_leaves(value: float, error: float) -> None:
    assert abs(parse(matched(value, error)) - value) <= max(0.051 * error, 0.5)
    if error < 1:
        assert abs(parse(matched(value, error)) - value) <= 0.051 * error


@pytest.mark.parametrize(
    ("shown", "expected"),
    [
        (number(0.0), "0"),
        (number(math.inf), "∞"),
        (number(math.nan), "unknown"),
        (number(-1234.5), f"{MINUS}1234"),
        (number(1.5e9), "1.50e9"),
        (matched(1.23456, 0.031), "1.235"),
        (matched(-92.4, 176.0), f"{MINUS}92"),
        (matched(2.5, 0.0), "2.500"),
        (matched(-0.0002, 0.031), "0.000"),
        (unit("kg m^2"), "kg m²"),
        (percent(0.9996), f"99.9{THIN}%"),
        (percent(0.0002), f"<{THIN}0.1{THIN}%"),
        (percent(1.0), f"100{THIN}%"),
        (percent(0.0), f"0{THIN}%"),
        (percent(-0.034), f"{MINUS}3{THIN}%"),
        (percent(-0.0003), f"0{THIN}%"),
        (count(600000), f"600{THIN}000"),
        (duration(604.0), "10 min 4 s"),
        (duration(7380.0), "2 h 3 min"),
        (symbol("tau_os"), "<i>τ</i><sub>os</sub>"),
        (symbol("Fv-"), f"<i>F</i><sub>v{MINUS}</sub>"),
        (breakable("left_<b>"), "left_<wbr>&lt;b&gt;"),
    ],
)
def test_shown_as_expected(shown: str, expected: str) -> None:
    assert shown == expected
