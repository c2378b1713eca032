"""A Unity suite that printed nothing must not count as passed."""

from unity_suites import unproven


def report(*suites):
    return {
        "test_suites": [
            {"env_name": environment, "test_name": name, "status": status, "timestamp": when}
            for environment, name, status, when in suites
        ]
    }


def test_passed_suites_are_proven():
    assert (
        unproven(report(("native", "test_cpg", "PASSED", "now"), ("uno", "test_cpg", "SKIPPED", None)), "native") == []
    )


def test_a_silent_suite_is_named():
    found = unproven(report(("simavr", "test_a", "PASSED", "now"), ("simavr", "test_b", "SKIPPED", "now")), "simavr")
    assert found == ["suite test_b printed no result"]


def test_no_suite_at_all_is_an_error():
    assert unproven(report(("uno", "test_cpg", "SKIPPED", None)), "native") == [
        "no suite was run in environment native"
    ]
