"""The bits that every wheel is held against (scripts/check_bits.py)."""

import json

import check_bits


def test_every_filter_has_the_committed_bits():
    assert check_bits.others(dict(check_bits.all_bits()), json.loads(check_bits.BITS.read_text())) == []


def test_what_differs_is_named():
    assert check_bits.others({"a": "1", "b": "2", "d": "4"}, {"a": "1", "b": "3", "c": "4"}) == [
        "b",
        "c",
        "d",
    ]


def test_one_bit_changes_the_digest():
    results = check_bits.FILTERS["observer"](float)
    before = check_bits.digest(results)
    results[0].view("u8")[-1, 0] ^= 1
    assert check_bits.digest(results) != before
