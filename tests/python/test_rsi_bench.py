"""The row of libFuzzer in the bench of the link."""

import stat
import sys

import pytest

from conftest import ROOT

sys.path[:0] = [str(ROOT / "tools/benchmarks")]
import rsi as bench

CRASH = "SUMMARY: AddressSanitizer: heap-buffer-overflow in decode"


@pytest.fixture
def fuzzer(tmp_path):
    """A program that says what libFuzzer does, and leaves its words."""

    def make(text, code):
        file = tmp_path / "telegram_fuzz"
        file.write_text(f"#!/bin/sh\necho \"$@\" > {tmp_path}/words\necho '{text}' >&2\nexit {code}\n")
        file.chmod(file.stat().st_mode | stat.S_IXUSR)
        return file

    return make


def test_a_run_without_finding_says_how_many_telegrams_were_tried(fuzzer, tmp_path):
    row = bench.fuzz_row(fuzzer("stat::number_of_executed_units: 123456", 0), 7)
    assert row.reached and row.ours == "123456, no finding" and "7 s of libFuzzer" in row.what
    words = (tmp_path / "words").read_text().split()
    assert words[1] == str(bench.CORPUS) and bench.CORPUS.is_dir() and "-max_total_time=7" in words


def test_a_finding_is_not_reached_and_told(fuzzer):
    row = bench.fuzz_row(fuzzer(CRASH, 77), 7)
    assert not row.reached and CRASH in row.ours
